use super::super::states::{STATES, parameter};
use super::*;
use crate::navigation::{BlockMatrix, ParameterBlock};
use approx::assert_relative_eq;

type StateMatrix = SMatrix<f64, STATES, STATES>;

fn filter() -> Filter<STATES> {
    let start = Start {
        attitude: Vector3::repeat(3e-4),
        velocity: 1e-3,
        position: 1.0,
        table: 5e-6,
    };
    Filter::new(
        start,
        &ParameterVector::from_element(1e-4),
        &ParameterVector::from_element(7e-3),
        Vector3::new(1e-5, 2e-5, 3e-5),
    )
}

/// A block with nothing special about it.
fn block(seed: f64) -> Block {
    let wave = |row: usize, column: usize| {
        ((seed + 1.0) * (1.0 + 1.7 * row as f64 + 0.9 * (column * column) as f64)).sin()
    };
    let noise = BlockMatrix::from_fn(|r, c| 1e-4 * wave(r, c));
    Block {
        state: State::at_rest(Matrix3::identity()),
        duration: 0.1,
        navigation: BlockMatrix::identity() + BlockMatrix::from_fn(|r, c| 0.1 * wave(r, c)),
        parameters: PerSensor {
            gyro: ParameterBlock::from_fn(wave),
            accel: ParameterBlock::from_fn(|r, c| wave(c, r)),
        },
        further: Vec::new(),
        noise: noise * noise.transpose(),
    }
}

fn dense_transition(block: &Block) -> StateMatrix {
    let mut phi = StateMatrix::identity();
    phi.fixed_view_mut::<9, 9>(0, 0)
        .copy_from(&block.navigation);
    for sensor in Sensor::ALL {
        phi.fixed_view_mut::<9, PER_TRIAD>(0, PARAMETER + parameter(sensor, 0))
            .copy_from(block.parameters.get(sensor));
    }
    phi
}

#[test]
fn block_propagation_equals_the_dense_product() {
    let mut filter = filter();
    for k in 0..5 {
        let block = block(f64::from(k));
        let phi = dense_transition(&block);
        let mut p = phi * filter.p * phi.transpose();
        let mut corner = p.fixed_view_mut::<9, 9>(0, 0);
        corner += block.noise;
        let x = phi * filter.x;
        filter.propagate(&block);
        assert_relative_eq!(filter.p, p, max_relative = 1e-12, epsilon = 1e-13);
        assert_relative_eq!(filter.x, x, max_relative = 1e-12);
        filter.observe(Sight::table(None), &Vector3::new(1e-5, 0.0, 2e-5), 1e-11);
    }
}

#[test]
fn a_wandering_bias_does_what_the_constant_one_does_and_forgets() {
    // Not small beside the other variances, or their tolerance would hide it.
    let wandering = Instability {
        sigma: 2e-4,
        correlation_time: 3.0,
    };
    let start = Start {
        attitude: Vector3::repeat(3e-4),
        velocity: 1e-3,
        position: 1.0,
        table: 5e-6,
    };
    let sigma = ParameterVector::from_element(1e-4);
    let mut filter = Filter::<STATES_WITH_DRIFT>::new(start, &sigma, &sigma, Vector3::zeros())
        .with_drift(PerSensor::from_fn(|_| Some(wandering)));
    for k in 0..5 {
        let block = block(f64::from(k));
        let mut phi = SMatrix::<f64, STATES_WITH_DRIFT, STATES_WITH_DRIFT>::identity();
        phi.fixed_view_mut::<STATES, STATES>(0, 0)
            .copy_from(&dense_transition(&block));
        let keep = (-block.duration / 3.0f64).exp();
        for axis in 0..6 {
            let bias = if axis < 3 { GYRO } else { ACCEL } + 9 + axis % 3;
            let column = phi.fixed_view::<NAVIGATION, 1>(0, bias).into_owned();
            phi.fixed_view_mut::<NAVIGATION, 1>(0, DRIFT + axis)
                .copy_from(&column);
            phi[(DRIFT + axis, DRIFT + axis)] = keep;
        }
        let mut p = phi * filter.p * phi.transpose();
        let mut corner = p.fixed_view_mut::<9, 9>(0, 0);
        corner += block.noise;
        for state in DRIFT..DRIFT + 6 {
            p[(state, state)] += wandering.sigma.powi(2) * (1.0 - keep * keep);
        }
        let x = phi * filter.x;
        filter.propagate(&block);
        assert_relative_eq!(filter.p, p, max_relative = 1e-12, epsilon = 1e-13);
        assert_relative_eq!(filter.x, x, max_relative = 1e-12);
        filter.observe(Sight::VELOCITY, &Vector3::new(1e-5, 0.0, 2e-5), 1e-11);
    }
    // Without observations of it a stationary process stays as uncertain as it was.
    assert!(filter.p[(DRIFT, DRIFT)] <= wandering.sigma.powi(2));
}

