use super::*;
use crate::attitude::log;
use crate::imu::{InstallationForm, PARAMETERS, TERM_PARAMETERS, Term, TriadVector};
use crate::navigation::ProcessNoise;
use crate::recording::Bridge;
use approx::assert_relative_eq;
use nalgebra::SVector;

const PERIOD: f64 = 0.01;
/// As many as the filter takes into a block.
const SAMPLES: usize = 10;

/// Turning about a wandering axis at about 30°/s while gravity is sensed.
fn record() -> ImuSamples {
    let t = |k: usize| k as f64 * PERIOD;
    ImuSamples::made(
        0.0,
        PERIOD,
        (0..SAMPLES)
            .map(|k| Vector3::new(0.5, 0.3 * t(k), -0.2) * PERIOD)
            .collect::<Vec<_>>(),
        (0..SAMPLES)
            .map(|k| Vector3::new(1.0, -2.0 * t(k), 9.6) * PERIOD)
            .collect::<Vec<_>>(),
    )
}

fn site() -> Site {
    Site::with_normal_gravity(0.6, 0.0, 0.0)
}

fn triads() -> PerSensor<Triad> {
    let v = TriadVector::from_fn(|i, _| f64::from(i < 3) + 0.002 * (i as f64 - 5.0));
    PerSensor::from_fn(|_| Triad::from_vector(InstallationForm::General, &v))
}

fn start() -> State {
    State {
        attitude: exp(Vector3::new(0.4, -0.3, 1.0)),
        velocity: Vector3::new(0.1, -0.2, 0.05),
        position: Vector3::zeros(),
    }
}

fn navigate(triads: &PerSensor<Triad>, state: State) -> Block {
    Navigator::new(&record(), &site(), triads, state)
        .unwrap()
        .advance(0..SAMPLES)
}

/// φ, δV, δp of one computed state against another taken as the truth.
fn error(computed: &State, truth: &State) -> SVector<f64, 9> {
    let mut e = SVector::<f64, 9>::zeros();
    e.fixed_rows_mut::<3>(0)
        .copy_from(&-log(&(computed.attitude * truth.attitude.transpose())));
    e.fixed_rows_mut::<3>(3)
        .copy_from(&(computed.velocity - truth.velocity));
    e.fixed_rows_mut::<3>(6)
        .copy_from(&(computed.position - truth.position));
    e
}

#[test]
fn transition_of_navigation_errors_is_the_derivative_of_navigation() {
    let nominal = navigate(&triads(), start());
    let step = 1e-6;
    for column in 0..9 {
        let mut e = Vector3::zeros();
        e[column % 3] = step;
        let shifted = |sign: f64| {
            let mut state = start();
            match column / 3 {
                0 => state.attitude = exp(-e * sign) * state.attitude,
                1 => state.velocity += e * sign,
                _ => state.position += e * sign,
            }
            error(&navigate(&triads(), state).state, &nominal.state)
        };
        let difference = (shifted(1.0) - shifted(-1.0)) / (2.0 * step);
        // What the Earth turns during half a block is left out of the couplings: 4e-6 of each.
        assert_relative_eq!(
            nominal.navigation.column(column).rows(0, 6).into_owned(),
            difference.rows(0, 6).into_owned(),
            epsilon = 1e-5
        );
        assert_relative_eq!(
            nominal.navigation.column(column).rows(6, 3).into_owned(),
            difference.rows(6, 3).into_owned(),
            epsilon = 5e-3
        );
    }
}

#[test]
fn transition_of_parameter_errors_is_the_derivative_of_navigation() {
    let nominal = navigate(&triads(), start());
    let step = 1e-6;
    for sensor in crate::imu::Sensor::ALL {
        for parameter in 0..PARAMETERS {
            // δθ is true − estimated, so the computed triad goes the other way.
            let shifted = |sign: f64| {
                let mut changed = triads();
                let mut v = changed.get(sensor).to_vector();
                v[parameter] -= sign * step;
                *changed.get_mut(sensor) = Triad::from_vector(InstallationForm::General, &v);
                error(&navigate(&changed, start()).state, &nominal.state)
            };
            let difference = (shifted(1.0) - shifted(-1.0)) / (2.0 * step);
            // Within a sample the tilt's own share of velocity is kept to first order.
            let column = nominal.parameters.get(sensor).column(parameter);
            assert_relative_eq!(
                column.rows(0, 6).into_owned(),
                difference.rows(0, 6).into_owned(),
                epsilon = 3e-5
            );
            // Position moves with t³ by a gyro and with t² by an accelerometer: the first is small.
            let floor = [3e-4, 5e-3][sensor as usize];
            assert_relative_eq!(
                column.rows(6, 3).into_owned(),
                difference.rows(6, 3).into_owned(),
                epsilon = floor
            );
        }
    }
}

