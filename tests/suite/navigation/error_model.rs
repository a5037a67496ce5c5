use nalgebra::{Complex, SMatrix, SVector, Vector3};
use serde_json::Value;
use turncal::attitude::{exp, from_pitch_roll_heading, log};
use turncal::earth::{Curvature, ROTATION_RATE, normal_gravity};
use turncal::imu::{InstallationForm, PerSensor, Sensor, Triad, TriadVector};
use turncal::navigation::error_model::{INPUTS, PARAMETERS, STATES};
use turncal::navigation::{
    ErrorModel, ErrorVector, Height, Increments, Instant, NavigationError, SensedErrors,
    Sensitivity, Solution, Strapdown,
};
use turncal::units::{ARCSEC, DEG_PER_H, DEGREE, MICRO_G, NAUTICAL_MILE, PPM};

use super::{HOUR, Sensed, hourly, numbers, standing};

const HELD: Height = Height::Held {
    height: 0.0,
    velocity: 0.0,
};

/// Largest differences of the linear model from hourly pitch, roll, heading (°), velocity (m/s) and
/// position (nmile) of a body that stands.
pub fn apart_from(expected: &Value, truth: &Solution, error: Sensed) -> [f64; 3] {
    let force = truth.steady().force;
    let step = ErrorModel::about(truth, &force, HELD).over(HOUR);
    let h = NavigationError::by_state(truth).unwrap();
    let mut sensitivity = Sensitivity::<INPUTS>::zeros();
    let mut apart = [0f64; 3];
    for row in expected.as_array().unwrap() {
        let row = numbers(row);
        let found = h * sensitivity * error.input();
        let attitude = found.fixed_rows::<3>(0) / DEGREE;
        let differences = [
            (attitude - Vector3::new(row[0], row[1], row[2])).amax(),
            found.fixed_rows::<2>(3).norm() - row[3],
            found.fixed_rows::<2>(6).norm() / NAUTICAL_MILE - row[4],
        ];
        for (apart, difference) in apart.iter_mut().zip(differences) {
            *apart = apart.max(difference.abs());
        }
        sensitivity = step.errors * sensitivity + step.input;
    }
    apart
}

/// Periods in s of the natural motions of the held model.
fn periods(truth: &Solution) -> Vec<f64> {
    let force = truth.steady().force;
    let dynamics = ErrorModel::about(truth, &force, HELD).dynamics;
    let modes = dynamics.complex_eigenvalues();
    let mut periods: Vec<f64> = modes
        .iter()
        .filter(|mode: &&Complex<f64>| mode.im > 1e-6)
        .map(|mode| std::f64::consts::TAU / mode.im)
        .collect();
    periods.sort_by(f64::total_cmp);
    periods
}

#[test]
fn the_linear_model_swings_with_schuler_foucault_and_a_day() {
    let latitude = 45.0 * DEGREE;
    let found = periods(&standing(latitude));
    let radii = Curvature::at(latitude);
    let radius = (radii.meridian * radii.prime_vertical).sqrt();
    let schuler = (normal_gravity(latitude, 0.0) / radius).sqrt();
    let foucault = ROTATION_RATE * latitude.sin();
    let expected = [schuler + foucault, schuler - foucault, ROTATION_RATE]
        .map(|rate| std::f64::consts::TAU / rate);
    assert_eq!(found.len(), 3);
    for (found, expected) in found.iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
    }
    let minutes = std::f64::consts::TAU / schuler / 60.0;
    assert!((minutes - 84.4).abs() < 0.1, "{minutes}");
}

/// Times at which a sampled quantity goes through zero, linearly between samples.
fn crossings(samples: &[f64], step: f64) -> Vec<f64> {
    let pairs = samples.windows(2).enumerate();
    pairs
        .filter(|(_, pair)| pair[0] * pair[1] < 0.0)
        .map(|(k, pair)| (k as f64 + pair[0] / (pair[0] - pair[1])) * step)
        .collect()
}

/// Navigation of a standing body from a wrong start; latitude and north velocity errors each 60 s.
fn swing(truth: &Solution, start: Solution, hours: f64) -> (Vec<f64>, Vec<f64>) {
    let Instant { rate, force, .. } = truth.steady();
    let step = 60.0;
    let increments = Increments {
        angle: rate * step,
        velocity: force * step,
    };
    let mut navigation = Strapdown::new(start, step).unwrap();
    (0..(hours * HOUR / step) as usize)
        .map(|_| {
            navigation.advance(&increments, HELD).unwrap();
            let at = navigation.solution();
            (at.latitude - truth.latitude, at.velocity.y)
        })
        .unzip()
}

#[test]
fn a_wrong_start_velocity_swings_with_the_period_of_schuler() {
    // At the equator the pendulum's plane does not turn.
    let truth = standing(0.0);
    let start = Solution {
        velocity: Vector3::new(0.0, 1.0, 0.0),
        ..truth
    };
    let (_, velocity) = swing(&truth, start, 24.0);
    let at = crossings(&velocity, 60.0);
    let period = 2.0 * (at[at.len() - 1] - at[0]) / (at.len() - 1) as f64;
    let expected =
        std::f64::consts::TAU * (Curvature::at(0.0).meridian / normal_gravity(0.0, 0.0)).sqrt();
    assert!(
        (period / expected - 1.0).abs() < 1e-3,
        "{period} {expected}"
    );
}

