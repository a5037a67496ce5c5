//! Rotations as direction cosine matrices and rotation vectors.
//!
//! Source: Savage, *Strapdown Analytics*, 2nd ed., §3.2.2; Titterton and Weston, *Strapdown
//! Inertial Navigation Technology*, 2nd ed., §3.6.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// `[v×]`, the matrix for which `skew(v) * a = v × a`.
#[inline]
pub fn skew(v: Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// The rotation matrix `exp([v×])` of a rotation vector in radians.
#[inline]
pub fn exp(v: Vector3<f64>) -> Matrix3<f64> {
    let angle2 = v.norm_squared();
    // Here the next terms of the series are below rounding; most samples at 100 Hz or more take this branch.
    let (s, c) = if angle2 < 1e-4 {
        (
            1.0 - angle2 / 6.0 * (1.0 - angle2 / 20.0 * (1.0 - angle2 / 42.0)),
            0.5 * (1.0 - angle2 / 12.0 * (1.0 - angle2 / 30.0 * (1.0 - angle2 / 56.0))),
        )
    } else {
        let angle = angle2.sqrt();
        (angle.sin() / angle, (1.0 - angle.cos()) / angle2)
    };
    let diagonal = 1.0 - c * angle2;
    Matrix3::new(
        diagonal + c * v.x * v.x,
        c * v.x * v.y - s * v.z,
        c * v.x * v.z + s * v.y,
        c * v.x * v.y + s * v.z,
        diagonal + c * v.y * v.y,
        c * v.y * v.z - s * v.x,
        c * v.x * v.z - s * v.y,
        c * v.y * v.z + s * v.x,
        diagonal + c * v.z * v.z,
    )
}

/// The rotation vector in radians that corresponds to a rotation matrix; its length is at most π.
pub fn log(c: &Matrix3<f64>) -> Vector3<f64> {
    quaternion(c).scaled_axis()
}

/// The rotation matrix nearest to `c`, which must already be a rotation matrix apart from rounding errors (one step of
/// Newton's iteration for the polar decomposition).
#[inline]
pub fn orthonormalised(c: &Matrix3<f64>) -> Matrix3<f64> {
    c * (Matrix3::identity() * 1.5 - c.tr_mul(c) * 0.5)
}

/// The mean of attitudes that are close together; `None` for an empty list.
pub fn mean(attitudes: &[UnitQuaternion<f64>]) -> Option<Matrix3<f64>> {
    let first = attitudes.first()?;
    let back = first.inverse();
    let sum: Vector3<f64> = attitudes
        .iter()
        .map(|attitude| (attitude * back).scaled_axis())
        .sum();
    Some(exp(sum / attitudes.len() as f64) * matrix(first))
}

/// The rotation matrix of a quaternion.
pub fn matrix(attitude: &UnitQuaternion<f64>) -> Matrix3<f64> {
    attitude.to_rotation_matrix().into_inner()
}

/// The quaternion of a rotation matrix.
pub fn quaternion(c: &Matrix3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*c))
}

/// `C_b_n = Rz(−heading) Rx(pitch) Ry(roll)`, from body right-front-up to East-North-Up; all angles are in radians, and
/// heading is clockwise from North.
pub fn from_pitch_roll_heading(pitch: f64, roll: f64, heading: f64) -> Matrix3<f64> {
    let [(sp, cp), (sr, cr), (sh, ch)] = [pitch, roll, heading].map(f64::sin_cos);
    Matrix3::new(
        ch * cr + sh * sp * sr,
        sh * cp,
        ch * sr - sh * sp * cr,
        ch * sp * sr - sh * cr,
        ch * cp,
        -sh * sr - ch * sp * cr,
        -cp * sr,
        sp,
        cp * cr,
    )
}

/// Pitch, roll and heading of `C_b_n` in radians; the inverse of [`from_pitch_roll_heading`]. Pitch is within ±π/2,
/// roll and heading are within ±π; at a pitch of ±π/2, roll and heading cannot be distinguished.
pub fn to_pitch_roll_heading(c: &Matrix3<f64>) -> [f64; 3] {
    // Near ±π/2, the hypotenuse keeps digits that would be lost with an arcsine.
    [
        c[(2, 1)].atan2(c[(2, 0)].hypot(c[(2, 2)])),
        (-c[(2, 0)]).atan2(c[(2, 2)]),
        c[(0, 1)].atan2(c[(1, 1)]),
    ]
}