#[test]
fn transition_of_error_terms_is_the_derivative_of_navigation() {
    // As large as precise instruments have them.
    let some = TermVector::from_fn(|k, _| {
        0.1 * Term::of(k).map_or(0.0, Term::usual_sigma) * (k as f64).cos()
    });
    let with = |values: TermVector| {
        Navigator::new(&record(), &site(), &triads(), start())
            .unwrap()
            .with_terms((0..TERM_PARAMETERS).collect(), some + values)
            .advance(0..SAMPLES)
    };
    let nominal = with(TermVector::zeros());
    assert_eq!(nominal.terms.len(), TERM_PARAMETERS);
    for term in &nominal.terms {
        let mut step = TermVector::zeros();
        step[term.parameter] = 1e-6;
        // δq is true − estimated, so the computed parameter goes the other way.
        let shifted = |sign: f64| error(&with(-step * sign).state, &nominal.state);
        let difference = (shifted(1.0) - shifted(-1.0)) / 2e-6;
        let scale = difference.norm().max(1e-3);
        assert_relative_eq!(
            term.column.rows(0, 6).into_owned(),
            difference.rows(0, 6).into_owned(),
            epsilon = 1e-3 * scale
        );
        assert_relative_eq!(
            term.column.rows(6, 3).into_owned(),
            difference.rows(6, 3).into_owned(),
            epsilon = 0.05 * scale
        );
    }
}

#[test]
fn an_ideal_instrument_at_rest_stays_at_rest() {
    let site = site();
    let attitude = exp(Vector3::new(0.4, -0.3, 1.0));
    let samples = 6000;
    let record = ImuSamples {
        gyro: vec![attitude.tr_mul(&site.earth_rate_n()) * PERIOD; samples].into(),
        accel: vec![attitude.tr_mul(&-site.gravity_n()) * PERIOD; samples].into(),
        ..record()
    };
    let ideal = PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General));
    let mut navigator = Navigator::new(&record, &site, &ideal, State::at_rest(attitude)).unwrap();
    let end = navigator.advance(0..samples).state;
    assert_relative_eq!(end.attitude, attitude, epsilon = 1e-12);
    assert!(end.velocity.norm() < 1e-9 && end.position.norm() < 1e-7);
}

#[test]
fn the_error_model_of_a_standing_body_is_that_of_its_noise_free_samples() {
    let site = site();
    let attitude = start().attitude;
    let record = ImuSamples {
        gyro: vec![attitude.tr_mul(&site.earth_rate_n()) * PERIOD; SAMPLES].into(),
        accel: vec![attitude.tr_mul(&-site.gravity_n()) * PERIOD; SAMPLES].into(),
        ..record()
    };
    let ideal = PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General));
    let at_rest = State::at_rest(attitude);
    let navigator = Navigator::new(&record, &site, &ideal, at_rest).unwrap();
    let moving = navigator.clone().advance(0..SAMPLES);
    let standing = navigator.standing(&attitude, 0..SAMPLES);
    assert_relative_eq!(*moving.navigation, *standing.navigation, epsilon = 1e-6);
    for sensor in crate::imu::Sensor::ALL {
        let of = |block: &Block| *block.parameters.get(sensor);
        assert_relative_eq!(of(&moving), of(&standing), epsilon = 1e-6);
    }
}

#[test]
fn noise_of_a_long_block_equals_that_of_its_parts() {
    // At rest the mean force is exact, so except for the Earth's turn noise must compose: Q(0,2) = Φ Q(0,1) Φᵀ + Q(1,2).
    let site = site();
    let record = ImuSamples {
        gyro: vec![Vector3::zeros(); SAMPLES].into(),
        accel: vec![-site.gravity_n() * PERIOD; SAMPLES].into(),
        ..record()
    };
    let ideal = PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General));
    let of = |random_walk| ProcessNoise {
        random_walk,
        ..ProcessNoise::default()
    };
    let noise = PerSensor {
        gyro: of(0.1),
        accel: of(1.0),
    };
    let start = State::at_rest(Matrix3::identity());
    let mut navigator = Navigator::new(&record, &site, &ideal, start).unwrap();
    let whole = navigator.clone().advance(0..SAMPLES);
    let first = navigator.advance(0..SAMPLES / 2);
    let second = navigator.advance(SAMPLES / 2..SAMPLES);
    let of = |block: &Block| block.noise.covariance(&noise);
    let composed = *second.navigation * of(&first) * second.navigation.transpose() + of(&second);
    assert_relative_eq!(of(&whole), composed, epsilon = 1e-7);
}