#[test]
fn a_solution_turned_in_inertial_space_comes_back_after_a_day() {
    // Position, velocity and attitude turned by one rotation about an axis in the equator: navigation
    // cannot know, and the Earth turns under the axis once in a sidereal day.
    let truth = standing(40.0 * DEGREE);
    let turned = 1e-4;
    let latitude = truth.latitude + turned;
    let start = Solution {
        latitude,
        velocity: Vector3::new(
            Curvature::at(latitude).prime_vertical * ROTATION_RATE * turned * latitude.sin(),
            0.0,
            0.0,
        ),
        ..truth
    };
    let (north, _) = swing(&truth, start, 44.0);
    let at = crossings(&north, 60.0);
    let quarter = std::f64::consts::FRAC_PI_2 / ROTATION_RATE;
    assert_eq!(at.len(), 4, "{at:?}");
    for (found, quarters) in at.iter().zip([1.0, 3.0, 5.0, 7.0]) {
        assert!((found / quarter - quarters).abs() < 0.02, "{found}");
    }
}

#[test]
fn linear_and_nonlinear_models_agree_within_one_percent_of_the_largest_error() {
    let truth = Solution {
        attitude: from_pitch_roll_heading(0.1, -0.2, 2.0),
        ..standing(-42.0 * DEGREE)
    };
    let force = truth.steady().force;
    let model = ErrorModel::about(&truth, &force, HELD).over(HOUR);
    let cases = [
        (
            Vector3::new(-1.6, 7.0, 7.8) * (1e-3 * DEG_PER_H),
            Vector3::zeros(),
        ),
        (
            Vector3::zeros(),
            // What of it is vertical changes the Schuler period, a product of errors that grows for 40 h:
            // 0.2 mg would already be 2 % of velocity.
            Vector3::new(100.0, -170.0, 0.2) * MICRO_G,
        ),
    ];
    for (gyro, accel) in cases {
        let nonlinear = hourly(&truth, &truth, Sensed { gyro, accel }, 10.0, 40);
        let input = Sensed { gyro, accel }.input();
        let mut sensitivity = Sensitivity::<INPUTS>::zeros();
        let mut largest = SVector::<f64, STATES>::zeros();
        let mut apart = largest;
        for nonlinear in nonlinear {
            let linear = truth.with_errors(&(sensitivity * input));
            let linear = NavigationError::of(&linear, &truth).to_vector();
            largest = largest.sup(&nonlinear.to_vector().abs());
            apart = apart.sup(&(linear - nonlinear.to_vector()).abs());
            sensitivity = model.errors * sensitivity + model.input;
        }
        for figure in [0, 1, 2, 3, 4, 6, 7] {
            let part = apart[figure] / largest[figure];
            assert!(part < 0.01, "figure {figure}: {part}");
        }
    }
}

#[test]
fn the_linear_model_is_the_derivative_of_navigation_while_flying() {
    let truth = Solution {
        attitude: from_pitch_roll_heading(0.3, -0.8, -2.0),
        velocity: Vector3::new(-180.0, 160.0, 12.0),
        latitude: -1.0,
        longitude: 0.4,
        height: 8000.0,
    };
    let Instant { rate, force, .. } = truth.steady();
    let period = 0.5;
    let end = truth.height + truth.velocity.z * period;
    let held = Height::Held {
        height: end,
        velocity: truth.velocity.z,
    };
    let navigate = |start: &Solution, input: &SVector<f64, INPUTS>, height: Height| {
        let increments = Increments {
            angle: (rate + input.fixed_rows::<3>(0)) * period,
            velocity: (force + input.fixed_rows::<3>(3)) * period,
        };
        let mut navigation = Strapdown::new(*start, period).unwrap();
        navigation.advance(&increments, height).unwrap();
        *navigation.solution()
    };
    for height in [Height::Free, held] {
        let is_held = height == held;
        // Linearised in the middle of the step, as velocity and position change.
        let middle = Solution {
            latitude: truth.latitude + 0.25 * 160.0 / 6.39e6,
            height: truth.height + 0.25 * truth.velocity.z,
            ..truth
        };
        let model = ErrorModel::about(&middle, &force, height).over(period);
        let nominal = navigate(&truth, &SVector::zeros(), height);
        // As large as errors may be for the second order to stay away, as small as rounding allows.
        let sizes =
            ErrorVector::from_column_slice(&[1e-4, 1e-4, 1e-4, 1.0, 1.0, 1.0, 1e-4, 1e-4, 100.0]);
        for state in (0..STATES).filter(|&state| !(is_held && (state == 5 || state == 8))) {
            let shifted = |sign: f64| {
                let mut at_start = ErrorVector::zeros();
                at_start[state] = sign * sizes[state];
                let end = navigate(&truth.with_errors(&at_start), &SVector::zeros(), height);
                errors(&end, &nominal)
            };
            let derivative = (shifted(1.0) - shifted(-1.0)) / 2.0;
            compare(
                &(model.errors.column(state) * sizes[state]),
                &derivative,
                &sizes,
                state,
            );
        }
        for input in 0..INPUTS {
            let size = if input < 3 { 1e-4 } else { 1.0 };
            let shifted = |sign: f64| {
                let mut input_errors = SVector::<f64, INPUTS>::zeros();
                input_errors[input] = sign * size;
                errors(&navigate(&truth, &input_errors, height), &nominal)
            };
            let derivative = (shifted(1.0) - shifted(-1.0)) / 2.0;
            compare(
                &(model.input.column(input) * size),
                &derivative,
                &sizes,
                STATES + input,
            );
        }
    }
}

