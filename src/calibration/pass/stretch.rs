//! A pass within a stretch.

use nalgebra::Matrix3;

use super::gate::{Judge, Memory};
use super::mode::Mode;
use super::result::Sums;
use crate::attitude::exp;
use crate::calibration::error::CalibrationError;
use crate::calibration::filter::measurement::Measurement;
use crate::calibration::filter::{Filter, Taken};
use crate::calibration::layout::Layout;
use crate::calibration::linearisation::{Linearisation, singular};
use crate::calibration::model::Model;
use crate::calibration::parameters::{from_vector, to_vector};
use crate::calibration::problem::{Problem, Stretch};
use crate::calibration::record::schedule::{AtRest, Step};
use crate::calibration::record::segment::{Segment, moves, segments};
use crate::navigation::{Navigator, State};

/// Spacing of the history, s …
const EPOCH: f64 = 1.0;
/// … and how many there are of a recording at most.
const EPOCHS: f64 = 3600.0;

/// A pass within a stretch.
pub struct OneStretch<'a> {
    problem: &'a Problem<'a>,
    stretch: &'a Stretch<'a>,
    number: usize,
    mode: Mode<'a>,
    navigator: Navigator<'a>,
    pub sums: Sums,
    gate: Memory,
    /// Of squared whitened innovations.
    limit: f64,
    /// The attitude that the dwell holds without a table, as it is computed when it begins.
    held: Matrix3<f64>,
}

/// Where a dwell begins, to go back to: after a turn the innovations' covariance is wide, and an
/// outlier that it lets in closes the gate to the good observations that follow.
struct Begin<'a> {
    navigator: Navigator<'a>,
    at: Linearisation,
    filter: Filter,
    innovations: usize,
    history: usize,
    cost: f64,
    log_determinant: f64,
}

/// Navigation through a stretch from this initial attitude on.
pub fn navigator<'a>(
    stretch: &Stretch<'a>,
    at: &Linearisation,
    initial: &Matrix3<f64>,
    (model, layout): (&Model, &Layout),
) -> Result<Navigator<'a>, CalibrationError> {
    let run = stretch.run;
    let tried = layout.tried_terms();
    let on = layout.terms().chain(tried).map(|(_, index)| index);
    let start = State::at_rest(*initial);
    let triads = at.in_recording(stretch.recording);
    let navigator = Navigator::new(&run.recording.imu, &run.site, &triads, start);
    let navigator = navigator.ok_or_else(|| singular(&triads))?;
    let navigator = navigator.with_terms(on.collect(), at.terms);
    Ok(match &model.thermal {
        Some(thermal) => navigator.with_thermal(thermal.clone(), at.thermal),
        None => navigator,
    })
}

