//! Batch least squares: solves the linear problem of the last pass with held linearisation without a Kalman filter.
//!
//! Every fact is a row of unit variance: what was known before, each observation, each independent
//! source of noise in a stretch. The rows are reduced stretch by stretch with Householder's QR.
//! Unknowns that no later row sees stand first in a reduction and leave with the rows that determine
//! them; nothing is approximated (Bierman, *Factorization Methods for Discrete Sequential
//! Estimation*, ch. VI).
//!
//! It shares with the chain what makes the problem (stretches, blocks of the error model, observed
//! differences) and nothing that solves it: it checks covariance propagation, gains and updates.

use std::ops::Range;

use faer::{Mat, MatRef, Side};
use nalgebra::{Matrix3, Vector3};

use crate::attitude::{log, skew, to_tilt_and_heading};
use crate::calibration::budget::curvature::curvature;
use crate::calibration::chain::states::{ATTITUDE, NAVIGATION, POSITION, VELOCITY};
use crate::calibration::checks::innovation::Observation;
use crate::calibration::error::CalibrationError;
use crate::calibration::estimate::Estimate;
use crate::calibration::linearisation::{Start, singular};
use crate::calibration::model::Model;
use crate::calibration::outcome::Outcome;
use crate::calibration::parameters::{
    ParameterMatrix, ParameterVector, from_vector, sensor_and_parameter, to_vector,
};
use crate::calibration::problem::{Problem, Stretch};
use crate::calibration::record::schedule::AtRest;
use crate::imu::{PerSensor, Triad};
use crate::navigation::{Block, ErrorMatrix, Navigator, ProcessNoise, State};
use crate::run::Aiding;

/// The attitude error at the first sample is the initial one to within this, rad: a number so small
/// that it is none, where a row needs a σ.
const SAME: f64 = 1e-11;
/// A source of noise with less than this part of the largest one's variance is rounding.
const NO_SOURCE: f64 = 1e-14;

/// Estimate and covariance of an outcome's last pass, from its point of linearisation, by batch least squares.
///
/// It knows neither error terms, nor turning at standstill, nor what follows temperature or differs between recordings.
pub fn batch_estimate(problem: &Problem, outcome: &Outcome) -> Result<Estimate, CalibrationError> {
    let model = &problem.model;
    assert!(model.term_sigma.iter().all(|&sigma| sigma == 0.0) && !problem.varies());
    let mut dwells = outcome.linearised_at.dwells.iter();
    let mut known = None;
    let mut information = None;
    for (number, stretch) in problem.stretches().iter().enumerate() {
        let mut batch = Batch::new(problem, (stretch, number), outcome, information)?;
        let mut rested = false;
        for step in &stretch.steps {
            match &step.at_rest {
                Some(at_rest) => {
                    let new_position = at_rest.first && rested;
                    if at_rest.first {
                        known = dwells.next();
                    }
                    batch.rest(step.samples.clone(), (at_rest, known), new_position)?;
                    rested = true;
                }
                None => {
                    let block = batch.navigator.advance(step.samples.clone());
                    batch.advance(&block, step.samples.end)?;
                }
            }
        }
        information = Some(batch.information);
    }
    let at = to_vector(&outcome.linearised_at.triads);
    let information = information.ok_or(CalibrationError::NoDwells)?;
    let (step, covariance) = information.parameters();
    let triads = from_vector(model.form, &(at + step));
    Ok(Estimate {
        covariance: covariance + curvature(&triads, &covariance),
        triads,
    })
}

struct Batch<'a> {
    model: &'a Model,
    stretch: &'a Stretch<'a>,
    /// The accelerometers where the outcome's last pass linearised.
    accel: Triad,
    navigator: Navigator<'a>,
    /// The attitude that the dwell holds without a table.
    held: Matrix3<f64>,
    information: Information,
}

