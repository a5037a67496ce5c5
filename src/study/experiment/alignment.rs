//! Alignment by the calibrated instrument itself, and what its errors do to it.

use nalgebra::SMatrix;

use crate::earth::{ROTATION_RATE, normal_gravity};
use crate::navigation::Solution;
use crate::navigation::error_model::{ATTITUDE, INPUTS, InputMatrix};

/// Errors at the start of a body that stands and levels itself by its accelerometers and finds North
/// by its gyros, by errors of the sensed rate (rad/s) and specific force (m/s²) along body axes.
///
/// The attitude taken makes the sensed force point up and the sensed rate have no part to the East.
/// With `C_computed = (I − [φ×]) C` and sensed `u + δu`, δu in East-North-Up, to first order
///
/// ```text
/// 0 = ∇ − φ × (0, 0, g)                  φ_E = −∇_N / g,   φ_N = ∇_E / g
/// 0 = ε_E − (φ × ω_ie)_E                 φ_U = φ_N tan L − ε_E / (Ω cos L)
/// ```
///
/// (Groves, 2nd ed., §5.6.2 has the same in North-East-Down.)
pub(super) fn by_itself(at: &Solution) -> InputMatrix {
    let gravity = normal_gravity(at.latitude, at.height);
    let (sin, cos) = at.latitude.sin_cos();
    let mut by_axes = InputMatrix::zeros();
    by_axes[(ATTITUDE, 4)] = -1.0 / gravity;
    by_axes[(ATTITUDE + 1, 3)] = 1.0 / gravity;
    by_axes[(ATTITUDE + 2, 3)] = sin / cos / gravity;
    by_axes[(ATTITUDE + 2, 0)] = -1.0 / (ROTATION_RATE * cos);
    let mut to_axes = SMatrix::<f64, INPUTS, INPUTS>::zeros();
    for triad in [0, 3] {
        to_axes
            .fixed_view_mut::<3, 3>(triad, triad)
            .copy_from(&at.attitude);
    }
    by_axes * to_axes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::{from_pitch_roll_heading, log};
    use crate::navigation::Instant;
    use crate::units::{DEG_PER_H, DEGREE, MICRO_G};
    use approx::assert_abs_diff_eq;
    use nalgebra::{Matrix3, SVector, Vector3};

    #[test]
    fn the_attitude_taken_is_the_one_in_which_sensed_force_is_up_and_sensed_rate_north() {
        for latitude in [34.0, -52.0] {
            let truth = Solution {
                attitude: from_pitch_roll_heading(0.2, -0.3, 2.5),
                velocity: Vector3::zeros(),
                latitude: latitude * DEGREE,
                longitude: 0.0,
                height: 100.0,
            };
            let Instant { rate, force, .. } = truth.steady();
            let gyro = Vector3::new(0.03, -0.02, 0.01) * DEG_PER_H;
            let accel = Vector3::new(20.0, -40.0, 30.0) * MICRO_G;
            // Columns are East, North and Up in body axes as sensed.
            let up = (force + accel).normalize();
            let east = (rate + gyro).cross(&up).normalize();
            let computed = Matrix3::from_columns(&[east, up.cross(&east), up]).transpose();
            let phi = -log(&(computed * truth.attitude.transpose()));

            let mut sensed = SVector::<f64, INPUTS>::zeros();
            sensed.fixed_rows_mut::<3>(0).copy_from(&gyro);
            sensed.fixed_rows_mut::<3>(3).copy_from(&accel);
            let linear = by_itself(&truth) * sensed;
            let linear = linear.fixed_rows::<3>(ATTITUDE).into_owned();
            // What is left out is of second order, 0.2° of heading times itself.
            assert_abs_diff_eq!(linear, phi, epsilon = 1e-2 * phi.amax());
            assert!(phi.amax() > 0.05 * DEGREE);
        }
    }
}
