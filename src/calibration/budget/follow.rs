//! A pass whose operations are kept, and its way back.

use super::source::BudgetSource;
use super::sums::Sums;
use crate::calibration::checks::innovation::Observation;
use crate::calibration::error::CalibrationError;
use crate::calibration::linearisation::{AttitudePrior, Linearisation};
use crate::calibration::model::Model;
use crate::calibration::noise::{Event, Events};
use crate::calibration::pass::{
    Driver, Dwells, Effect, Filter, Followed, Innovations, Observer, Operation, PriorErrors, Seen,
    Taken, Told, Verdict, begin,
};
use crate::calibration::problem::{Problem, Stretch};
use crate::imu::Sensor;
use crate::navigation::Block;

/// A pass with the linearisation held.
#[derive(Clone, Copy)]
pub struct Held<'a> {
    pub problem: &'a Problem<'a>,
    /// What was known of the initial attitude of each stretch.
    pub priors: &'a [AttitudePrior],
    pub at: &'a Linearisation,
    /// Which observations are let in, in their order.
    pub accepted: &'a [bool],
}

/// A pass that was made, and where it was before each part of it.
pub struct Passed<'a> {
    held: Held<'a>,
    filter: Filter,
    dwells: Dwells,
    /// 1σ of every state before the first stretch.
    known: Vec<f64>,
    stretches: Vec<Whole<'a>>,
    /// What was done in the last part of all.
    last: Vec<Done>,
    /// Events of a part.
    at_once: usize,
}

/// A stretch.
struct Whole<'a> {
    stretch: &'a Stretch<'a>,
    /// What was done when it began.
    begun: Vec<Operation>,
    parts: Vec<Part<'a>>,
}

/// Events that follow one another.
struct Part<'a> {
    /// From the first of them on.
    events: Events<'a>,
    /// The filter before them.
    filter: Filter,
    /// Observations of all events up to its begin.
    seen: usize,
}

/// What was done in an event: before a part of a dwell was taken in, and then.
struct Done {
    event: Event,
    before: Vec<Operation>,
    then: Vec<Operation>,
    /// Observations of all events up to its begin.
    seen: usize,
}

impl<'a> Held<'a> {
    /// Makes the pass. What is done in so many events is had at once.
    pub fn forward(self, at_once: usize) -> Result<Passed<'a>, CalibrationError> {
        let (problem, at) = (self.problem, self.at);
        let model = &problem.model;
        let mut filter = Filter::new(model, &PriorErrors::at(model, at));
        let states = 0..filter.layout.size();
        let known = states.map(|state| filter.covariance(state, state).sqrt());
        let known = known.collect();
        filter.keep();
        let mut dwells = Dwells::of(&filter);
        let (mut stretches, mut last) = (Vec::new(), Vec::new());
        let (mut before, mut seen) = (None, 0);
        let initial = self.priors.iter().zip(&at.initial_attitudes);
        for (stretch, (prior, initial)) in problem.stretches().iter().zip(initial) {
            let start = stretch.start(prior, initial);
            begin(&mut filter, model, before, stretch, &start, at);
            before = Some(stretch);
            let begun = filter.kept();
            let mut events = Events::new(problem, stretch, at, initial)?;
            let mut parts = Vec::new();
            loop {
                let part = Part {
                    events: events.clone(),
                    filter: filter.clone(),
                    seen,
                };
                let next = events.by_ref().take(at_once);
                let done = self.through((&mut filter, &mut dwells), stretch, next, &mut seen)?;
                if done.is_empty() {
                    break;
                }
                last = done;
                parts.push(part);
            }
            stretches.push(Whole {
                stretch,
                begun,
                parts,
            });
        }
        Ok(Passed {
            held: self,
            filter,
            dwells,
            known,
            stretches,
            last,
            at_once,
        })
    }

    /// Takes a filter through events, and counts observations on.
    fn through(
        &self,
        (filter, dwells): (&mut Filter, &mut Dwells),
        stretch: &Stretch,
        events: impl Iterator<Item = Event>,
        seen: &mut usize,
    ) -> Result<Vec<Done>, CalibrationError> {
        let model = &self.problem.model;
        let of_event = |event: Event| {
            let at = *seen;
            let before = match &event {
                Event::Move(block) => {
                    filter.propagate(block);
                    Vec::new()
                }
                Event::Rest(rest) => {
                    rest.begin(filter, model, stretch);
                    let before = filter.kept();
                    let mut decided = Decided::new((model, stretch), self.accepted, at);
                    let taken = dwells.take_in(filter, &rest.segment, &mut decided);
                    if taken != Taken::Whole {
                        let time = rest.segment.end();
                        return Err(CalibrationError::Diverged { time });
                    }
                    *seen = decided.next;
                    before
                }
            };
            Ok(Done {
                event,
                before,
                then: filter.kept(),
                seen: at,
            })
        };
        events.map(of_event).collect()
    }
}

