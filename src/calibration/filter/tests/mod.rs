mod against_batch;
mod batch;
mod textbook;

use std::sync::Arc;

use nalgebra::{DVector, Matrix3, SVector, Vector3};

use super::*;
use crate::calibration::constants::{Known, Prior};
use crate::calibration::filter::columns::Linear;
use crate::calibration::linearisation::Linearisation;
use crate::calibration::problem::Stretch;
use crate::calibration::record::{Rest, part_of};
use crate::calibration::{AttitudePrior, ErrorTerm, Options, Problem};
use crate::imu::{GaussMarkov, TermVector};
use crate::navigation::{Block, ErrorMatrix, Navigator, NoiseInput, NoiseInputs, ParameterBlock};
use crate::run::{Aiding, Run};
use crate::simulation::Scenario;
use approx::assert_relative_eq;
use textbook::Textbook;

const CORRELATION_TIME: f64 = 3.0;

fn run(number: u64) -> Run {
    let scenario = Scenario::load("demo").unwrap();
    scenario.simulate(number, 0).unwrap().run
}

/// A model of the demo's run that knows all parameters to this, with biases that vary by so much.
fn model(run: &Run, sigma: f64, varying: Option<f64>) -> Model {
    let mut model = Model::new(run, &Options::default());
    model.prior_sigma.fill(sigma);
    model.position_sigma = 5e-6;
    for noise in [&mut model.noise.gyro, &mut model.noise.accel] {
        noise.gauss_markov = varying.map(|sigma| GaussMarkov {
            sigma,
            correlation_time: CORRELATION_TIME,
        });
    }
    model
}

const START: Start = Start {
    attitude: Vector3::new(1e-5, 2e-5, 3e-5),
    attitude_sigma: Vector3::new(3e-4, 3e-4, 3e-4),
    velocity_sigma: 1e-3,
    position_sigma: 1.0,
    earth_rate: Vector3::new(0.0, 0.0, 0.0),
    earth_rate_sigma: Vector3::new(0.0, 0.0, 0.0),
};

const ANEW: Since = Since::Anew(
    &Difference {
        parameters: SVector::from_array_storage(nalgebra::ArrayStorage([[0.0; 24]])),
        mounting: Vector3::new(0.0, 0.0, 0.0),
    },
    None,
);

/// A filter at its begin, and what is known of the constants.
fn begun(model: &Model) -> (Filter, Known) {
    let mut filter = Filter::new(model, true);
    filter.begin(&START, ANEW, None);
    let triads = crate::calibration::from_vector(model.form, &model.prior_mean.add_scalar(-1e-4));
    let at = Linearisation::new(triads, TermVector::zeros(), Vec::new());
    let prior = Prior::new(&filter.layout.constants, model, &at);
    (filter, Known::new(prior))
}

/// Three components `z = H x + v`, v white of the same variance R each.
struct Measurement {
    residual: Vector3<f64>,
    /// H, row by row: state and coefficient of what is not zero.
    rows: [Vec<(usize, f64)>; 3],
    variance: f64,
}

/// One component of a measurement minus what a filter expected of it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ScalarInnovation {
    innovation: f64,
    variance: f64,
}

fn scalars(judge: &Judge) -> Vec<ScalarInnovation> {
    let each = judge.innovations.iter();
    each.flat_map(|of| {
        [0, 1, 2].map(|k| ScalarInnovation {
            innovation: of.whitened[k] * of.sigma[k],
            variance: of.sigma[k].powi(2),
        })
    })
    .collect()
}

fn take(filter: &mut Filter, measurement: &Measurement) {
    let mut h: Linear = filter.none(3);
    for (row, of_row) in measurement.rows.iter().enumerate() {
        for &(state, weight) in of_row {
            h.states[(row, state)] = weight;
        }
    }
    let z = DVector::from_column_slice(measurement.residual.as_slice());
    let across = &h.states * &filter.p;
    filter.take((&h, across), &z, measurement.variance);
}

/// A filter that learns of a measurement.
fn update(filter: &mut Filter, known: &mut Known, measurement: &Measurement) {
    take(filter, measurement);
    known.learn(&filter.columns.take_rows());
}

fn of_velocity(z: Vector3<f64>, variance: f64) -> Measurement {
    Measurement {
        residual: z,
        rows: [0, 1, 2].map(|axis| vec![(VELOCITY + axis, 1.0)]),
        variance,
    }
}

fn of_table(filter: &Filter, z: Vector3<f64>, variance: f64) -> Measurement {
    let table = filter.layout.table_position.unwrap();
    Measurement {
        residual: z,
        rows: [0, 1, 2].map(|axis| vec![(ATTITUDE + axis, 1.0), (table + axis, -1.0)]),
        variance,
    }
}