impl<'a> Batch<'a> {
    fn new(
        problem: &'a Problem,
        (stretch, number): (&'a Stretch, usize),
        outcome: &Outcome,
        before: Option<Information>,
    ) -> Result<Self, CalibrationError> {
        let (run, model, at) = (stretch.run, &problem.model, &outcome.linearised_at);
        let diverged = CalibrationError::Diverged { time: 0.0 };
        let attitudes = at
            .initial_attitudes
            .get(number)
            .zip(outcome.prior_attitudes.get(number));
        let (attitude, prior) = attitudes.ok_or(diverged)?;
        let start = State::at_rest(*attitude);
        let imu = &run.recording.imu;
        let navigator = Navigator::new(imu, &run.site, &at.triads, start)
            .ok_or_else(|| singular(&at.triads))?;
        Ok(Self {
            model,
            stretch,
            accel: at.triads.accel,
            navigator,
            held: *attitude,
            information: {
                let start = stretch.start(prior, attitude);
                let mean = model.prior_mean - to_vector(&at.triads);
                let anew = Information::new(model, &start, &mean);
                match before {
                    Some(before) => anew.with_parameters_of(&before),
                    None => anew,
                }
            },
        })
    }

    fn advance(&mut self, block: &Block, end: usize) -> Result<(), CalibrationError> {
        let time = self.stretch.run.recording.imu.time(end);
        let done = self.information.advance(block, &self.model.process_noise());
        done.ok_or(CalibrationError::Diverged { time })
    }

    /// A step of a dwell, whose attitude may be known.
    fn rest(
        &mut self,
        samples: Range<usize>,
        (at_rest, known): (&AtRest, Option<&Matrix3<f64>>),
        new_position: bool,
    ) -> Result<(), CalibrationError> {
        let model = self.model;
        let tied = at_rest.tied(&self.navigator.state, &self.accel, known);
        if at_rest.first {
            self.information.come_to_rest(&self.navigator.state);
        }
        self.information.refer(&self.navigator.state, &tied);
        self.navigator.state = tied;
        let held = model.aiding == Aiding::Velocity;
        if at_rest.first && held {
            self.information.hold_attitude();
            self.held = tied.attitude;
        }

        if new_position {
            let row = (
                POSITION,
                tied.position,
                self.stretch.position_variance(model),
            );
            self.information.observe(&[row]);
        }
        let end = samples.end;
        self.navigator.stand(&at_rest.sums);
        let block = self.navigator.standing(&tied.attitude, samples);
        self.advance(&block, end)?;
        let state = &block.state;
        if new_position && !held {
            self.information.new_table_position(model.position_sigma);
        }
        let mut rows = Vec::new();
        let variance = self
            .stretch
            .observation_variance(model, Observation::Velocity, 1);
        rows.push((VELOCITY, state.velocity, variance));
        if let Some((reading, count)) = &at_rest.reading {
            let difference = -log(&(state.attitude * reading.transpose()));
            let variance = self
                .stretch
                .observation_variance(model, Observation::Table, *count);
            rows.push((ATTITUDE, difference, variance));
        }
        if held {
            let difference = -log(&(state.attitude * self.held.transpose()));
            let variance = self
                .stretch
                .observation_variance(model, Observation::Attitude, 1);
            rows.push((ATTITUDE, difference, variance));
        }
        self.information.observe(&rows);
        Ok(())
    }
}

/// `[R | z]`: the unknowns x obey `R x = z` up to independent errors of unit variance, R upper
/// triangular. Unknowns in order: attitude of the dwell (three; zero for a table without position error),
/// navigation errors now,
/// parameter errors that are estimated, in units of their prior σ, and initial attitude error.
struct Information {
    rows: Mat<f64>,
    dwell: usize,
    /// Index and prior σ of each estimated parameter.
    parameters: Vec<(usize, f64)>,
}

impl Information {
    fn new(model: &Model, start: &Start, mean: &ParameterVector) -> Self {
        let priors = model.prior_sigma.iter().copied().enumerate();
        let parameters: Vec<_> = priors.filter(|&(_, sigma)| sigma > 0.0).collect();
        let sigma = match model.aiding {
            Aiding::Table => model.position_sigma,
            // The first dwell begins with its own.
            Aiding::Velocity => 1.0,
        };
        let dwell = if sigma > 0.0 { 3 } else { 0 };
        let initial = dwell + NAVIGATION + parameters.len();
        let z = initial + 3;
        let mut rows = Mat::zeros(z, z + 1);
        for axis in 0..dwell {
            rows[(axis, axis)] = 1.0 / sigma;
        }
        for axis in 0..3 {
            let mut know = |index: usize, sigma: f64| rows[(index, index)] = 1.0 / sigma;
            know(dwell + ATTITUDE + axis, SAME);
            know(dwell + VELOCITY + axis, start.velocity_sigma);
            know(dwell + POSITION + axis, start.position_sigma);
            know(initial + axis, start.attitude_sigma[axis]);
            rows[(dwell + ATTITUDE + axis, initial + axis)] = -1.0 / SAME;
            rows[(initial + axis, z)] = start.attitude[axis] / start.attitude_sigma[axis];
        }
        for (n, &(index, sigma)) in parameters.iter().enumerate() {
            let unknown = dwell + NAVIGATION + n;
            rows[(unknown, unknown)] = 1.0;
            rows[(unknown, z)] = mean[index] / sigma;
        }
        Self {
            rows,
            dwell,
            parameters,
        }
    }

