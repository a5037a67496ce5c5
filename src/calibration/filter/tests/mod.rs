mod against_batch;
mod batch;

use std::sync::Arc;

use nalgebra::{Matrix3, SMatrix, SVector};

use super::*;
use crate::calibration::checks::innovation::Observation;
use crate::calibration::filter::linear::Linear;
use crate::calibration::filter::measurement::{Measurement, ScalarInnovation};
use crate::calibration::parameters::PARAMETERS;
use crate::calibration::problem::Stretch;
use crate::calibration::record::segment::{Seen, Segment, segments};
use crate::calibration::{AttitudePrior, ErrorTerm, Options, Problem, parameter};
use crate::imu::{PARAMETERS as PER_TRIAD, Sensor};
use crate::navigation::{Block, ErrorMatrix, Navigator, NoiseInput, NoiseInputs, ParameterBlock};
use crate::run::Aiding;
use crate::simulation::Scenario;
use approx::assert_relative_eq;

const STATES: usize = NAVIGATION + PARAMETERS + 6;

type StateMatrix = SMatrix<f64, STATES, STATES>;

/// Of the parameters alone.
fn errors(parameters: ParameterVector) -> PriorErrors {
    PriorErrors {
        parameters,
        ..PriorErrors::none()
    }
}

fn filter() -> Filter {
    let run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
    let mut model = Model::new(&run, &Options::default());
    model.prior_sigma.fill(7e-3);
    let parameters = ParameterVector::from_element(1e-4);
    let mut filter = Filter::new(&model, &errors(parameters));
    let start = Start {
        attitude: Vector3::new(1e-5, 2e-5, 3e-5),
        attitude_sigma: Vector3::repeat(3e-4),
        velocity_sigma: 1e-3,
        position_sigma: 1.0,
    };
    filter.begin(
        &start,
        5e-6,
        Since::Anew(&Difference::default(), None),
        None,
    );
    assert_eq!(filter.layout.size(), STATES);
    filter
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

/// Φ as a whole, whatever states are on.
fn dense_transition(filter: &Filter, block: &Block) -> DMatrix<f64> {
    let n = filter.x.len();
    let mut phi = DMatrix::identity(n, n);
    phi.view_mut((0, 0), (NAVIGATION, NAVIGATION))
        .copy_from(&block.navigation);
    for sensor in Sensor::ALL {
        phi.view_mut(
            (0, NAVIGATION + parameter(sensor, 0)),
            (NAVIGATION, PER_TRIAD),
        )
        .copy_from(block.parameters.get(sensor));
    }
    for (state, sensor, constant) in filter.layout.varying_biases() {
        let column = NAVIGATION + parameter(sensor, constant);
        let of_bias = phi.view((0, column), (NAVIGATION, 1)).into_owned();
        phi.view_mut((0, state), (NAVIGATION, 1))
            .copy_from(&of_bias);
        phi[(state, state)] = (-block.duration / CORRELATION_TIME).exp();
    }
    phi
}

const CORRELATION_TIME: f64 = 3.0;

fn measurement(first: usize, minus: Option<usize>, z: Vector3<f64>, variance: f64) -> Measurement {
    let row = |axis: usize| {
        let minus = minus.map(|minus| (minus + axis, -1.0));
        std::iter::once((first + axis, 1.0)).chain(minus).collect()
    };
    Measurement {
        residual: z,
        rows: [0, 1, 2].map(row),
        variance,
    }
}

fn of_velocity(z: Vector3<f64>, variance: f64) -> Measurement {
    measurement(VELOCITY, None, z, variance)
}

fn of_table(filter: &Filter, z: Vector3<f64>, variance: f64) -> Measurement {
    measurement(ATTITUDE, filter.layout.table_position(), z, variance)
}

#[test]
fn block_propagation_equals_the_dense_product() {
    let mut filter = filter();
    for k in 0..5 {
        let block = block(f64::from(k));
        let phi = dense_transition(&filter, &block);
        let mut p = &phi * &filter.p * phi.transpose();
        let mut corner = p.view_mut((0, 0), (NAVIGATION, NAVIGATION));
        corner += block.noise.covariance(&filter.noise);
        let x = phi * &filter.x;
        filter.propagate(&block);
        assert_relative_eq!(filter.p, p, max_relative = 1e-12, epsilon = 1e-13);
        assert_relative_eq!(filter.x, x, max_relative = 1e-12);
        let measurement = of_table(&filter, Vector3::new(1e-5, 0.0, 2e-5), 1e-11);
        filter.update(&measurement);
    }
}

#[test]
fn a_varying_bias_does_what_the_constant_one_does_and_forgets() {
    let run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
    // Not small beside the other variances, or their tolerance would hide it.
    let sigma = 2e-4f64;
    let mut model = Model::new(&run, &Options::default());
    model.prior_sigma.fill(1e-4);
    for noise in [&mut model.noise.gyro, &mut model.noise.accel] {
        noise.gauss_markov = Some(crate::imu::GaussMarkov {
            sigma,
            correlation_time: CORRELATION_TIME,
        });
    }
    let mean = ParameterVector::from_element(1e-4);
    let mut filter = Filter::new(&model, &errors(mean));
    let start = Start {
        attitude: Vector3::zeros(),
        attitude_sigma: Vector3::repeat(3e-4),
        velocity_sigma: 1e-3,
        position_sigma: 1.0,
    };
    filter.begin(
        &start,
        5e-6,
        Since::Anew(&Difference::default(), None),
        None,
    );
    let varying: Vec<usize> = filter.layout.varying_biases().map(|(s, ..)| s).collect();
    assert_eq!(varying.len(), 6);
    for k in 0..5 {
        let block = block(f64::from(k));
        let phi = dense_transition(&filter, &block);
        let mut p = &phi * &filter.p * phi.transpose();
        let mut corner = p.view_mut((0, 0), (NAVIGATION, NAVIGATION));
        corner += block.noise.covariance(&filter.noise);
        for &state in &varying {
            p[(state, state)] += sigma.powi(2) * (1.0 - phi[(state, state)].powi(2));
        }
        let x = phi * &filter.x;
        filter.propagate(&block);
        assert_relative_eq!(filter.p, p, max_relative = 1e-12, epsilon = 1e-13);
        assert_relative_eq!(filter.x, x, max_relative = 1e-12);
        filter.update(&of_velocity(Vector3::new(1e-5, 0.0, 2e-5), 1e-11));
    }
    // Without observations of it a stationary process stays as uncertain as it was.
    assert!(filter.p[(varying[0], varying[0])] <= sigma.powi(2));

    // While nothing is known it goes on.
    let state = varying[0];
    let (constant, _) = filter.layout.parameters().next().unwrap();
    let (before, across) = (filter.p[(state, state)], filter.p[(state, constant)]);
    filter.begin(&start, 5e-6, Since::Lost(2.0 * CORRELATION_TIME), None);
    let keep = (-2.0f64).exp();
    let expected = before * keep.powi(2) + sigma.powi(2) * (1.0 - keep.powi(2));
    assert_relative_eq!(filter.p[(state, state)], expected, max_relative = 1e-12);
    assert_relative_eq!(filter.p[(state, constant)], across * keep);
}

#[test]
fn scalar_updates_equal_the_dense_one_with_the_full_gain() {
    let mut filter = filter();
    filter.propagate(&block(0.3));
    let z = Vector3::new(1e-3, -2e-3, 5e-4);
    let table = of_table(&filter, z, 1e-9);
    for measurement in [of_velocity(z, 1e-9), table] {
        let mut h = SMatrix::<f64, 3, STATES>::zeros();
        for (axis, row) in measurement.rows.iter().enumerate() {
            row.iter()
                .for_each(|&(state, weight)| h[(axis, state)] = weight);
        }
        let before = StateMatrix::from_iterator(filter.p.iter().copied());
        let s = h * before * h.transpose() + Matrix3::identity() * measurement.variance;
        let gain = before * h.transpose() * s.try_inverse().unwrap();
        let mean = SVector::<f64, STATES>::from_iterator(filter.x.iter().copied());
        let innovation = z - h * mean;
        let x = mean + gain * innovation;
        let p = (StateMatrix::identity() - gain * h) * before;
        filter.update(&measurement);
        let after = StateMatrix::from_iterator(filter.p.iter().copied());
        let mean = SVector::<f64, STATES>::from_iterator(filter.x.iter().copied());
        assert_relative_eq!(mean, x, max_relative = 1e-6, epsilon = 1e-12);
        assert_relative_eq!(after, p, max_relative = 1e-6, epsilon = 1e-13);
    }
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
    let mut filter = filter();
    for k in 0..4000 {
        filter.propagate(&turning(f64::from(k) * 0.37));
        filter.update(&of_velocity(Vector3::zeros(), 1e-12));
        let table = of_table(&filter, Vector3::zeros(), 1e-12);
        filter.update(&table);
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

/// Lets all in and keeps the innovations.
struct Open<'a> {
    stretch: &'a Stretch<'a>,
    model: &'a Model,
    scalars: Vec<ScalarInnovation>,
}

impl ObservationJudge for Open<'_> {
    fn variance(&self, seen: &Seen) -> f64 {
        self.stretch
            .observation_variance(self.model, seen.kind, seen.readings)
    }

    fn judge(&mut self, innovations: Innovations) -> Verdict {
        self.scalars.extend(innovations.scalars);
        Verdict::Accepted
    }
}

impl Filter {
    /// A part of a dwell as a textbook has it: step by step, all states in every scalar.
    fn step_by_step(&mut self, segment: &Segment, open: &Open) -> Vec<ScalarInnovation> {
        let mut scalars = Vec::new();
        for step in &segment.steps {
            let turn = self.layout.turn_at_rest();
            let firsts = [ATTITUDE, VELOCITY, POSITION].into_iter();
            let referred = firsts.zip(step.referred);
            for (first, by) in referred.chain(turn.map(|turn| (turn, step.referred[0]))) {
                let mut error = self.x.fixed_rows_mut::<3>(first);
                error += by;
            }
            self.propagate(&segment.models[step.model]);
            for seen in &segment.seen[step.seen.clone()] {
                for axis in 0..3 {
                    let mut row = vec![match seen.kind {
                        Observation::Velocity => (VELOCITY + axis, 1.0),
                        Observation::Table => (ATTITUDE + axis, 1.0),
                        Observation::Attitude => (turn.unwrap() + axis, 1.0),
                    }];
                    if seen.kind == Observation::Table {
                        let position = self.layout.table_position().into_iter();
                        row.extend(position.map(|first| (first + axis, -1.0)));
                        let base = self.layout.table_base();
                        let base = base.filter(|&(_, about)| about == axis);
                        row.extend(base.map(|(state, _)| (state, -1.0)));
                    }
                    let mut h = DVector::zeros(self.x.len());
                    row.iter().for_each(|&(state, weight)| h[state] = weight);
                    let ph = &self.p * &h;
                    let z = seen.residual[axis];
                    scalars.push(ScalarInnovation {
                        innovation: z - h.dot(&self.x),
                        variance: h.dot(&ph) + open.variance(seen),
                    });
                    let row = Linear {
                        states: DMatrix::from_row_slice(1, h.len(), h.as_slice()),
                        columns: DMatrix::zeros(1, 0),
                    };
                    let value = DVector::from_element(1, z);
                    let across = &row.states * &self.p;
                    self.take((&row, across), &value, open.variance(seen));
                }
            }
        }
        scalars
    }
}

/// Leaves out one observation.
struct Without<'a> {
    open: Open<'a>,
    number: usize,
}