#[test]
fn an_interpolated_axis_adds_its_error_along_that_axis() {
    let site = site();
    let attitude = start().attitude;
    let bridge = |sensor, axis, samples| {
        let variance = if sensor == Sensor::Gyro { 4e-8 } else { 9e-6 };
        Bridge::new(samples).with(sensor, axis, variance)
    };
    let record = ImuSamples {
        gyro: vec![Vector3::zeros(); SAMPLES].into(),
        accel: vec![attitude.tr_mul(&-site.gravity_n()) * PERIOD; SAMPLES].into(),
        bridges: vec![
            bridge(Sensor::Gyro, 1, 0..2),
            bridge(Sensor::Gyro, 1, 3..7),
            bridge(Sensor::Accel, 2, 4..5),
        ],
        ..record()
    };
    let ideal = PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General));
    let at_rest = State::at_rest(attitude);
    let of = |samples| {
        let navigator = Navigator::new(&record, &site, &ideal, at_rest);
        let block = navigator.unwrap().standing(&attitude, samples);
        block.noise.covariance(&PerSensor::default())
    };
    let along = |axis: usize, variance: f64| {
        let axis = attitude.column(axis);
        axis * axis.transpose() * variance
    };
    for (samples, gyro, accel) in [
        (0..SAMPLES, 8e-8, 9e-6),
        (2..3, 0.0, 0.0),
        (1..5, 4e-8, 9e-6),
        (5..SAMPLES, 2e-8, 0.0),
    ] {
        let noise = of(samples);
        let of_attitude = noise.fixed_view::<3, 3>(0, 0).into_owned();
        assert_relative_eq!(of_attitude, along(1, gyro), epsilon = 1e-12);
        let of_velocity = noise.fixed_view::<3, 3>(3, 3).into_owned();
        // Gravity turns tilt into velocity: (9.8 m/s² · 0.1 s)²/3 of it at most.
        assert_relative_eq!(of_velocity, along(2, accel), epsilon = 0.33 * gyro + 1e-12);
    }
}

/// A body held by hand shakes about all axes out of step, and is shaken; its gyros have biases.
#[test]
fn sums_over_samples_at_rest_lead_where_the_samples_lead_but_for_higher_order() {
    let attitude = start().attitude;
    let wave = |k: usize, phase: f64| (0.7 * k as f64 + phase).sin();
    let vector = |k: usize, p: f64| Vector3::new(wave(k, p), wave(k, p + 1.5), wave(k, p + 0.4));
    let still = attitude.tr_mul(&-site().gravity_n()) * PERIOD;
    let apart = |samples: Range<usize>, scale: f64| {
        let mut triads = triads();
        triads.gyro.bias *= scale;
        let record = ImuSamples {
            gyro: (0..24).map(|k| vector(k, 0.0) * (2e-4 * scale)).collect(),
            accel: (0..24).map(|k| still + vector(k, 2.1) * 3e-3).collect(),
            ..record()
        };
        let navigator = Navigator::new(&record, &site(), &triads, State::at_rest(attitude));
        let (mut one, mut other) = (navigator.clone().unwrap(), navigator.unwrap());
        one.advance(samples.clone());
        other.stand(&crate::navigation::Sums::new(&record, samples));
        let error = error(&other.state, &one.state);
        [0, 3].map(|first| error.fixed_rows::<3>(first).norm())
    };
    for samples in [1..24, 5..15] {
        let [whole, half] = [1.0, 0.5].map(|scale| apart(samples.clone(), scale));
        // What second order moves: 3e-7 rad, and gravity on it 1e-4 m/s.
        assert!(whole[0] < 1e-8 && whole[1] < 1e-5, "{whole:?}");
        let orders = [0, 1].map(|k| (whole[k] / half[k]).log2());
        assert!(orders[0] > 2.5 && orders[1] > 1.5, "{orders:?}");
    }
}
