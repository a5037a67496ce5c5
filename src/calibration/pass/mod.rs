//! One pass of the filter over all stretches: with feedback as it goes, or linearised at a given point.

mod filter;
mod measurement;

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::auxiliary::{Auxiliary, AuxiliaryVector, auxiliary_vector};
use super::error::CalibrationError;
use super::innovation::{Innovation, Observation};
use super::layout::Layout;
use super::linearisation::{AttitudePrior, Linearisation, singular};
use super::observability::AttitudeCovariance;
use super::parameters::{ParameterMatrix, ParameterVector, from_vector, to_vector};
use super::problem::{Problem, Stretch};
use super::schedule::{AtRest, Step};
use crate::attitude::{exp, from_tilt_and_heading};
use crate::imu::TermVector;
use crate::navigation::{Navigator, State, TermValues};
pub(super) use filter::{Filter, ScalarInnovation};
pub(super) use measurement::Measurement;

/// How a pass treats its estimates and its gate.
#[derive(Debug, Clone, Copy)]
pub(super) enum Mode<'a> {
    /// Estimates are fed back as they come.
    Feedback,
    /// Linearisation is held at the given point.
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

/// Estimate and σ at one time of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Epoch {
    /// Time, s.
    pub time: f64,
    /// Parameters of both triads.
    pub estimate: ParameterVector,
    /// 1σ of each.
    pub sigma: ParameterVector,
}

/// What a pass gives.
#[derive(Debug, Clone)]
pub(super) struct PassResult {
    /// Where it linearised; in a pass with feedback, at its end.
    pub at: Linearisation,
    /// The estimate: where the next pass linearises.
    pub estimate: Linearisation,
    pub covariance: ParameterMatrix,
    /// Parameters of error terms and table.
    pub auxiliary: Auxiliary,
    /// Of the initial attitude of the last stretch.
    pub attitude_covariance: AttitudeCovariance,
    /// 1σ of the initial attitude of the last stretch, East, North and Up.
    pub attitude_sigma: Vector3<f64>,
    /// Cost: whitened innovations squared, summed; the prior is in it, since the filter starts from it.
    /// A rejected observation counts as much as the gate lets pass.
    pub cost: f64,
    /// Logarithm of the determinant of the covariance of all innovations let in: with the cost, −2 ln
    /// of the likelihood.
    pub log_determinant: f64,
    pub innovations: Vec<Innovation>,
    pub history: Vec<Epoch>,
}

/// After this many rejections in a row the gate doubts itself rather than the data.
const REOPEN: usize = 5;
/// At most this many observations of a dwell are left out for having closed the gate.
const MOST_CLOSING: usize = 3;
/// Spacing of the history, s.
const EPOCH: f64 = 1.0;

/// A pass over all stretches of a problem, `priors` what is known of the initial attitude of each.
pub(super) fn pass(
    problem: &Problem,
    priors: &[AttitudePrior],
    at: &Linearisation,
    mode: Mode,
) -> Result<PassResult, CalibrationError> {
    let model = &problem.model;
    // The prior keeps its own mean, wherever the pass linearises; a pass with feedback begins at the
    // point it is given and finds its way from there.
    let (parameters, terms) = match mode {
        Mode::Feedback => (ParameterVector::zeros(), TermVector::zeros()),
        Mode::Held(_) => (model.prior_mean - to_vector(&at.triads), -at.terms),
    };
    let mut sums = Sums {
        at: at.clone(),
        filter: Filter::new(model, &parameters, &terms),
        innovations: Vec::new(),
        history: Vec::new(),
        cost: 0.0,
        log_determinant: 0.0,
    };
    let mut before = None;
    let mut attitudes = Vec::new();
    for (number, (stretch, prior)) in problem.stretches().iter().zip(priors).enumerate() {
        let known = match mode {
            // The given point is where it begins.
            Mode::Feedback => AttitudePrior {
                mean: at.initial_attitudes[number],
                ..*prior
            },
            Mode::Held(_) => *prior,
        };
        let start = stretch.start(&known, &at.initial_attitudes[number]);
        let anew = before != Some(stretch.recording);
        before = Some(stretch.recording);
        let table = model.position_sigma;
        sums.filter.begin(&start, table, anew);
        let mut one = OneStretch::new(problem, stretch, number, mode, sums)?;
        one.run()?;
        sums = one.sums;
        if number + 1 < problem.stretches().len() {
            attitudes.push(InitialAttitude::of(&sums.filter, mode));
        }
    }
    Ok(sums.result(model_prior(problem), &attitudes))
}

fn model_prior(problem: &Problem) -> AuxiliaryVector {
    let model = &problem.model;
    auxiliary_vector(&model.geometry.vector(), &model.term_sigma)
}