    /// The same with what another stretch says of the parameters: all else of it leaves with its rows.
    fn with_parameters_of(mut self, before: &Self) -> Self {
        let (n, own) = (before.unknowns(), self.parameters.len());
        let of_parameters = before.navigation().end..before.navigation().end + own;
        let leaves = (0..n).filter(|column| !of_parameters.contains(column));
        let order: Vec<usize> = leaves.chain(of_parameters.clone()).chain([n]).collect();
        let ordered = Mat::from_fn(n, n + 1, |i, j| before.rows[(i, order[j])]);
        let known = ordered.qr().thin_R().to_owned();
        let first = n - own;
        for i in 0..own {
            let row = of_parameters.start + i;
            for j in 0..own {
                self.rows[(row, of_parameters.start + j)] = known[(first + i, first + j)];
            }
            self.rows[(row, n)] = known[(first + i, n)];
        }
        self
    }

    /// Number of unknowns, and the column of z.
    fn unknowns(&self) -> usize {
        self.rows.nrows()
    }

    fn triangle(&self) -> MatRef<'_, f64> {
        self.rows.get(.., ..self.unknowns())
    }

    /// From the navigation errors x at the beginning of a stretch to those at its end,
    /// `x⁺ = Φ x + Ψ δθ + G w` with w of unit variance: x is replaced by `Φ⁻¹ (x⁺ − Ψ δθ − G w)`,
    /// then w leaves. `None` if Φ has no inverse.
    fn advance(&mut self, block: &Block, noise: &PerSensor<ProcessNoise>) -> Option<()> {
        let back = block.navigation.try_inverse()?;
        let back = Mat::from_fn(NAVIGATION, NAVIGATION, |i, j| back[(i, j)]);
        let driven = Mat::from_fn(NAVIGATION, self.parameters.len(), |i, n| {
            let (index, sigma) = self.parameters[n];
            let (sensor, of_triad) = sensor_and_parameter(index);
            block.parameters.get(sensor)[(i, of_triad)] * sigma
        });
        let sources = sources(&block.noise.covariance(noise));
        let (noise, n) = (sources.ncols(), self.unknowns());

        let at_end = self.rows.get(.., self.navigation()) * &back;
        let of_parameters = &at_end * &driven;
        let of_noise = &at_end * &sources;
        let mut stack = Mat::zeros(noise + n, noise + n + 1);
        for source in 0..noise {
            stack[(source, source)] = 1.0;
        }
        let navigation = noise + self.navigation().start..noise + self.navigation().end;
        let parameters = navigation.end..navigation.end + self.parameters.len();
        let mut place = |columns: Range<usize>, part: &Mat<f64>| {
            stack.get_mut(noise.., columns).copy_from(part);
        };
        place(noise..noise + n + 1, &self.rows);
        place(0..noise, &-of_noise);
        place(navigation, &at_end);
        let mut parameters = stack.get_mut(noise.., parameters);
        parameters -= of_parameters;

        self.rows = stack
            .qr()
            .thin_R()
            .get(noise..noise + n, noise..)
            .to_owned();
        Some(())
    }

    /// The error of the table's position stands first: it leaves with its rows, another takes its
    /// place.
    fn new_table_position(&mut self, sigma: f64) {
        for row in 0..self.dwell {
            self.rows.row_mut(row).fill(0.0);
            self.rows[(row, row)] = 1.0 / sigma;
        }
    }

    /// The attitude of now is what the dwell holds: the error of the one before it leaves with its rows.
    fn hold_attitude(&mut self) {
        for axis in 0..self.dwell {
            self.rows.row_mut(axis).fill(0.0);
            self.rows[(axis, axis)] = 1.0 / SAME;
            self.rows[(axis, self.dwell + ATTITUDE + axis)] = -1.0 / SAME;
        }
    }

    /// Adds observed differences of three navigation errors from a first one on, each with its
    /// variance per axis. An attitude is observed against that of the dwell.
    fn observe(&mut self, observed: &[(usize, Vector3<f64>, f64)]) {
        let n = self.unknowns();
        let mut stack = Mat::zeros(n + 3 * observed.len(), n + 1);
        stack.get_mut(..n, ..).copy_from(&self.rows);
        for (k, (first, difference, variance)) in observed.iter().enumerate() {
            let weight = 1.0 / variance.sqrt();
            for axis in 0..3 {
                let row = n + 3 * k + axis;
                stack[(row, self.dwell + first + axis)] = weight;
                if *first == ATTITUDE && self.dwell > 0 {
                    stack[(row, axis)] = -weight;
                }
                stack[(row, n)] = weight * difference[axis];
            }
        }
        self.rows = stack.qr().thin_R().get(..n, ..).to_owned();
    }