impl Passed<'_> {
    /// Covariance of the estimate by source, followed back from its end.
    pub fn back(self) -> Result<Sums, CalibrationError> {
        let filter = &self.filter;
        let drivers = Driver::ALL.into_iter();
        let drivers: Vec<(Driver, Filter)> = drivers
            .filter_map(|driver| Some((driver, filter.driven_by(driver)?)))
            .collect();
        let mut back = Back {
            filter,
            dwells: self.dwells,
            drivers: &drivers,
            followed: Followed::of(filter),
            sums: Sums::default(),
        };
        let held = self.held;
        let mut last = Some(self.last).filter(|done| !done.is_empty());
        for Whole {
            stretch,
            begun,
            parts,
        } in self.stretches.into_iter().rev()
        {
            let of = (&held.problem.model, stretch);
            for mut part in parts.into_iter().rev() {
                let done = match last.take() {
                    Some(done) => done,
                    None => {
                        let events = part.events.take(self.at_once);
                        let filter = (&mut part.filter, &mut back.dwells);
                        held.through(filter, stretch, events, &mut part.seen)?
                    }
                };
                for done in done.iter().rev() {
                    back.through_event(of, done, held.accepted)?;
                }
            }
            back.through(&begun);
        }
        for (state, sigma) in self.known.iter().enumerate() {
            let effect = back.followed.of_states[state].map(|x| x * sigma);
            let source = BudgetSource::of_state(&filter.layout, state);
            back.sums.add(source, &effect);
        }
        Ok(back.sums)
    }
}

/// The way back.
struct Back<'a> {
    filter: &'a Filter,
    dwells: Dwells,
    /// The filter with each kind of noise alone.
    drivers: &'a [(Driver, Filter)],
    followed: Followed,
    sums: Sums,
}