/// Noise with nothing special about it.
fn noise_input(scale: f64, wave: &dyn Fn(usize, usize) -> f64) -> NoiseInputs {
    let positive = |first: usize| {
        let root = Matrix3::from_fn(|r, c| wave(first + r, c));
        root * root.transpose() * scale
    };
    let bridged = PerSensor {
        gyro: positive(0),
        accel: positive(3),
    };
    NoiseInputs {
        earth_rate: Vector3::zeros(),
        parts: vec![NoiseInput {
            duration: 0.1,
            force: Vector3::new(0.01, -0.02, 0.98),
            bridged: Some(Box::new(bridged)),
            ..NoiseInput::default()
        }],
    }
}

/// A block with nothing special about it.
fn block(seed: f64) -> Block {
    let wave = |row: usize, column: usize| {
        ((seed + 1.0) * (1.0 + 1.7 * row as f64 + 0.9 * (column * column) as f64)).sin()
    };
    Block {
        state: State::at_rest(Matrix3::identity()),
        duration: 0.1,
        navigation: Arc::new(
            ErrorMatrix::identity() + ErrorMatrix::from_fn(|r, c| 0.1 * wave(r, c)),
        ),
        parameters: Arc::new(PerSensor {
            gyro: ParameterBlock::from_fn(wave),
            accel: ParameterBlock::from_fn(|r, c| wave(c, r)),
        }),
        gravity: SVector::from_fn(|row, _| wave(row, 1)),
        thermal: None,
        terms: Vec::new(),
        noise: noise_input(1e-8, &wave),
    }
}

#[test]
fn it_is_a_filter_that_has_the_constants_among_its_states() {
    for varying in [None, Some(2e-4)] {
        let model = model(&run(1), 1e-4, varying);
        let (mut filter, mut known) = begun(&model);
        let mut textbook = Textbook::new(&filter, &known);
        for k in 0..5 {
            let block = block(f64::from(k));
            filter.propagate(&block);
            textbook.propagate(&filter, &block);
            let z = Vector3::new(1e-5, 0.0, 2e-5);
            for measurement in [of_velocity(z, 1e-9), of_table(&filter, z, 1e-9)] {
                update(&mut filter, &mut known, &measurement);
                textbook.update(&measurement);
            }
            textbook.is_near(&filter, &known, 1e-6);
        }
    }
}

#[test]
fn a_varying_bias_goes_on_while_nothing_is_known() {
    let sigma = 2e-4f64;
    let (mut filter, _) = begun(&model(&run(1), 1e-4, Some(sigma)));
    for k in 0..5 {
        filter.propagate(&block(f64::from(k)));
        take(
            &mut filter,
            &of_velocity(Vector3::new(1e-5, 0.0, 2e-5), 1e-11),
        );
    }
    let (state, ..) = filter.layout.varying_biases[0];
    let before = filter.p[(state, state)];
    let by_constant = filter.columns.of_states[(0, state)];
    // Without observations of it a stationary process stays as uncertain as it was.
    assert!(before <= sigma.powi(2));
    filter.begin(&START, Since::Lost(2.0 * CORRELATION_TIME), None);
    let keep = (-2.0f64).exp();
    let expected = before * keep.powi(2) + sigma.powi(2) * (1.0 - keep.powi(2));
    assert_relative_eq!(filter.p[(state, state)], expected, max_relative = 1e-12);
    assert_relative_eq!(
        filter.columns.of_states[(0, state)],
        by_constant * keep,
        max_relative = 1e-12
    );
}

/// A tenth of a second of turning: attitude drives velocity, velocity position, and the
/// parameters of both triads come in from every side.
fn turning(seed: f64) -> Block {
    let mut block = block(seed);
    let wave = block.navigation;
    block.navigation = Arc::new(ErrorMatrix::identity());
    for (row, column) in [(3, 0), (6, 3)] {
        Arc::make_mut(&mut block.navigation)
            .fixed_view_mut::<3, 3>(row, column)
            .copy_from(&wave.fixed_view::<3, 3>(row, column));
    }
    block.noise = noise_input(1e-16, &|row, column| (seed + (row + column) as f64).sin());
    block
}

#[test]
fn covariance_stays_positive_from_seven_thousand_ppm_to_a_tenth() {
    let (mut filter, mut known) = begun(&model(&run(1), 7e-3, None));
    for k in 0..4000 {
        filter.propagate(&turning(f64::from(k) * 0.37));
        for measurement in [
            of_velocity(Vector3::zeros(), 1e-12),
            of_table(&filter, Vector3::zeros(), 1e-12),
        ] {
            update(&mut filter, &mut known, &measurement);
        }
        if k % 50 == 0 {
            filter.redraw_table();
        }
    }
    let covariance = known.posterior().parameter_covariance;
    let sigma = covariance.diagonal().map(f64::sqrt);
    assert!(sigma.amax() < 1e-7 && sigma.amin() > 0.0, "{sigma}");
    for covariance in [
        DMatrix::from_fn(24, 24, |i, j| covariance[(i, j)]),
        filter.p,
    ] {
        let scale = covariance.map_diagonal(|v| 1.0 / v.sqrt());
        let n = scale.len();
        let correlation = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] * scale[i] * scale[j]);
        assert!((&correlation - correlation.transpose()).amax() < 1e-9);
        let smallest = correlation.symmetric_eigenvalues().min();
        assert!(smallest > 0.0, "smallest eigenvalue {smallest}");
    }
}