/// What a pass has come to so far.
#[derive(Debug, Clone)]
struct Sums {
    at: Linearisation,
    filter: Filter,
    innovations: Vec<Innovation>,
    history: Vec<Epoch>,
    cost: f64,
    log_determinant: f64,
}

/// A pass within a stretch.
struct OneStretch<'a> {
    problem: &'a Problem<'a>,
    stretch: &'a Stretch<'a>,
    number: usize,
    mode: Mode<'a>,
    navigator: Navigator<'a>,
    sums: Sums,
    gate: f64,
    /// Rejections in a row of velocity and of table observations.
    row: [usize; 2],
    /// Observations of this dwell that are left out because they closed the gate to those after them.
    closing: Vec<usize>,
}

/// Where a dwell begins, to go back to: after a turn the innovations' covariance is wide, and an
/// outlier that it lets in closes the gate to the good observations that follow.
struct Begin<'a> {
    step: usize,
    navigator: Navigator<'a>,
    at: Linearisation,
    filter: Filter,
    innovations: usize,
    history: usize,
    cost: f64,
    log_determinant: f64,
}

/// Navigation through a stretch from this initial attitude on.
pub(super) fn navigator<'a>(
    stretch: &Stretch<'a>,
    at: &Linearisation,
    initial: &Matrix3<f64>,
    layout: &Layout,
) -> Result<Navigator<'a>, CalibrationError> {
    let run = stretch.run;
    let on = layout.terms().map(|(_, index)| index);
    let terms = TermValues {
        on: on.collect(),
        values: at.terms,
    };
    let start = State::at_rest(*initial);
    let navigator = Navigator::new(&run.recording.imu, &run.site, &at.triads, start);
    let navigator = navigator.ok_or_else(|| singular(&at.triads))?;
    Ok(navigator.with_terms(terms))
}

impl<'a> OneStretch<'a> {
    fn new(
        problem: &'a Problem<'a>,
        stretch: &'a Stretch<'a>,
        number: usize,
        mode: Mode<'a>,
        sums: Sums,
    ) -> Result<Self, CalibrationError> {
        let initial = &sums.at.initial_attitudes[number];
        let navigator = navigator(stretch, &sums.at, initial, &sums.filter.layout)?;
        Ok(Self {
            problem,
            stretch,
            number,
            mode,
            navigator,
            sums,
            gate: problem.gate(),
            row: [0; 2],
            closing: Vec::new(),
        })
    }

    fn run(&mut self) -> Result<(), CalibrationError> {
        let steps: &'a [Step] = &self.stretch.steps;
        let mut begin: Option<Begin> = None;
        let mut next = 0;
        while let Some(step) = steps.get(next) {
            let time = self.stretch.run.recording.imu.time(step.samples.end);
            if let Some(at_rest) = &step.at_rest {
                if at_rest.first && begin.as_ref().is_none_or(|begin| begin.step != next) {
                    begin = Some(self.begin(next));
                }
                // The start holds what the first dwell says of table and position.
                let new_position = at_rest.first && next > 0;
                self.rest(step.samples.clone(), time, at_rest, new_position)?;
                if let Some(begin) = &begin
                    && let Some(closing) = self.closing(begin)
                {
                    self.go_back(begin, closing);
                    next = begin.step;
                    continue;
                }
            } else {
                let block = self.navigator.advance(step.samples.clone());
                self.sums.filter.propagate(&block);
            }
            let last = self.sums.history.last();
            if last.is_none_or(|last| (time - last.time).abs() >= EPOCH) {
                let epoch = self.sums.epoch(time);
                self.sums.history.push(epoch);
            }
            next += 1;
        }
        Ok(())
    }