impl<'a> OneStretch<'a> {
    pub fn new(
        problem: &'a Problem<'a>,
        stretch: &'a Stretch<'a>,
        number: usize,
        (mode, limit): (Mode<'a>, f64),
        sums: Sums,
    ) -> Result<Self, CalibrationError> {
        let initial = sums.at.initial_attitudes[number];
        let of = (&problem.model, &sums.filter.layout);
        let navigator = navigator(stretch, &sums.at, &initial, of)?;
        Ok(Self {
            problem,
            stretch,
            number,
            mode,
            navigator,
            sums,
            gate: Memory::default(),
            limit,
            held: initial,
        })
    }

    pub fn run(&mut self) -> Result<(), CalibrationError> {
        let steps: &'a [Step] = &self.stretch.steps;
        let mut next = 0;
        while let Some(step) = steps.get(next) {
            let imu = &self.stretch.run.recording.imu;
            if step.at_rest.is_some() {
                // The start holds what the first dwell says of table and position.
                next += self.dwell(&steps[next..], next > 0)?;
                continue;
            }
            let samples = step.samples.clone();
            for samples in moves(samples, &self.sums.filter.layout, imu) {
                let block = self.navigator.advance(samples);
                self.sums.filter.propagate(&block);
            }
            self.remember(imu.time(step.samples.end));
            next += 1;
        }
        Ok(())
    }

    /// The dwell that begins with the first of these steps; how many it has.
    fn dwell(&mut self, steps: &'a [Step], new_position: bool) -> Result<usize, CalibrationError> {
        let begin = self.begin();
        let mut done = 0;
        let held = matches!(self.mode, Mode::Held(_));
        let mut parts = segments(steps, held);
        while let Some(part) = parts.next() {
            if self.part(&part, done == 0, new_position)? {
                done += part.len();
            } else {
                self.go_back(&begin);
                (done, parts) = (0, segments(steps, held));
            }
        }
        let posterior = self.sums.filter.constants();
        self.sums.posteriors.after_dwell(posterior);
        Ok(done)
    }

    /// Keeps what is known at this time for the history.
    fn remember(&mut self, time: f64) {
        let last = self.sums.history.last();
        let apart = EPOCH.max(self.stretch.run.recording.imu.duration() / EPOCHS);
        if last.is_none_or(|last| (time - last.time).abs() >= apart) {
            let epoch = self.sums.epoch(time);
            self.sums.history.push(epoch);
        }
    }

    fn begin(&mut self) -> Begin<'a> {
        self.gate = Memory::of_dwell(self.sums.innovations.len());
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
            navigator: self.navigator.clone(),
            at: at.clone(),
            filter: filter.clone(),
            innovations: innovations.len(),
            history: history.len(),
            cost: *cost,
            log_determinant: *log_determinant,
        }
    }

    fn go_back(&mut self, begin: &Begin<'a>) {
        self.navigator = begin.navigator.clone();
        self.sums.at = begin.at.clone();
        self.sums.filter = begin.filter.clone();
        self.sums.innovations.truncate(begin.innovations);
        self.sums.history.truncate(begin.history);
        self.sums.cost = begin.cost;
        self.sums.log_determinant = begin.log_determinant;
        self.gate.again();
    }

    /// A part of a dwell; whether it was taken in.
    fn part(
        &mut self,
        steps: &[(&'a Step, &'a AtRest)],
        first: bool,
        new_position: bool,
    ) -> Result<bool, CalibrationError> {
        let (Some(&(begin, at_rest)), Some((end, _))) = (steps.first(), steps.last()) else {
            return Ok(true);
        };
        self.navigator.warm(&(begin.samples.start..end.samples.end));
        let (problem, stretch) = (self.problem, self.stretch);
        let filter = &mut self.sums.filter;
        let held = matches!(self.mode, Mode::Held(_));
        if held {
            let tied = at_rest.tied(&self.navigator.state, &self.navigator.triads().accel);
            if first {
                filter.come_to_rest(&self.navigator.state);
            }
            filter.refer(&self.navigator.state, &tied);
            self.navigator.state = tied;
        }
        if first {
            filter.begin_to_hold();
            self.held = self.navigator.state.attitude;
        }
        let navigator = &mut self.navigator;
        let of = (problem, stretch);
        let segment = Segment::navigate(navigator, of, steps, held, &self.held);
        if first && new_position {
            filter.redraw_table(problem.model.position_sigma);
            // Between positions the IMU moves by its distance from the table's centre, within one
            // not at all: one observation a dwell, however long it is.
            let variance = stretch.variance.position;
            filter.update(&Measurement::position(&segment.begin, variance));
        }
        let sums = &mut self.sums;
        let mut judge = Judge {
            stretch,
            model: &problem.model,
            mode: self.mode,
            limit: self.limit,
            dwell: sums.posteriors.dwells(),
            after_move: new_position,
            memory: &mut self.gate,
            innovations: &mut sums.innovations,
            cost: &mut sums.cost,
            log_determinant: &mut sums.log_determinant,
        };
        let time = segment.end();
        match sums.dwells.take_in(&mut sums.filter, &segment, &mut judge) {
            Taken::Whole => {}
            Taken::Abandoned => return Ok(false),
            Taken::Diverged => return Err(CalibrationError::Diverged { time }),
        }
        if !held {
            self.feed_back()?;
        }
        self.remember(time);
        Ok(true)
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
