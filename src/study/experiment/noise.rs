//! Effect of instrument noise during alignment and navigation. This effect is the same after every calibration and is
//! therefore treated separately.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::spread::Spread;
use crate::earth::{ROTATION_RATE, normal_gravity};
use crate::imu::{Noise, PerSensor};
use crate::navigation::error_model::{ATTITUDE, INPUTS, InputMatrix, STATES};
use crate::navigation::{ErrorMatrix, Instant, NavigationError, Solution};
use crate::study::navigation::{INTERVAL, Mission, Motion, NavigationStudyError};

/// Duration of self-alignment at rest, s.
pub const ALIGNMENT_TIME: f64 = 600.0;
/// Step for a body at rest, and for a moving one, s: noise is isotropic, so turns need no fine
/// steps.
const STANDING_STEP: f64 = 10.0;
const MOVING_STEP: f64 = 1.0;
/// Number of draws for the distribution of the length of an error.
const DRAWS: usize = 20_000;

type Inputs = SVector<f64, INPUTS>;
type InputCovariance = SMatrix<f64, INPUTS, INPUTS>;
/// Joint covariance of the navigation errors and the Gauss–Markov biases that cause them.
type Joint = SMatrix<f64, { STATES + INPUTS }, { STATES + INPUTS }>;

/// Variances of the noise of the sensed rate and force.
struct Variances {
    /// Variance of the integral over a second.
    white: Inputs,
    /// Variance of the Gauss–Markov bias.
    bias: Inputs,
    correlation_time: Inputs,
}

impl Variances {
    fn of(noise: &PerSensor<Noise>) -> Self {
        let each = |value: &dyn Fn(&Noise) -> f64| {
            Inputs::from_fn(|i, _| value(if i < 3 { &noise.gyro } else { &noise.accel }))
        };
        Self {
            white: each(&|n| n.random_walk.powi(2)),
            bias: each(&|n| n.gauss_markov.map_or(0.0, |i| i.sigma.powi(2))),
            correlation_time: each(&|n| {
                n.gauss_markov.map_or(f64::INFINITY, |i| i.correlation_time)
            }),
        }
    }
}

/// Covariance of the final horizontal position error, east and north, m². If the instrument aligned itself, `aligned`
/// gives the errors at the start for a unit error of the sensed rate and force.
pub fn position(
    mission: &Mission,
    aligned: Option<InputMatrix>,
    noise: &PerSensor<Noise>,
) -> Result<Matrix2<f64>, NavigationStudyError> {
    let variances = Variances::of(noise);
    let bias = InputCovariance::from_diagonal(&variances.bias);
    let aligned = aligned.unwrap_or_default();
    let mean = bias + InputCovariance::from_diagonal(&(variances.white / ALIGNMENT_TIME));
    let mut covariance = joint(
        &(aligned * mean * aligned.transpose()),
        &(aligned * bias),
        &bias,
    );
    covariance.fill_lower_triangle_with_upper_triangle();
    let mut advance = |step: &Step| {
        let moved = step.transition * covariance * step.transition.transpose();
        covariance = moved + step.added;
    };
    let duration = f64::from(mission.intervals) * INTERVAL;
    let end = match &mission.motion {
        Motion::Standing(at) => {
            let step = Step::new(&at.steady(), STANDING_STEP, &variances);
            for _ in 0..(duration / STANDING_STEP).round() as u64 {
                advance(&step);
            }
            *at
        }
        Motion::Moving(trajectory) => {
            let mut strides = trajectory.strides();
            for number in 0..(duration / MOVING_STEP).round() as u32 {
                strides.pass((f64::from(number) + 0.5) * MOVING_STEP);
                advance(&Step::new(strides.here(), MOVING_STEP, &variances));
            }
            strides.pass(duration);
            strides.here().truth
        }
    };
    let by_state = NavigationError::by_state(&end).ok_or(NavigationStudyError::Upright)?;
    let by_state = by_state.fixed_rows::<2>(6).into_owned();
    let errors = covariance.fixed_view::<STATES, STATES>(0, 0);
    Ok(by_state * errors * by_state.transpose())
}

/// A matrix of four blocks; the block of biases by errors is zero.
fn joint(errors: &ErrorMatrix, between: &InputMatrix, bias: &InputCovariance) -> Joint {
    let mut joint = Joint::zeros();
    joint
        .fixed_view_mut::<STATES, STATES>(0, 0)
        .copy_from(errors);
    joint
        .fixed_view_mut::<STATES, INPUTS>(0, STATES)
        .copy_from(between);
    joint
        .fixed_view_mut::<INPUTS, INPUTS>(STATES, STATES)
        .copy_from(bias);
    joint
}

/// The linear model over a step, with process noise.
struct Step {
    transition: Joint,
    added: Joint,
}

impl Step {
    fn new(at: &Instant, duration: f64, variances: &Variances) -> Self {
        let transition = at.linear_model().over(duration);
        let keep = variances
            .correlation_time
            .map(|time| (-duration / time).exp());
        // White noise as a constant over the step, with the variance of its mean.
        let white = InputCovariance::from_diagonal(&(variances.white / duration));
        let bias_added = variances.bias.zip_map(&keep, |v, k| v * (1.0 - k * k));
        let diagonal = InputCovariance::from_diagonal;
        Self {
            transition: joint(&transition.errors, &transition.input, &diagonal(&keep)),
            added: joint(
                &(transition.input * white * transition.input.transpose()),
                &InputMatrix::zeros(),
                &diagonal(&bias_added),
            ),
        }
    }
}

/// Distribution of the length of a normal vector with this covariance.
pub fn spread(covariance: &Matrix2<f64>) -> Spread {
    let eigen = covariance.symmetric_eigen();
    let sigma = eigen.eigenvalues.map(|v| v.max(0.0).sqrt());
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut draw = || rng.sample::<f64, _>(StandardNormal);
    Spread::of((0..DRAWS).map(|_| Vector2::new(sigma.x * draw(), sigma.y * draw()).norm()))
}

/// Errors at the start, for a unit error of the sensed rate (rad/s) and specific force (m/s²) along body axes. The body
/// is at rest, levels itself with its accelerometers and finds north with its gyros.
///
/// With the computed attitude, the sensed force points up and the sensed rate has no East component. With `C_computed =
/// (I − [φ×]) C` and sensed `u + δu`, δu in East-North-Up, to first order
///
/// ```text
/// 0 = ∇ − φ × (0, 0, g)                  φ_E = −∇_N / g,   φ_N = ∇_E / g
/// 0 = ε_E − (φ × ω_ie)_E                 φ_U = φ_N tan L − ε_E / (Ω cos L)
/// ```
///
/// (Groves, 2nd ed., §5.6.2, gives the same equations in North-East-Down.)
pub fn by_itself(at: &Solution) -> InputMatrix {
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
            // The neglected terms are of second order: 0.2° of heading squared.
            assert_abs_diff_eq!(linear, phi, epsilon = 1e-2 * phi.amax());
            assert!(phi.amax() > 0.05 * DEGREE);
        }
    }
}