    fn begin(&mut self, step: usize) -> Begin<'a> {
        self.row = [0; 2];
        self.closing.clear();
        let Sums {
            at,
            filter,
            innovations,
            history,
            cost,
            log_determinant,
        } = &self.sums;
        Begin {
            step,
            navigator: self.navigator.clone(),
            at: at.clone(),
            filter: filter.clone(),
            innovations: innovations.len(),
            history: history.len(),
            cost: *cost,
            log_determinant: *log_determinant,
        }
    }

    /// The observation that closed the gate: where several in a row were rejected, the dwell's first of
    /// their kind that was not. None if there is no such thing, or were too many already.
    fn closing(&self, begin: &Begin) -> Option<usize> {
        if matches!(self.mode, Mode::Held(Gate::As(_))) {
            return None;
        }
        let closed = self.row.iter().any(|&row| row >= REOPEN);
        if !closed || self.closing.len() >= MOST_CLOSING {
            return None;
        }
        let of_dwell = self.sums.innovations.iter().enumerate();
        let of_dwell = of_dwell.skip(begin.innovations);
        let row = |i: &Innovation| self.row[i.observation as usize];
        of_dwell
            .filter(|(_, i)| i.accepted && row(i) >= REOPEN)
            .map(|(index, _)| index)
            .next()
    }

    fn go_back(&mut self, begin: &Begin<'a>, closing: usize) {
        self.navigator = begin.navigator.clone();
        self.sums.at = begin.at.clone();
        self.sums.filter = begin.filter.clone();
        self.sums.innovations.truncate(begin.innovations);
        self.sums.history.truncate(begin.history);
        self.sums.cost = begin.cost;
        self.sums.log_determinant = begin.log_determinant;
        self.row = [0; 2];
        self.closing.push(closing);
    }

    /// A step within a dwell, which ends at `time`.
    fn rest(
        &mut self,
        samples: Range<usize>,
        time: f64,
        at_rest: &AtRest,
        new_position: bool,
    ) -> Result<(), CalibrationError> {
        let (model, variance) = (&self.problem.model, self.stretch.variance);
        let filter = &mut self.sums.filter;
        if matches!(self.mode, Mode::Held(_)) {
            let tied = at_rest.tied(&self.navigator.state, &self.sums.at.triads.accel);
            if at_rest.first {
                filter.come_to_rest(&self.navigator.state);
            }
            filter.refer(&self.navigator.state, &tied);
            self.navigator.state = tied;
        }
        let block = self.navigator.advance_standing(samples);
        filter.propagate(&block);
        let state = block.state;
        if new_position {
            filter.redraw_table(model.position_sigma);
            // Between positions the IMU moves by its distance from the table's centre, within one
            // not at all: one observation a dwell, however long it is.
            filter.update(&Measurement::position(&state, variance.position));
        }
        let velocity = Measurement::velocity(&state, self.stretch.velocity_variance(model));
        self.observe(time, Observation::Velocity, &velocity)?;
        if let Some((reading, count)) = &at_rest.reading {
            let white = model.reading_sigma.powi(2) / *count as f64 + variance.attitude;
            let layout = &self.sums.filter.layout;
            let tilts = at_rest.tilts.as_ref();
            let attitude = Measurement::table(layout, &state, reading, tilts, white);
            self.observe(time, Observation::Table, &attitude)?;
        }
        match self.mode {
            Mode::Feedback => self.feed_back(),
            Mode::Held(_) => Ok(()),
        }
    }

    fn observe(
        &mut self,
        time: f64,
        observation: Observation,
        measurement: &Measurement,
    ) -> Result<(), CalibrationError> {
        let sums = &mut self.sums;
        let (whitened, log_determinant) = sums
            .filter
            .whitened(measurement)
            .ok_or(CalibrationError::Diverged { time })?;
        let distance = whitened.norm_squared();
        let index = sums.innovations.len();
        let row = &mut self.row[observation as usize];
        let accepted = match self.mode {
            Mode::Held(Gate::Open) => true,
            Mode::Held(Gate::As(other)) => other.get(index).is_none_or(|i| i.accepted),
            Mode::Held(Gate::Innovations) | Mode::Feedback => {
                let sound = distance <= self.gate && !self.closing.contains(&index);
                sound || *row >= REOPEN
            }
        };
        if accepted {
            *row = 0;
            sums.cost += distance;
            sums.log_determinant += log_determinant;
            sums.filter.update(measurement);
        } else {
            *row += 1;
            sums.cost += self.gate;
        }
        sums.innovations.push(Innovation {
            time,
            observation,
            whitened: whitened.into(),
            accepted,
        });
        Ok(())
    }

    fn feed_back(&mut self) -> Result<(), CalibrationError> {
        let feedback = self.sums.filter.take_feedback();
        let state = &mut self.navigator.state;
        state.attitude = exp(feedback.attitude) * state.attitude;
        state.velocity -= feedback.velocity;
        state.position -= feedback.position;
        let at = &mut self.sums.at;
        let initial = &mut at.initial_attitudes[self.number];
        *initial = exp(feedback.initial_attitude) * *initial;
        at.triads = from_vector(
            self.problem.model.form,
            &(to_vector(&at.triads) + feedback.parameters),
        );
        at.terms += feedback.terms;
        self.navigator.set_terms(at.terms);
        self.navigator
            .set_triads(&at.triads)
            .ok_or_else(|| singular(&at.triads))
    }
}

impl Sums {
    fn epoch(&self, time: f64) -> Epoch {
        Epoch {
            time,
            estimate: to_vector(&self.at.triads) + self.filter.parameters(),
            sigma: self.filter.parameter_sigma(),
        }
    }