    /// The body has come to rest, see [`crate::calibration::filter::Filter::come_to_rest`].
    fn come_to_rest(&mut self, computed: &State) {
        for (first, computed) in [(VELOCITY, computed.velocity), (POSITION, computed.position)] {
            let turn = skew(computed);
            let turn = Mat::from_fn(3, 3, |i, j| turn[(i, j)]);
            let of_attitude = self.rows.get(.., self.at(first)) * turn;
            let attitude = self.at(ATTITUDE);
            let mut rows = self.rows.get_mut(.., attitude);
            rows += of_attitude;
        }
    }

    /// Refers the navigation errors to another computed state of the same moment, see
    /// [`crate::calibration::filter::Filter::refer`].
    fn refer(&mut self, from: &State, to: &State) {
        let turned = to_tilt_and_heading(&(from.attitude * to.attitude.transpose()));
        let mut shift = Mat::zeros(NAVIGATION, 1);
        for (first, by) in [
            (ATTITUDE, turned),
            (VELOCITY, to.velocity - from.velocity),
            (POSITION, to.position - from.position),
        ] {
            for axis in 0..3 {
                shift[(first + axis, 0)] = by[axis];
            }
        }
        let moved = self.rows.get(.., self.navigation()) * shift;
        let n = self.unknowns();
        let mut z = self.rows.get_mut(.., n..);
        z += moved;
    }

    /// Columns of three navigation errors.
    fn at(&self, first: usize) -> Range<usize> {
        self.dwell + first..self.dwell + first + 3
    }

    fn navigation(&self) -> Range<usize> {
        self.dwell..self.dwell + NAVIGATION
    }

    /// The estimate of all unknowns, one column.
    fn solution(&self) -> Mat<f64> {
        let mut x = self.rows.get(.., self.unknowns()..).to_owned();
        solve_upper(self.triangle(), &mut x);
        x
    }

    /// Estimate and covariance of the parameter errors.
    fn parameters(&self) -> (ParameterVector, ParameterMatrix) {
        // What stands before them leaves with its rows.
        let corner = self
            .triangle()
            .get(self.navigation().end.., self.navigation().end..);
        let mut inverse = Mat::identity(corner.nrows(), corner.nrows());
        solve_upper(corner, &mut inverse);
        let covariance = &inverse * inverse.transpose();
        let solution = self.solution();
        let mut mean = ParameterVector::zeros();
        let mut of_all = ParameterMatrix::zeros();
        for (m, &(i, sigma)) in self.parameters.iter().enumerate() {
            mean[i] = sigma * solution[(self.navigation().end + m, 0)];
            for (n, &(j, other)) in self.parameters.iter().enumerate() {
                of_all[(i, j)] = sigma * covariance[(m, n)] * other;
            }
        }
        (mean, of_all)
    }
}

fn solve_upper(triangle: MatRef<'_, f64>, right: &mut Mat<f64>) {
    faer::linalg::triangular_solve::solve_upper_triangular_in_place(
        triangle,
        right.as_mut(),
        faer::Par::Seq,
    );
}

/// G of as many columns as there are independent sources of noise: `G Gᵀ = Q`.
fn sources(noise: &ErrorMatrix) -> Mat<f64> {
    let sigma = noise.diagonal().map(f64::sqrt);
    // Units differ by orders of magnitude, correlations do not.
    let correlation = Mat::from_fn(NAVIGATION, NAVIGATION, |i, j| {
        let scale = sigma[i] * sigma[j];
        if scale > 0.0 {
            noise[(i, j)] / scale
        } else {
            0.0
        }
    });
    let Ok(eigen) = correlation.self_adjoint_eigen(Side::Lower) else {
        return Mat::zeros(NAVIGATION, 0);
    };
    let values = eigen.S().column_vector();
    let kept: Vec<usize> = (0..NAVIGATION)
        .filter(|&k| values[k] > NO_SOURCE * values[NAVIGATION - 1])
        .collect();
    Mat::from_fn(NAVIGATION, kept.len(), |i, n| {
        sigma[i] * eigen.U()[(i, kept[n])] * values[kept[n]].sqrt()
    })
}
