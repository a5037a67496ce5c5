//! One pass of the filter over a record: live with feedback, or held at a linearisation point.

use std::ops::Range;

use nalgebra::Vector3;

use super::error::CalibrationError;
use super::filter::{Filter, Sight};
use super::further::{Further, constants};
use super::linearisation::{Linearisation, singular};
use super::observability::AttitudeCovariance;
use super::outcome::{Innovation, Moment, Observation, from_vector, to_vector};
use super::problem::Problem;
use super::schedule::Standing;
use super::states::{
    ALL_STATES, ParameterMatrix, ParameterVector, STATES, STATES_WITH_DRIFT, STATES_WITH_TABLE,
};
use crate::attitude::{exp, from_tilt_and_heading, log, to_tilt_and_heading};
use crate::imu::{FURTHER, FurtherVector, PerSensor, Sensor};
use crate::navigation::{FurtherTerms, Navigator, State};

/// How a pass treats its estimates and its gate.
#[derive(Debug, Clone, Copy)]
pub(super) enum Mode<'a> {
    /// Estimates are fed back as they come.
    Live,
    /// Nothing is fed back.
    Held(Gate<'a>),
}

/// Which observations a pass lets in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Gate<'a> {
    /// All.
    Open,
    /// Those that its innovations do not make outliers.
    Innovations,
    /// Those of another pass, in their order.
    As(&'a [Innovation]),
}

/// What a pass gives.
#[derive(Debug, Clone)]
pub(super) struct PassResult {
    /// Where it linearised; in a live pass, at its end.
    pub at: Linearisation,
    /// The estimate: where the next pass linearises.
    pub estimate: Linearisation,
    pub covariance: ParameterMatrix,
    /// Constants beside the parameters.
    pub further: Further,
    pub attitude_covariance: AttitudeCovariance,
    /// 1σ of the initial attitude, East, North and Up.
    pub attitude_sigma: Vector3<f64>,
    /// Whitened innovations squared, summed; the prior is in it, since the filter starts from it.
    /// A rejected observation counts as much as the gate lets pass.
    pub merit: f64,
    /// Logarithm of the determinant of the covariance of all innovations let in: with the merit, −2 ln
    /// of the likelihood.
    pub log_determinant: f64,
    pub innovations: Vec<Innovation>,
    pub history: Vec<Moment>,
}

/// After this many rejections in a row the gate doubts itself rather than the data.
const REOPEN: usize = 5;
/// At most this many observations of a dwell are left out for having shut the gate.
const MOST_SHUTTING: usize = 3;
/// Spacing of the history, s.
const MOMENT: f64 = 1.0;

pub(super) fn pass(
    problem: &Problem,
    at: &Linearisation,
    mode: Mode,
) -> Result<PassResult, CalibrationError> {
    // Only the states that a run needs: covariance costs with their square.
    let noise = &problem.run.noise;
    let drifts = |sensor| noise.get(sensor).instability.is_some();
    if problem.further_sigma != FurtherVector::zeros() {
        Pass::<ALL_STATES>::new(problem, at, mode)?.run()
    } else if problem.table_geometry.any() {
        Pass::<STATES_WITH_TABLE>::new(problem, at, mode)?.run()
    } else if Sensor::ALL.into_iter().any(drifts) {
        Pass::<STATES_WITH_DRIFT>::new(problem, at, mode)?.run()
    } else {
        Pass::<STATES>::new(problem, at, mode)?.run()
    }
}

struct Pass<'a, const N: usize> {
    problem: &'a Problem<'a>,
    mode: Mode<'a>,
    at: Linearisation,
    navigator: Navigator<'a>,
    filter: Filter<N>,
    innovations: Vec<Innovation>,
    history: Vec<Moment>,
    merit: f64,
    log_determinant: f64,
    /// Rejections in a row of velocity and of table observations.
    row: [usize; 2],
    /// Observations of this dwell that are left out because they shut the gate on those after them.
    shutting: Vec<usize>,
}

/// Where a dwell begins, to come back to: after a turn the innovations' covariance is wide, and an
/// outlier that it lets in shuts the gate on the good observations that follow.
struct Begin<'a, const N: usize> {
    step: usize,
    at: Linearisation,
    navigator: Navigator<'a>,
    filter: Filter<N>,
    innovations: usize,
    history: usize,
    merit: f64,
    log_determinant: f64,
}

impl<'a, const N: usize> Pass<'a, N> {
    fn new(
        problem: &'a Problem,
        at: &Linearisation,
        mode: Mode<'a>,
    ) -> Result<Self, CalibrationError> {
        let run = problem.run;
        let walk = PerSensor::from_fn(|sensor| run.noise.get(sensor).random_walk);
        let start = State::at_rest(at.initial_attitude);
        let navigator = Navigator::new(&run.imu, &run.site, walk, &at.triads, start)
            .ok_or_else(|| singular(&at.triads))?
            .with_further(FurtherTerms {
                on: (0..FURTHER)
                    .filter(|&k| problem.further_sigma[k] > 0.0)
                    .collect(),
                values: at.further,
            });
        // The prior keeps its own mean, wherever the pass linearises; a live pass begins at the
        // point it is given and finds its way from there.
        let (parameters, further, attitude) = match mode {
            Mode::Live => (
                ParameterVector::zeros(),
                FurtherVector::zeros(),
                Vector3::zeros(),
            ),
            Mode::Held(_) => (
                problem.prior_mean - to_vector(&at.triads),
                -at.further,
                to_tilt_and_heading(&(problem.attitude.mean * at.initial_attitude.transpose())),
            ),
        };
        let filter = Filter::new(problem.start, &parameters, &problem.prior_sigma, attitude)
            .with_drift(PerSensor::from_fn(|sensor| {
                run.noise.get(sensor).instability
            }))
            .with_table(&problem.table_geometry)
            .with_further(&further, &problem.further_sigma);
        Ok(Self {
            problem,
            mode,
            at: *at,
            navigator,
            filter,
            innovations: Vec::new(),
            history: Vec::new(),
            merit: 0.0,
            log_determinant: 0.0,
            row: [0; 2],
            shutting: Vec::new(),
        })
    }