/// The first part of the first dwell in an attitude.
fn first_part((problem, stretch): (&Problem, &Stretch), attitude: &Matrix3<f64>) -> (Rest, Block) {
    let model = &problem.model;
    let triads = crate::calibration::from_vector(model.form, &model.prior_mean);
    let at = State::at_rest(*attitude);
    let run = problem.run();
    let navigator = Navigator::new(&run.recording.imu, &run.site, &triads, at);
    let mut navigator = navigator.unwrap();
    let part = &stretch.steps[..part_of(&stretch.steps, usize::MAX / 2)];
    let before = navigator.standing(attitude, part[0].samples.clone());
    let rest = Rest::navigate(&mut navigator, (problem, stretch), part, attitude);
    (rest, before)
}

#[test]
fn what_dwells_before_have_worked_out_changes_nothing() {
    let run = run(3);
    let problem = Problem::new(&run, &Options::default());
    let (model, stretch) = (&problem.model, &problem.stretches()[0]);
    let of = (&problem, stretch);
    let (filter, known) = begun(model);
    let mut shared = dwell_filters(&filter);
    let attitudes = [Vector3::zeros(), Vector3::new(0.3, -1.0, 2.0)].map(crate::attitude::exp);
    for (attitude, number) in attitudes
        .iter()
        .zip([None, Some(7)])
        .chain([(&attitudes[0], Some(40)), (&attitudes[1], None)])
    {
        let (segment, _) = first_part(of, attitude);
        let through = |dwells: &mut dyn DwellFilters| {
            let mut filter = filter.clone();
            // All but one are let in.
            let accepted: Vec<bool> = (0..300).map(|k| Some(k) != number).collect();
            let mut judge = Judge::new(Gate::As(&accepted), f64::INFINITY);
            let taken = dwells.take_in(&mut filter, (&segment, stretch), Some(&known), &mut judge);
            assert_eq!(taken, Taken::Whole);
            (filter.x, filter.p, scalars(&judge))
        };
        assert_eq!(through(&mut *shared), through(&mut *dwell_filters(&filter)));
    }
}

#[test]
fn a_part_of_a_dwell_at_once_is_its_steps_one_after_the_other() {
    let table = Options::default();
    let velocity = table.clone().aiding(Aiding::Velocity);
    for options in [
        table.clone(),
        table.clone().with(ErrorTerm::TableBase),
        table.with(ErrorTerm::GaussMarkovBias),
        velocity.clone(),
        velocity.with(ErrorTerm::GaussMarkovBias),
    ] {
        let run = run(3);
        let problem = Problem::new(&run, &options);
        let (model, stretch) = (&problem.model, &problem.stretches()[0]);
        // Wide enough to be told by the observations; wider ones cost digits step by step.
        let prior = AttitudePrior {
            mean: Matrix3::identity(),
            sigma: Vector3::new(4e-3, 4e-3, 0.3),
            earth_rate_sigma: Vector3::zeros(),
        };
        let (mut filter, mut known) = begun(model);
        let start = stretch.start(&prior, &Matrix3::identity());
        filter.begin(&start, ANEW, None);
        let (segment, before) = first_part((&problem, stretch), &Matrix3::identity());
        let mut textbook = Textbook::new(&filter, &known);
        // What has gone on before leaves nothing independent of anything.
        for _ in 0..200 {
            filter.propagate(&before);
            textbook.propagate(&filter, &before);
        }
        filter.begin_to_hold();
        textbook.begin_to_hold(&filter);
        let mut judge = Judge::new(Gate::Open, f64::INFINITY);
        let of = (model, stretch);
        let mut dwells = dwell_filters(&filter);
        let taken = dwells.take_in(&mut filter, (&segment, stretch), Some(&known), &mut judge);
        assert_eq!(taken, Taken::Whole);
        known.learn(&filter.columns.take_rows());
        let (ours, theirs) = (scalars(&judge), textbook.through(&filter, &segment, of));
        assert_eq!(ours.len(), theirs.len());
        for (one, other) in ours.iter().zip(&theirs) {
            let sigma = other.variance.sqrt();
            assert_relative_eq!(one.variance, other.variance, max_relative = 1e-5);
            assert_relative_eq!(
                one.innovation / sigma,
                other.innovation / sigma,
                epsilon = 1e-5,
                max_relative = 1e-5
            );
        }
        textbook.is_near(&filter, &known, 1e-5);
    }
}
