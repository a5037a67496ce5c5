//! A pass within a stretch.

use std::ops::Range;

use nalgebra::Matrix3;

use super::filter::Filter;
use super::measurement::Measurement;
use super::mode::{Gate, Mode};
use super::result::Sums;
use crate::attitude::exp;
use crate::calibration::error::CalibrationError;
use crate::calibration::innovation::{Innovation, Observation};
use crate::calibration::layout::Layout;
use crate::calibration::linearisation::{Linearisation, singular};
use crate::calibration::parameters::{from_vector, to_vector};
use crate::calibration::problem::{Problem, Stretch};
use crate::calibration::schedule::{AtRest, Step};
use crate::navigation::{Navigator, State, TermValues};

/// After this many rejections in a row the gate doubts itself rather than the data.
const REOPEN: usize = 5;
/// So many right behind the only one that was let in speak against that one: it alone had a wide
/// innovation covariance, and two outliers in a row are rarer than one.
const BEHIND_THE_FIRST: usize = 2;
/// At most this many observations of a dwell are left out for having closed the gate.
const MOST_CLOSING: usize = 3;
/// Spacing of the history, s.
const EPOCH: f64 = 1.0;

/// A pass within a stretch.
pub(super) struct OneStretch<'a> {
    problem: &'a Problem<'a>,
    stretch: &'a Stretch<'a>,
    number: usize,
    mode: Mode<'a>,
    navigator: Navigator<'a>,
    pub sums: Sums,
    gate: f64,
    /// Rejections in a row of each kind of observation.
    row: [usize; Observation::ALL.len()],
    /// The attitude that the dwell holds without a table, as it is computed when it begins.
    held: Matrix3<f64>,
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
pub(in crate::calibration) fn navigator<'a>(
    stretch: &Stretch<'a>,
    at: &Linearisation,
    initial: &Matrix3<f64>,
    layout: &Layout,
) -> Result<Navigator<'a>, CalibrationError> {
    let run = stretch.run;
    let tried = layout.tried_terms();
    let on = layout.terms().chain(tried).map(|(_, index)| index);
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
    pub fn new(
        problem: &'a Problem<'a>,
        stretch: &'a Stretch<'a>,
        number: usize,
        mode: Mode<'a>,
        sums: Sums,
    ) -> Result<Self, CalibrationError> {
        let initial = sums.at.initial_attitudes[number];
        let navigator = navigator(stretch, &sums.at, &initial, &sums.filter.layout)?;
        Ok(Self {
            problem,
            stretch,
            number,
            mode,
            navigator,
            sums,
            gate: problem.gate(),
            row: [0; Observation::ALL.len()],
            held: initial,
            closing: Vec::new(),
        })
    }

    pub fn run(&mut self) -> Result<(), CalibrationError> {
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
            let in_dwell = |step: &Step| step.at_rest.as_ref().is_some_and(|rest| !rest.first);
            if step.at_rest.is_some() && !steps.get(next).is_some_and(in_dwell) {
                let posterior = self.sums.filter.constants();
                self.sums.posteriors.push(posterior);
            }
        }
        Ok(())
    }

    fn begin(&mut self, step: usize) -> Begin<'a> {
        self.row = Default::default();
        self.closing.clear();
        let Sums {
            at,
            filter,
            innovations,
            history,
            cost,
            log_determinant,
            ..
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
        if self.closing.len() >= MOST_CLOSING {
            return None;
        }
        let row = |kind: Observation| self.row[kind as usize];
        let mut closed = Observation::ALL
            .into_iter()
            .filter(|&kind| row(kind) >= BEHIND_THE_FIRST);
        closed.find_map(|kind| {
            let of_dwell = self.sums.innovations.iter().enumerate();
            let of_kind = of_dwell.skip(begin.innovations);
            let mut let_in = of_kind.filter(|(_, i)| i.accepted && i.observation == kind);
            let (first, _) = let_in.next()?;
            let most = match let_in.next() {
                Some(_) => REOPEN,
                None => BEHIND_THE_FIRST,
            };
            (row(kind) >= most).then_some(first)
        })
    }

    fn go_back(&mut self, begin: &Begin<'a>, closing: usize) {
        self.navigator = begin.navigator.clone();
        self.sums.at = begin.at.clone();
        self.sums.filter = begin.filter.clone();
        self.sums.innovations.truncate(begin.innovations);
        self.sums.history.truncate(begin.history);
        self.sums.cost = begin.cost;
        self.sums.log_determinant = begin.log_determinant;
        self.row = Default::default();
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
        if at_rest.first {
            filter.begin_to_hold();
            self.held = self.navigator.state.attitude;
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
        let of_stretch = (self.stretch, model, &self.sums.filter.layout);
        let measurements = Measurement::of_rest(of_stretch, at_rest, &state, &self.held);
        for (observation, measurement) in measurements {
            self.observe(time, observation, &measurement)?;
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
            dwell: sums.posteriors.len() - 1,
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