    fn run(mut self) -> Result<PassResult, CalibrationError> {
        let steps = &self.problem.schedule.steps;
        let mut begin: Option<Begin<N>> = None;
        let mut next = 0;
        while let Some(step) = steps.get(next) {
            let time = self.problem.run.imu.time(step.samples.end);
            if let Some(standing) = &step.standing {
                if standing.first && begin.as_ref().is_none_or(|begin| begin.step != next) {
                    begin = Some(self.begin(next));
                }
                // The start holds what the first dwell says of table and position.
                let new_position = standing.first && next > 0;
                self.stand(step.samples.clone(), time, standing, new_position)?;
                if let Some(begin) = &begin
                    && let Some(shutting) = self.shutting(begin)
                {
                    self.come_back(begin, shutting);
                    next = begin.step;
                    continue;
                }
            } else {
                let block = self.navigator.advance(step.samples.clone());
                self.filter.propagate(&block);
            }
            if self
                .history
                .last()
                .is_none_or(|last| time - last.time >= MOMENT)
            {
                self.history.push(self.moment(time));
            }
            next += 1;
        }
        Ok(PassResult {
            at: self.at,
            estimate: self.estimate(),
            covariance: self.filter.parameter_covariance(),
            further: self.filter.constants(
                &self.at.further,
                constants(
                    &self.problem.table_geometry.vector(),
                    &self.problem.further_sigma,
                ),
            ),
            attitude_covariance: self.filter.attitude_covariance(),
            attitude_sigma: self.filter.initial_attitude_sigma(),
            merit: self.merit,
            log_determinant: self.log_determinant,
            innovations: self.innovations,
            history: self.history,
        })
    }

    fn begin(&mut self, step: usize) -> Begin<'a, N> {
        self.row = [0; 2];
        self.shutting.clear();
        Begin {
            step,
            at: self.at,
            navigator: self.navigator.clone(),
            filter: self.filter.clone(),
            innovations: self.innovations.len(),
            history: self.history.len(),
            merit: self.merit,
            log_determinant: self.log_determinant,
        }
    }

    /// The observation that shut the gate: where several in a row were rejected, the dwell's first of
    /// their kind that was not. None if there is no such thing, or were too many already.
    fn shutting(&self, begin: &Begin<N>) -> Option<usize> {
        if self.shutting.len() >= MOST_SHUTTING {
            return None;
        }
        let of_dwell = self.innovations.iter().enumerate().skip(begin.innovations);
        let row = |i: &Innovation| self.row[i.observation as usize];
        of_dwell
            .filter(|(_, i)| i.accepted && row(i) >= REOPEN)
            .map(|(index, _)| index)
            .next()
    }

    fn come_back(&mut self, begin: &Begin<'a, N>, shutting: usize) {
        self.at = begin.at;
        self.navigator = begin.navigator.clone();
        self.filter = begin.filter.clone();
        self.innovations.truncate(begin.innovations);
        self.history.truncate(begin.history);
        self.merit = begin.merit;
        self.log_determinant = begin.log_determinant;
        self.row = [0; 2];
        self.shutting.push(shutting);
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
        if matches!(self.mode, Mode::Held(_)) {
            let tied = standing.tied(&self.navigator.state, &self.at.triads.accel);
            if standing.first {
                self.filter.come_to_rest(&self.navigator.state);
            }
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
            let sight = Sight::table(standing.tilts);
            self.observe(time, Observation::Table, sight, difference, variance)?;
        }
        match self.mode {
            Mode::Live => self.feed_back(),
            Mode::Held(_) => Ok(()),
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
        let (whitened, log_determinant) = self
            .filter
            .whitened(sight, &difference, variance)
            .ok_or(CalibrationError::Diverged { time })?;
        let distance = whitened.norm_squared();
        let index = self.innovations.len();
        let row = &mut self.row[observation as usize];
        let accepted = match self.mode {
            Mode::Held(Gate::Open) => true,
            Mode::Held(Gate::As(other)) => other.get(index).is_none_or(|i| i.accepted),
            Mode::Held(Gate::Innovations) | Mode::Live => {
                let sound = distance <= self.problem.gate && !self.shutting.contains(&index);
                sound || *row >= REOPEN
            }
        };
        if accepted {
            *row = 0;
            self.merit += distance;
            self.log_determinant += log_determinant;
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
        self.at.further += feedback.further;
        self.navigator.set_further(self.at.further);
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
            further: self.at.further + self.filter.further(),
            initial_attitude: from_tilt_and_heading(&self.filter.initial_attitude())
                * self.at.initial_attitude,
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