/// The errors of a computed solution against the true one.
fn errors(computed: &Solution, truth: &Solution) -> ErrorVector {
    let turned = log(&(computed.attitude * truth.attitude.transpose()));
    let velocity = computed.velocity - truth.velocity;
    let position = [
        computed.latitude - truth.latitude,
        computed.longitude - truth.longitude,
        computed.height - truth.height,
    ];
    ErrorVector::from_iterator(
        (-turned)
            .iter()
            .chain(velocity.iter())
            .chain(&position)
            .copied(),
    )
}

/// What changes in half a second is a millionth and less of the sizes in many places, so the floor is
/// far below.
fn compare(model: &ErrorVector, derivative: &ErrorVector, sizes: &ErrorVector, column: usize) {
    for row in 0..STATES {
        let (model, derivative) = (model[row] / sizes[row], derivative[row] / sizes[row]);
        assert!(
            (model - derivative).abs() < 2e-9 + 2e-4 * derivative.abs().min(0.1),
            "row {row} column {column}: {model:e} {derivative:e}"
        );
    }
}

#[test]
fn the_discrete_form_is_exact_over_hours() {
    let truth = standing(0.6);
    let force = truth.steady().force;
    let model = ErrorModel::about(&truth, &force, HELD);
    let whole = model.over(4.0 * HOUR);
    let part = model.over(60.0);
    let mut sensitivity = Sensitivity::<INPUTS>::zeros();
    for _ in 0..240 {
        sensitivity = part.errors * sensitivity + part.input;
    }
    let unit = whole.input.map(|v| v.abs().max(1e-3));
    let apart = (whole.input - sensitivity).component_div(&unit);
    assert!(apart.amax() < 1e-8, "{apart:e}");
}

#[test]
fn covariance_of_a_calibration_gives_the_errors_that_its_parameters_cause() {
    let truth = Solution {
        attitude: exp(Vector3::new(0.3, -0.2, 0.9)),
        ..standing(0.7)
    };
    let ideal = PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General));
    let at = truth.steady();
    let Instant { rate, force, .. } = at;
    let sensed = SensedErrors::new(&ideal).unwrap().at(&at);
    let step = ErrorModel::about(&truth, &force, HELD).over(HOUR);
    let mut sensitivity = Sensitivity::<PARAMETERS>::zeros();
    for _ in 0..10 {
        sensitivity = step.errors * sensitivity + step.input * sensed;
    }
    let h = NavigationError::by_state(&truth).unwrap();
    for (place, sensor) in Sensor::ALL.into_iter().enumerate() {
        let bias = [1e-2 * DEG_PER_H, 30.0 * MICRO_G][place];
        let sizes = TriadVector::from_fn(|i, _| match i {
            0..3 => 100.0 * PPM,
            3..9 => 10.0 * ARCSEC,
            _ => bias,
        });
        for parameter in 0..sizes.len() {
            let mut true_triads = ideal;
            let mut v = ideal.get(sensor).to_vector();
            v[parameter] += sizes[parameter];
            *true_triads.get_mut(sensor) = Triad::from_vector(InstallationForm::General, &v);
            let error = Sensed {
                gyro: true_triads.gyro.output(&rate) - rate,
                accel: true_triads.accel.output(&force) - force,
            };
            let nonlinear = hourly(&truth, &truth, error, 10.0, 10)[10].to_vector();
            let mut covariance = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
            let index = 12 * place + parameter;
            covariance[(index, index)] = sizes[parameter].powi(2);
            let predicted = h * sensitivity;
            let predicted = predicted * covariance * predicted.transpose();
            for figure in [0, 1, 2, 3, 4, 6, 7] {
                let sigma = predicted[(figure, figure)].sqrt();
                let of_block = predicted.diagonal().rows(3 * (figure / 3), 3).sum().sqrt();
                assert!(
                    (nonlinear[figure].abs() - sigma).abs() < 1e-2 * of_block,
                    "{sensor:?} {parameter} figure {figure}: {} {sigma}",
                    nonlinear[figure]
                );
            }
        }
    }
}
