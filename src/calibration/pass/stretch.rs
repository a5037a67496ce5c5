//! A pass within a stretch.

use super::gate::{Judge, Memory};
use super::mode::Mode;
use super::result::Sums;
use crate::attitude::exp;
use crate::calibration::error::CalibrationError;
use crate::calibration::filter::{Filter, Taken};
use crate::calibration::linearisation::{Linearisation, singular};
use crate::calibration::parameters::{from_vector, to_vector};
use crate::calibration::problem::{Problem, Stretch};
use crate::calibration::record::events::{Event, Events};

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
    events: Events<'a>,
    pub sums: Sums,
    gate: Memory,
    /// Of squared whitened innovations.
    limit: f64,
}

/// Where a dwell begins, to go back to: after a turn the innovations' covariance is wide, and an
/// outlier that it lets in closes the gate to the good observations that follow.
struct Begin<'a> {
    events: Events<'a>,
    at: Linearisation,
    filter: Filter,
    innovations: usize,
    history: usize,
    cost: f64,
    log_determinant: f64,
}

impl<'a> OneStretch<'a> {
    pub fn new(
        problem: &'a Problem<'a>,
        stretch: &'a Stretch<'a>,
        number: usize,
        (mode, limit): (Mode<'a>, f64),
        sums: Sums,
    ) -> Result<Self, CalibrationError> {
        let at = (&sums.at, &sums.at.initial_attitudes[number]);
        let held = matches!(mode, Mode::Held(_));
        Ok(Self {
            problem,
            stretch,
            number,
            mode,
            events: Events::new((problem, stretch), &sums.filter.layout, at, held)?,
            sums,
            gate: Memory::default(),
            limit,
        })
    }

    pub fn run(&mut self) -> Result<(), CalibrationError> {
        let mut begin = self.begin(self.events.clone());
        let mut again = false;
        loop {
            let before = self.events.clone();
            let Some(event) = self.events.next() else {
                return Ok(());
            };
            if let Event::Rest(rest) = &event
                && rest.first
                && !std::mem::take(&mut again)
            {
                begin = self.begin(before);
            }
            if !self.take_in(&event)? {
                self.go_back(&begin);
                again = true;
            }
        }
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

    fn begin(&mut self, events: Events<'a>) -> Begin<'a> {
        self.gate = Memory::of_dwell(self.sums.innovations.len());
        Begin {
            events,
            at: self.sums.at.clone(),
            filter: self.sums.filter.clone(),
            innovations: self.sums.innovations.len(),
            history: self.sums.history.len(),
            cost: self.sums.cost,
            log_determinant: self.sums.log_determinant,
        }
    }

    fn go_back(&mut self, begin: &Begin<'a>) {
        self.events = begin.events.clone();
        self.sums.at = begin.at.clone();
        self.sums.filter = begin.filter.clone();
        self.sums.innovations.truncate(begin.innovations);
        self.sums.history.truncate(begin.history);
        self.sums.cost = begin.cost;
        self.sums.log_determinant = begin.log_determinant;
        self.gate.again();
    }

    /// An event; whether it was taken in.
    fn take_in(&mut self, event: &Event) -> Result<bool, CalibrationError> {
        let (sums, model) = (&mut self.sums, &self.problem.model);
        let rest = match event {
            Event::Move(..) => None,
            Event::Rest(rest) => Some(rest),
        };
        let time = event.end();
        let mut judge = Judge {
            stretch: self.stretch,
            model,
            mode: self.mode,
            limit: self.limit,
            dwell: sums.dwells_done,
            after_move: rest.is_some_and(|rest| rest.new_position),
            memory: &mut self.gate,
            innovations: &mut sums.innovations,
            cost: &mut sums.cost,
            log_determinant: &mut sums.log_determinant,
        };
        let filter = (&mut sums.filter, &mut sums.dwells);
        match event.take_in(filter, (model, self.stretch), &mut judge) {
            Taken::Whole => {}
            Taken::Abandoned => return Ok(false),
            Taken::Diverged => return Err(CalibrationError::Diverged { time }),
        }
        if rest.is_some() && matches!(self.mode, Mode::Feedback) {
            self.feed_back()?;
        }
        self.remember(time);
        if rest.is_some_and(|rest| rest.last) {
            self.sums.dwells_done += 1;
        }
        Ok(true)
    }

    fn feed_back(&mut self) -> Result<(), CalibrationError> {
        let feedback = self.sums.filter.take_feedback();
        let state = &mut self.events.navigator.state;
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
        self.events.navigator.set_terms(at.terms);
        self.events
            .navigator
            .set_triads(&at.triads)
            .ok_or_else(|| singular(&at.triads))
    }
}
