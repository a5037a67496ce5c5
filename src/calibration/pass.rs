//! One pass of the filter over a record: live with feedback, or held at a linearisation point.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::error::CalibrationError;
use super::filter::{Filter, Sight, Start};
use super::observability::AttitudeCovariance;
use super::outcome::{Innovation, Moment, Observation, from_vector, to_vector};
use super::schedule::{Schedule, Standing};
use super::states::{ParameterMatrix, ParameterVector};
use crate::attitude::{exp, log};
use crate::imu::{InstallationForm, PerSensor, Sensor, Triad};
use crate::navigation::{Navigator, State};
use crate::run::Run;

/// What all passes over a run share.
#[derive(Debug, Clone)]
pub(super) struct Problem<'a> {
    pub run: &'a Run,
    pub schedule: Schedule,
    pub form: InstallationForm,
    pub prior_mean: ParameterVector,
    pub prior_sigma: ParameterVector,
    pub start: Start,
    pub variance: Variance,
    /// White 1σ of the velocity at standstill, m/s, that is in `variance` already.
    pub velocity_sigma: f64,
    pub gate: f64,
}

/// Variance of each observation per axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Variance {
    pub velocity: f64,
    pub position: f64,
    /// Of one reading of the table.
    pub reading: f64,
    /// Of the computed attitude: a pulse's worth.
    pub attitude: f64,
    /// Of the table's position, drawn anew at each.
    pub table: f64,
}

/// The point at which a pass linearises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linearisation {
    /// The instrument.
    pub triads: PerSensor<Triad>,
    /// `C_b_n` at the first sample.
    pub initial_attitude: Matrix3<f64>,
}

impl Linearisation {
    /// The point a fraction of the way to another.
    pub(super) fn towards(&self, other: &Self, fraction: f64) -> Self {
        let from = to_vector(&self.triads);
        let turn = log(&(other.initial_attitude * self.initial_attitude.transpose()));
        Self {
            triads: from_vector(
                self.triads.gyro.form,
                &(from + (to_vector(&other.triads) - from) * fraction),
            ),
            initial_attitude: exp(turn * fraction) * self.initial_attitude,
        }
    }
}

/// How a pass treats its estimates and its gate.
#[derive(Debug, Clone, Copy)]
pub(super) enum Mode<'a> {
    /// Estimates are fed back as they come; the gate judges each observation as it comes.
    Live,
    /// Nothing is fed back; these observations, in their order, are left out (none if empty).
    Held { rejected: &'a [bool] },
}

/// What a pass gives.
#[derive(Debug, Clone)]
pub(super) struct PassResult {
    /// Where it linearised; in a live pass, at its end.
    pub at: Linearisation,
    /// The estimate: where the next pass linearises.
    pub estimate: Linearisation,
    pub covariance: ParameterMatrix,
    pub attitude_covariance: AttitudeCovariance,
    /// Whitened innovations squared, summed; the prior is in it, since the filter starts from it.
    /// A rejected observation counts as much as the gate lets pass.
    pub merit: f64,
    pub innovations: Vec<Innovation>,
    pub history: Vec<Moment>,
}

/// Chance that the gate rejects a sound observation.
const FALSE_REJECTION: f64 = 1e-6;
/// After this many rejections in a row the live gate doubts itself rather than the data.
const REOPEN: usize = 5;
/// Spacing of the history, s.
const MOMENT: f64 = 1.0;

/// Squared whitened innovation of three components beyond which an observation is an outlier.
pub(super) fn gate() -> f64 {
    // Three degrees of freedom are always valid.
    ChiSquared::new(3.0).map_or(f64::INFINITY, |chi2| {
        chi2.inverse_cdf(1.0 - FALSE_REJECTION)
    })
}

pub(super) fn pass(
    problem: &Problem,
    at: &Linearisation,
    mode: Mode,
) -> Result<PassResult, CalibrationError> {
    Pass::new(problem, at, mode)?.run()
}

struct Pass<'a> {
    problem: &'a Problem<'a>,
    mode: Mode<'a>,
    at: Linearisation,
    navigator: Navigator<'a>,
    filter: Filter,
    innovations: Vec<Innovation>,
    merit: f64,
    /// Rejections in a row of velocity and of table observations.
    row: [usize; 2],
}

impl<'a> Pass<'a> {
    fn new(
        problem: &'a Problem,
        at: &Linearisation,
        mode: Mode<'a>,
    ) -> Result<Self, CalibrationError> {
        let run = problem.run;
        let walk = PerSensor::from_fn(|sensor| run.noise.get(sensor).random_walk);
        let start = State::at_rest(at.initial_attitude);
        let navigator = Navigator::new(&run.imu, &run.site, walk, &at.triads, start)
            .ok_or_else(|| singular(&at.triads))?;
        // The prior keeps its own mean, wherever the pass linearises; a live pass begins at the
        // point it is given and finds its way from there.
        let (parameters, attitude) = match mode {
            Mode::Live => (ParameterVector::zeros(), Vector3::zeros()),
            Mode::Held { .. } => (
                problem.prior_mean - to_vector(&at.triads),
                log(&(problem.schedule.initial_attitude * at.initial_attitude.transpose())),
            ),
        };
        let filter = Filter::new(problem.start, &parameters, &problem.prior_sigma, attitude);
        Ok(Self {
            problem,
            mode,
            at: *at,
            navigator,
            filter,
            innovations: Vec::new(),
            merit: 0.0,
            row: [0; 2],
        })
    }