impl ObservationJudge for Without<'_> {
    fn variance(&self, seen: &Seen) -> f64 {
        self.open.variance(seen)
    }

    fn judge(&mut self, innovations: Innovations) -> Verdict {
        self.open.judge(innovations);
        match self.open.scalars.len() == 3 * (self.number + 1) {
            true => Verdict::Rejected,
            false => Verdict::Accepted,
        }
    }
}

#[test]
fn what_dwells_before_have_worked_out_changes_nothing() {
    let run = Scenario::load("demo").unwrap().simulate(3, 0).unwrap().run;
    let problem = Problem::new(&run, &Options::default());
    let (model, stretch) = (&problem.model, &problem.stretches()[0]);
    let triads = crate::calibration::from_vector(model.form, &model.prior_mean);
    let mut shared = DwellFilters::of(&filter());
    let attitudes = [Vector3::zeros(), Vector3::new(0.3, -1.0, 2.0)].map(crate::attitude::exp);
    for (attitude, left_out) in attitudes
        .iter()
        .zip([None, Some(7)])
        .chain([(&attitudes[0], Some(40)), (&attitudes[1], None)])
    {
        let at = State::at_rest(*attitude);
        let navigator = Navigator::new(&run.recording.imu, &run.site, &triads, at);
        let part = segments(&stretch.steps, true).next().unwrap();
        let of = (&problem, stretch);
        let segment = Segment::navigate(&mut navigator.unwrap(), of, &part, true, attitude);
        let through = |dwells: &mut DwellFilters| {
            let mut filter = filter();
            let open = Open {
                stretch,
                model,
                scalars: Vec::new(),
            };
            let number = left_out.unwrap_or(usize::MAX / 6);
            let mut observer = Without { open, number };
            let taken = dwells.take_in(&mut filter, &segment, &mut observer);
            assert_eq!(taken, Taken::Whole);
            (filter.x, filter.p, observer.open.scalars)
        };
        assert_eq!(
            through(&mut shared),
            through(&mut DwellFilters::of(&filter()))
        );
    }
}