#[test]
fn scalar_observations_equal_the_dense_update_with_the_full_gain() {
    let mut filter = filter();
    filter.propagate(&block(0.3));
    let variance = 1e-9;
    let z = Vector3::new(1e-3, -2e-3, 5e-4);
    for sight in [Sight::VELOCITY, Sight::table(None)] {
        let mut h = nalgebra::SMatrix::<f64, 3, STATES>::zeros();
        for axis in 0..3 {
            h[(axis, sight.plus + axis)] = 1.0;
            if let Some(minus) = sight.minus {
                h[(axis, minus + axis)] = -1.0;
            }
        }
        let s = h * filter.p * h.transpose() + Matrix3::identity() * variance;
        let gain = filter.p * h.transpose() * s.try_inverse().unwrap();
        let x = filter.x + gain * (z - h * filter.x);
        let p = (StateMatrix::identity() - gain * h) * filter.p;
        let (whitened, log_determinant) = filter.whitened(sight, &z, variance).unwrap();
        assert_relative_eq!(log_determinant, s.determinant().ln(), max_relative = 1e-9);
        let innovation = z - h * filter.x;
        assert_relative_eq!(
            whitened.norm_squared(),
            innovation.dot(&(s.try_inverse().unwrap() * innovation)),
            max_relative = 1e-9
        );
        filter.observe(sight, &z, variance);
        assert_relative_eq!(filter.x, x, max_relative = 1e-6, epsilon = 1e-12);
        assert_relative_eq!(filter.p, p, max_relative = 1e-6, epsilon = 1e-13);
    }
}

/// A tenth of a second of turning: attitude drives velocity, velocity position, and the
/// parameters of both triads come in from every side.
fn turning(seed: f64) -> Block {
    let mut block = block(seed);
    let wave = block.navigation;
    block.navigation = BlockMatrix::identity();
    for (row, column) in [(3, 0), (6, 3)] {
        block
            .navigation
            .fixed_view_mut::<3, 3>(row, column)
            .copy_from(&wave.fixed_view::<3, 3>(row, column));
    }
    block.noise *= 1e-8;
    block
}

#[test]
fn covariance_stays_positive_from_seven_thousand_ppm_to_a_tenth() {
    let mut filter = filter();
    for k in 0..4000 {
        filter.propagate(&turning(f64::from(k) * 0.37));
        filter.observe(Sight::VELOCITY, &Vector3::zeros(), 1e-12);
        filter.observe(Sight::table(None), &Vector3::zeros(), 1e-12);
        if k % 50 == 0 {
            filter.redraw_table(5e-6);
        }
    }
    let sigma = filter.parameter_sigma();
    assert!(sigma.amax() < 1e-7 && sigma.amin() > 0.0, "{sigma}");
    let scale = filter.p.map_diagonal(|v| 1.0 / v.sqrt());
    let correlation = StateMatrix::from_fn(|i, j| filter.p[(i, j)] * scale[i] * scale[j]);
    assert!((correlation - correlation.transpose()).amax() < 1e-9);
    let smallest = correlation.symmetric_eigenvalues().min();
    assert!(smallest > 0.0, "smallest eigenvalue {smallest}");
}