impl Back<'_> {
    /// Operations that stand for themselves; what is measured of the site's position is of its place.
    fn through(&mut self, operations: &[Operation]) {
        for operation in operations.iter().rev() {
            let source = match operation {
                Operation::Drawn { states, .. } => states.first(),
                Operation::Varied { state, .. } => Some(state),
                _ => None,
            };
            let source = source.map(|&state| BudgetSource::of_state(&self.filter.layout, state));
            let effects = self.followed.back(operation);
            if matches!(operation, Operation::Carried { .. }) {
                continue;
            }
            for effect in &effects {
                let source = source.unwrap_or(BudgetSource::Place);
                self.sums.add(source, effect);
            }
        }
    }

    fn through_event(
        &mut self,
        of: (&Model, &Stretch),
        done: &Done,
        accepted: &[bool],
    ) -> Result<(), CalibrationError> {
        match &done.event {
            Event::Move(block) => self.through_move(of, block, &done.then),
            Event::Rest(rest) => {
                let (at_end, of_measured) = self.through_operations(&done.then);
                let effects = [at_end.as_slice(), of_measured.as_slice()];
                let mut decided = Decided::new(of, accepted, done.seen);
                let mut told = Within {
                    of,
                    sums: &mut self.sums,
                };
                let part = &rest.segment;
                let with = (self.filter, self.drivers);
                let dwells = &mut self.dwells;
                let taken = dwells.back_through(with, part, &mut decided, effects, &mut told);
                if taken != Taken::Whole {
                    return Err(CalibrationError::Diverged { time: part.end() });
                }
            }
        }
        self.through(&done.before);
        Ok(())
    }

    fn through_move(&mut self, of: (&Model, &Stretch), block: &Block, operations: &[Operation]) {
        for operation in operations.iter().rev() {
            if !matches!(operation, Operation::Carried { .. }) {
                self.through(std::slice::from_ref(operation));
                continue;
            }
            let effects = self.followed.back(operation);
            let mut told = Within {
                of,
                sums: &mut self.sums,
            };
            self.filter
                .back_through_noise(block, self.drivers, &effects, &mut told);
        }
    }

    /// What took in a part of a dwell: what the states that it moved do at its end, and what noise of each
    /// scalar does that it measured.
    fn through_operations(&mut self, operations: &[Operation]) -> (Vec<Effect>, Vec<Effect>) {
        let (mut at_end, mut of_measured) = (Vec::new(), Vec::new());
        for operation in operations.iter().rev() {
            let effects = self.followed.back(operation);
            match operation {
                Operation::Carried { .. } => at_end = effects,
                _ => of_measured = effects,
            }
        }
        (at_end, of_measured)
    }
}

/// Adds what noise within a part of a dwell does.
struct Within<'a> {
    of: (&'a Model, &'a Stretch<'a>),
    sums: &'a mut Sums,
}

impl Told for Within<'_> {
    fn observed(&mut self, seen: &Seen, effects: &[Effect; 3]) {
        let (model, stretch) = self.of;
        let (pulses, source, own) = match seen.kind {
            Observation::Velocity => {
                let own = stretch.stillness(model, Sensor::Accel).powi(2);
                (stretch.variance.pulse, BudgetSource::VelocityAtRest, own)
            }
            Observation::Attitude => {
                let own = stretch.stillness(model, Sensor::Gyro).powi(2);
                (stretch.variance.attitude, BudgetSource::AttitudeAtRest, own)
            }
            Observation::Table => {
                let own = model.reading_sigma.powi(2) / seen.readings as f64;
                (stretch.variance.attitude, BudgetSource::TableReading, own)
            }
        };
        for (source, variance) in [(BudgetSource::Pulses, pulses), (source, own)] {
            if variance > 0.0 {
                let sigma = variance.sqrt();
                for effect in effects {
                    self.sums.add(source, &effect.map(|x| x * sigma));
                }
            }
        }
    }

    fn driven(&mut self, driver: Driver, effect: &Effect) {
        self.sums.add(BudgetSource::of_driver(driver), effect);
    }
}

/// Lets in what was decided before, from a first observation on.
struct Decided<'a> {
    of: (&'a Model, &'a Stretch<'a>),
    accepted: &'a [bool],
    next: usize,
}

impl<'a> Decided<'a> {
    fn new(of: (&'a Model, &'a Stretch<'a>), accepted: &'a [bool], next: usize) -> Self {
        Self { of, accepted, next }
    }
}

impl Observer for Decided<'_> {
    fn variance(&self, seen: &Seen) -> f64 {
        let (model, stretch) = self.of;
        stretch.observation_variance(model, seen.kind, seen.readings)
    }

    fn judge(&mut self, _: Innovations) -> Verdict {
        let accepted = self.accepted.get(self.next).copied().unwrap_or(true);
        self.next += 1;
        match accepted {
            true => Verdict::Accepted,
            false => Verdict::Rejected,
        }
    }
}