/// The smallest rotation, as a rotation vector, from a direction to Up.
pub fn tilt(direction: &Vector3<f64>) -> Vector3<f64> {
    let across = direction.cross(&Vector3::z());
    let angle = across.norm().atan2(direction.z);
    // Upside down, there is no smallest rotation; any half turn will do.
    across.try_normalize(0.0).unwrap_or(Vector3::x()) * angle
}

/// An attitude `C_b_n` in which this unit vector in body axes points up.
pub fn level(up: &Vector3<f64>) -> Matrix3<f64> {
    let across = Vector3::ith(up.iamin(), 1.0);
    let east = across.cross(up).normalize();
    Matrix3::from_rows(&[
        east.transpose(),
        up.cross(&east).transpose(),
        up.transpose(),
    ])
}

/// The rotation by a tilt about East and North, followed by a rotation by a heading about Up. The three angles are the
/// components of an attitude error φ in rad. If both angles are small, the rotation is `exp([φ×])`. A heading error
/// does not affect gravity, and in this form even a large heading error leaves the tilt unchanged.
pub fn from_tilt_and_heading(error: &Vector3<f64>) -> Matrix3<f64> {
    exp(Vector3::z() * error.z) * exp(Vector3::new(error.x, error.y, 0.0))
}

/// The tilt about East and North and the heading of a rotation, the inverse of [`from_tilt_and_heading`].
pub fn to_tilt_and_heading(c: &Matrix3<f64>) -> Vector3<f64> {
    let tilt = tilt(&c.row(2).transpose());
    let heading = c * exp(-tilt);
    Vector3::new(tilt.x, tilt.y, heading[(1, 0)].atan2(heading[(0, 0)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn exp_and_log_are_inverse_from_nanoradians_to_half_a_turn() {
        let axis = Vector3::new(0.36, -0.48, 0.8);
        for angle in [1e-9, 1e-4, 0.0099, 0.0101, 1.0, 3.1] {
            let v = axis * angle;
            assert_relative_eq!(log(&exp(v)), v, max_relative = 1e-12, epsilon = 1e-16);
            assert_relative_eq!(
                exp(v),
                Rotation3::from_scaled_axis(v).into_inner(),
                epsilon = 1e-15
            );
        }
    }

    #[test]
    fn heading_east_points_the_front_axis_east() {
        let c = from_pitch_roll_heading(0.0, 0.0, std::f64::consts::FRAC_PI_2);
        assert_relative_eq!(c * Vector3::y(), Vector3::x(), epsilon = 1e-15);
    }

    #[test]
    fn pitch_roll_and_heading_are_turns_about_y_x_and_down_in_this_order() {
        let [pitch, roll, heading] = [0.3, -0.2, 2.9];
        let expected =
            exp(Vector3::z() * -heading) * exp(Vector3::x() * pitch) * exp(Vector3::y() * roll);
        assert_relative_eq!(
            from_pitch_roll_heading(pitch, roll, heading),
            expected,
            epsilon = 1e-15
        );
    }

    #[test]
    fn positive_pitch_lifts_the_nose_and_positive_roll_lowers_the_right_side() {
        let nose = from_pitch_roll_heading(0.1, 0.0, 0.7) * Vector3::y();
        let right = from_pitch_roll_heading(0.0, 0.1, 0.7) * Vector3::x();
        assert!(nose.z > 0.0 && right.z < 0.0);
    }

    #[test]
    fn pitch_roll_and_heading_come_back_from_the_matrix() {
        for angles in [[0.3, -0.2, 2.9], [-1.5, 3.0, -1.7], [0.0, 0.0, 0.0]] {
            let [pitch, roll, heading] = angles;
            let back = to_pitch_roll_heading(&from_pitch_roll_heading(pitch, roll, heading));
            assert_relative_eq!(back[..], angles[..], epsilon = 1e-14);
        }
    }

    #[test]
    fn orthonormalised_removes_a_drift_to_second_order() {
        let c = exp(Vector3::new(0.3, 0.2, -0.1));
        let drifted = c * (1.0 + 1e-7);
        assert_relative_eq!(orthonormalised(&drifted), c, epsilon = 1e-13);
    }

    #[test]
    fn a_heading_of_any_size_leaves_the_tilt_what_it_is() {
        for heading in [-3.0, -0.5, 0.0, 2.0] {
            let error = Vector3::new(3e-3, -2e-3, heading);
            let c = from_tilt_and_heading(&error);
            assert_relative_eq!(to_tilt_and_heading(&c), error, epsilon = 1e-14);
        }
        let small = Vector3::new(1e-6, 2e-6, -3e-6);
        assert_relative_eq!(from_tilt_and_heading(&small), exp(small), epsilon = 1e-11);
    }
}