    fn run(mut self) -> Result<PassResult, CalibrationError> {
        let mut history: Vec<Moment> = Vec::new();
        let mut stood = false;
        for step in &self.problem.schedule.steps {
            let time = self.problem.run.imu.time(step.samples.end);
            match &step.standing {
                Some(standing) => {
                    self.stand(
                        step.samples.clone(),
                        time,
                        standing,
                        standing.first && stood,
                    )?;
                    stood = true;
                }
                None => {
                    let block = self.navigator.advance(step.samples.clone());
                    self.filter.propagate(&block);
                }
            }
            if history.last().is_none_or(|last| time - last.time >= MOMENT) {
                history.push(self.moment(time));
            }
        }
        Ok(PassResult {
            at: self.at,
            estimate: self.estimate(),
            covariance: self.filter.parameter_covariance(),
            attitude_covariance: self.filter.attitude_covariance(),
            merit: self.merit,
            innovations: self.innovations,
            history,
        })
    }

    /// A stretch of a dwell, which ends at `time`.
    fn stand(
        &mut self,
        samples: Range<usize>,
        time: f64,
        standing: &Standing,
        new_position: bool,
    ) -> Result<(), CalibrationError> {
        let variance = self.problem.variance;
        if matches!(self.mode, Mode::Held { .. }) {
            // The table's own mean reading is within arc seconds of the truth in every pass, so what
            // noise adds up to over a long record never leaves the linear range.
            let tied = State::at_rest(standing.attitude);
            self.filter.refer(&self.navigator.state, &tied);
            self.navigator.state = tied;
        }
        let block = self.navigator.advance_standing(samples);
        self.filter.propagate(&block);
        let State {
            attitude,
            velocity,
            position,
        } = block.state;
        // The start holds what the first dwell says of table and position.
        if new_position {
            self.filter.redraw_table(variance.table.sqrt());
            // Between positions the IMU moves by its distance from the table's centre, within one
            // not at all: one observation a dwell, however long it is.
            self.filter
                .observe(Sight::POSITION, &position, variance.position);
        }
        let kind = Observation::Velocity;
        self.observe(time, kind, Sight::VELOCITY, velocity, variance.velocity)?;
        if let Some((reading, count)) = &standing.reading {
            let difference = -log(&(attitude * reading.transpose()));
            let variance = variance.reading / *count as f64 + variance.attitude;
            self.observe(time, Observation::Table, Sight::TABLE, difference, variance)?;
        }
        match self.mode {
            Mode::Live => self.feed_back(),
            Mode::Held { .. } => Ok(()),
        }
    }

    fn observe(
        &mut self,
        time: f64,
        observation: Observation,
        sight: Sight,
        difference: Vector3<f64>,
        variance: f64,
    ) -> Result<(), CalibrationError> {
        let whitened = self
            .filter
            .whitened(sight, &difference, variance)
            .ok_or(CalibrationError::Diverged { time })?;
        let distance = whitened.norm_squared();
        let row = &mut self.row[observation as usize];
        let accepted = match self.mode {
            Mode::Live => distance <= self.problem.gate || *row >= REOPEN,
            Mode::Held { rejected } => !rejected
                .get(self.innovations.len())
                .copied()
                .unwrap_or(false),
        };
        if accepted {
            *row = 0;
            self.merit += distance;
            self.filter.observe(sight, &difference, variance);
        } else {
            *row += 1;
            self.merit += self.problem.gate;
        }
        self.innovations.push(Innovation {
            time,
            observation,
            whitened: whitened.into(),
            accepted,
        });
        Ok(())
    }

    fn feed_back(&mut self) -> Result<(), CalibrationError> {
        let feedback = self.filter.take_feedback();
        let state = &mut self.navigator.state;
        state.attitude = exp(feedback.attitude) * state.attitude;
        state.velocity -= feedback.velocity;
        state.position -= feedback.position;
        self.at.initial_attitude = exp(feedback.initial_attitude) * self.at.initial_attitude;
        self.at.triads = from_vector(
            self.problem.form,
            &(to_vector(&self.at.triads) + feedback.parameters),
        );
        self.navigator
            .set_triads(&self.at.triads)
            .ok_or_else(|| singular(&self.at.triads))
    }

    fn estimate(&self) -> Linearisation {
        Linearisation {
            triads: from_vector(
                self.problem.form,
                &(to_vector(&self.at.triads) + self.filter.parameters()),
            ),
            initial_attitude: exp(self.filter.initial_attitude()) * self.at.initial_attitude,
        }
    }

    fn moment(&self, time: f64) -> Moment {
        Moment {
            time,
            estimate: to_vector(&self.at.triads) + self.filter.parameters(),
            sigma: self.filter.parameter_sigma(),
        }
    }
}

/// The error that names the triad whose sensitivity is singular.
pub(super) fn singular(triads: &PerSensor<Triad>) -> CalibrationError {
    let sensor = Sensor::ALL
        .into_iter()
        .find(|&sensor| triads.get(sensor).correction().is_none())
        .unwrap_or(Sensor::Gyro);
    CalibrationError::Singular { sensor }
}