    fn result(self, prior_sigma: AuxiliaryVector, earlier: &[InitialAttitude]) -> PassResult {
        let filter = &self.filter;
        let form = self.at.triads.gyro.form;
        let errors = earlier.iter().map(|attitude| attitude.smoothed(filter));
        let errors = errors.chain([filter.initial_attitude()]);
        let attitudes = self.at.initial_attitudes.iter().zip(errors);
        let estimate = Linearisation {
            triads: from_vector(form, &(to_vector(&self.at.triads) + filter.parameters())),
            terms: self.at.terms + filter.terms(),
            initial_attitudes: attitudes
                .map(|(at, error): (&Matrix3<f64>, _)| from_tilt_and_heading(&error) * at)
                .collect(),
        };
        let initial = filter.layout.initial_attitude();
        let attitude_sigma = filter.initial_attitude_sigma();
        let mut attitude_covariance = AttitudeCovariance::zeros();
        for (state, index) in filter.layout.parameters() {
            for axis in 0..3 {
                attitude_covariance[(index, axis)] =
                    filter.covariance(state, initial + axis) / attitude_sigma[axis];
            }
        }
        PassResult {
            estimate,
            covariance: filter.parameter_covariance(),
            auxiliary: auxiliary(filter, &self.at.terms, prior_sigma),
            attitude_covariance,
            attitude_sigma,
            cost: self.cost,
            log_determinant: self.log_determinant,
            innovations: self.innovations,
            history: self.history,
            at: self.at,
        }
    }
}

/// Estimates of error terms and table, those of terms off `at` where the pass linearises.
fn auxiliary(filter: &Filter, at: &TermVector, prior_sigma: AuxiliaryVector) -> Auxiliary {
    let layout = &filter.layout;
    let mut auxiliary = Auxiliary {
        prior_sigma,
        ..Auxiliary::default()
    };
    let states = auxiliary_states(layout);
    for &(state, k) in &states {
        auxiliary.values[k] = filter.mean(state) + Auxiliary::of_terms(k).map_or(0.0, |t| at[t]);
        for &(other, j) in &states {
            auxiliary.covariance[(k, j)] = filter.covariance(state, other);
        }
        for (parameter, index) in layout.parameters() {
            auxiliary.cross[(index, k)] = filter.covariance(parameter, state);
        }
    }
    auxiliary
}

/// State and index among the auxiliary parameters of each that is on.
fn auxiliary_states(layout: &Layout) -> Vec<(usize, usize)> {
    let base = layout.table_base().into_iter();
    let base = base.flat_map(|first| (0..3).map(move |axis| (first + axis, axis)));
    let tilts = layout.table_tilts().map(|(state, k)| (state, 3 + k));
    let terms = layout.terms();
    let terms = terms.map(|(state, k)| (state, crate::turntable::TABLE_GEOMETRY + k));
    base.chain(tilts).chain(terms).collect()
}

/// The initial attitude of a stretch as its own data and those before it show it, with what later ones
/// add by way of the states that all share.
#[derive(Debug, Clone)]
struct InitialAttitude {
    error: Vector3<f64>,
    /// Mean of the shared states then.
    shared: DVector<f64>,
    /// Covariance with them times the inverse of theirs.
    gain: DMatrix<f64>,
}

impl InitialAttitude {
    fn of(filter: &Filter, mode: Mode) -> Self {
        let states: Vec<usize> = match mode {
            // What is fed back is in no mean.
            Mode::Feedback => Vec::new(),
            Mode::Held(_) => filter.layout.shared().collect(),
        };
        let initial = filter.layout.initial_attitude();
        let n = states.len();
        let sigma: Vec<f64> = states
            .iter()
            .map(|&s| filter.covariance(s, s).sqrt())
            .collect();
        let correlation = DMatrix::from_fn(n, n, |i, j| {
            filter.covariance(states[i], states[j]) / (sigma[i] * sigma[j])
        });
        let cross = DMatrix::from_fn(n, 3, |i, axis| {
            filter.covariance(states[i], initial + axis) / sigma[i]
        });
        // Without an inverse later data change nothing that is known of this attitude.
        let solved = correlation.cholesky().map(|factor| factor.solve(&cross));
        let gain = solved.map_or_else(
            || DMatrix::zeros(3, n),
            |gain| DMatrix::from_fn(3, n, |axis, i| gain[(i, axis)] / sigma[i]),
        );
        Self {
            error: filter.initial_attitude(),
            shared: DVector::from_fn(n, |i, _| filter.mean(states[i])),
            gain,
        }
    }

    fn smoothed(&self, last: &Filter) -> Vector3<f64> {
        let states = last.layout.shared();
        let change = states
            .zip(&self.shared)
            .map(|(s, then)| last.mean(s) - then);
        let change = DVector::from_iterator(self.shared.len(), change);
        let moved = &self.gain * change;
        self.error + Vector3::from_fn(|axis, _| moved[axis])
    }
}
