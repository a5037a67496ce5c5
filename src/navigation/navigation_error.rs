//! Navigation errors in the form in which they are reported.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector3};

use super::errors::{ATTITUDE, ErrorMatrix, ErrorVector, POSITION, VELOCITY, blocks, joined};
use super::strapdown::Solution;
use crate::attitude::to_pitch_roll_heading;
use crate::earth::Curvature;

/// Errors, computed − true, at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NavigationError {
    /// Pitch, roll and heading in rad, within ±π; differences of the angles of
    /// `C_b_n = Rz(−heading) Rx(pitch) Ry(roll)`.
    pub attitude: Vector3<f64>,
    /// Velocity, East-North-Up, m/s.
    pub velocity: Vector3<f64>,
    /// Position error in m on the ellipsoid: `R_N cos L δλ` east (with the true latitude), `R_M δL` north, and the
    /// height error.
    pub position: Vector3<f64>,
}

impl NavigationError {
    /// Errors of a computed solution relative to the true one.
    pub fn of(computed: &Solution, truth: &Solution) -> Self {
        let [found, expected] =
            [computed, truth].map(|s| Vector3::from(to_pitch_roll_heading(&s.attitude)));
        let [east, north] = metres_per_radian(truth);
        Self {
            attitude: (found - expected).map(wrapped),
            velocity: computed.velocity - truth.velocity,
            position: Vector3::new(
                east * wrapped(computed.longitude - truth.longitude),
                north * (computed.latitude - truth.latitude),
                computed.height - truth.height,
            ),
        }
    }

    /// Horizontal velocity error in m/s.
    pub fn horizontal_velocity(&self) -> f64 {
        self.velocity.xy().norm()
    }

    /// Horizontal position error in m.
    pub fn horizontal_position(&self) -> f64 {
        self.position.xy().norm()
    }

    /// Pitch, roll and heading, then velocity, then position, which is the order of [`Self::by_state`].
    pub fn to_vector(&self) -> ErrorVector {
        joined([self.attitude, self.velocity, self.position])
    }

    /// `H`, which converts the states of the linear error model to these errors about a true state, and
    /// their covariance `P` to `H P Hᵀ`. `None` at a pitch of ±90°, where roll and heading cannot be
    /// distinguished.
    pub fn by_state(truth: &Solution) -> Option<ErrorMatrix> {
        let [pitch, _, heading] = to_pitch_roll_heading(&truth.attitude);
        let ((sin_p, cos_p), (sin_h, cos_h)) = (pitch.sin_cos(), heading.sin_cos());
        // A change of each angle rotates the body by −φ.
        let axes = Matrix3::from_columns(&[
            Vector3::new(cos_h, -sin_h, 0.0),
            Vector3::new(sin_h * cos_p, cos_h * cos_p, sin_p),
            -Vector3::z(),
        ]);
        let [east, north] = metres_per_radian(truth);
        let metres = Matrix3::new(0.0, east, 0.0, north, 0.0, 0.0, 0.0, 0.0, 1.0);
        Some(blocks(&[
            (0, ATTITUDE, -axes.try_inverse()?),
            (3, VELOCITY, Matrix3::identity()),
            (6, POSITION, metres),
        ]))
    }
}

/// Metres per radian of longitude and of latitude.
fn metres_per_radian(truth: &Solution) -> [f64; 2] {
    let radii = Curvature::at(truth.latitude);
    [radii.prime_vertical * truth.latitude.cos(), radii.meridian]
}

fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::from_pitch_roll_heading;
    use crate::navigation::error_model::STATES;
    use crate::units::{DEGREE, NAUTICAL_MILE};
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    fn truth() -> Solution {
        Solution {
            attitude: from_pitch_roll_heading(0.4, -0.9, PI - 5e-5),
            velocity: Vector3::new(10.0, -20.0, 1.0),
            latitude: -0.6,
            longitude: PI - 5e-5,
            height: 500.0,
        }
    }

    #[test]
    fn a_minute_of_latitude_is_a_nautical_mile() {
        let computed = Solution {
            latitude: truth().latitude + DEGREE / 60.0,
            ..truth()
        };
        let miles = NavigationError::of(&computed, &truth()).horizontal_position() / NAUTICAL_MILE;
        assert_abs_diff_eq!(miles, 1.0, epsilon = 0.006);
    }

    #[test]
    fn errors_by_state_are_the_derivative_across_the_date_line_and_heading_south() {
        let h = NavigationError::by_state(&truth()).unwrap();
        for state in 0..STATES {
            let step = 1e-4;
            let at = |sign: f64| {
                let mut errors = ErrorVector::zeros();
                errors[state] = sign * step;
                NavigationError::of(&truth().with_errors(&errors), &truth()).to_vector()
            };
            let derivative = (at(1.0) - at(-1.0)) / (2.0 * step);
            assert_relative_eq!(
                h.column(state).into_owned(),
                derivative,
                epsilon = 1e-6,
                max_relative = 1e-6
            );
        }
    }

    #[test]
    fn attitude_errors_of_a_level_body_heading_north_are_minus_minus_plus_phi() {
        let level = Solution {
            attitude: Matrix3::identity(),
            ..truth()
        };
        let h = NavigationError::by_state(&level).unwrap();
        let expected = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
        assert_eq!(h.fixed_view::<3, 3>(0, ATTITUDE).into_owned(), expected);
    }
}