#[test]
fn a_part_of_a_dwell_at_once_is_its_steps_one_after_the_other() {
    let table = Options::default();
    let cases = [
        ("demo", table.clone()),
        ("demo", table.clone().with(ErrorTerm::TableBase)),
        ("demo", table.clone().with(ErrorTerm::GaussMarkovBias)),
        ("demo", table.clone().aiding(Aiding::Velocity)),
        (
            "demo",
            table
                .aiding(Aiding::Velocity)
                .with(ErrorTerm::GaussMarkovBias),
        ),
    ];
    for (scenario, options) in cases {
        let run = Scenario::load(scenario)
            .unwrap()
            .simulate(3, 0)
            .unwrap()
            .run;
        let problem = Problem::new(&run, &options);
        let (model, stretch) = (&problem.model, &problem.stretches()[0]);
        let triads = crate::calibration::from_vector(model.form, &model.prior_mean);
        // Wide enough to be told by the observations; wider ones cost digits step by step.
        let prior = AttitudePrior {
            mean: Matrix3::identity(),
            sigma: Vector3::new(4e-3, 4e-3, 0.3),
        };
        let mut filter = Filter::new(model, &PriorErrors::none());
        let start = stretch.start(&prior, &Matrix3::identity());
        filter.begin(
            &start,
            model.position_sigma,
            Since::Anew(&Difference::default(), None),
            None,
        );
        let at = State::at_rest(Matrix3::identity());
        let navigator = Navigator::new(&run.recording.imu, &run.site, &triads, at);
        let mut navigator = navigator.unwrap();
        let part = segments(&stretch.steps, true).next().unwrap();
        // What has gone on before leaves nothing independent of anything.
        let before = navigator.standing(&at.attitude, part[0].0.samples.clone());
        for _ in 0..200 {
            filter.propagate(&before);
        }
        filter.begin_to_hold();
        let of = (&problem, stretch);
        let segment = Segment::navigate(&mut navigator, of, &part, true, &at.attitude);
        let mut open = Open {
            stretch,
            model,
            scalars: Vec::new(),
        };
        let mut other = filter.clone();
        let mut dwells = DwellFilters::of(&filter);
        let taken = dwells.take_in(&mut filter, &segment, &mut open);
        assert_eq!(taken, Taken::Whole);
        let scalars = other.step_by_step(&segment, &open);
        assert_eq!(scalars.len(), open.scalars.len());
        for (one, other) in open.scalars.iter().zip(&scalars) {
            let sigma = other.variance.sqrt();
            assert_relative_eq!(one.variance, other.variance, max_relative = 1e-5);
            assert_relative_eq!(
                one.innovation / sigma,
                other.innovation / sigma,
                epsilon = 1e-5,
                max_relative = 1e-5
            );
        }
        for i in 0..filter.x.len() {
            let sigma = other.p[(i, i)].sqrt().max(f64::MIN_POSITIVE);
            assert_relative_eq!(filter.p[(i, i)], other.p[(i, i)], max_relative = 1e-5);
            let apart = (filter.x[i] - other.x[i]) / sigma;
            assert!(
                apart.abs() < 1e-5,
                "{scenario}: state {i} is {apart} σ apart"
            );
        }
    }
}
