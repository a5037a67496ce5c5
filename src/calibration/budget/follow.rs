//! A pass whose operations are kept, and its way back.

use super::super::error::CalibrationError;
use super::super::innovation::Observation;
use super::super::noise::{Event, Script};
use super::super::pass::{
    Driver, Effect, Filter, Followed, Innovations, Observer, Operation, Seen, Taken, Told, Verdict,
    begin,
};
use super::super::problem::{Problem, Stretch};
use super::source::BudgetSource;
use super::sums::Sums;
use crate::imu::Sensor;
use crate::navigation::Block;

/// A pass, and where it was before each part of it.
pub(super) struct Passed {
    filter: Filter,
    /// 1σ of every state before the first stretch.
    known: Vec<f64>,
    /// Of each stretch, what was done when it began, and its parts.
    stretches: Vec<(Vec<Operation>, Vec<Part>)>,
    /// What was done in the last part of all.
    last: Vec<Done>,
    /// Events of a part.
    at_once: usize,
}

/// Events that follow one another.
struct Part {
    /// The filter before them.
    filter: Filter,
    /// Observations of all events up to its begin.
    seen: usize,
}

/// What was done in an event: before a part of a dwell was taken in, and then.
struct Done {
    before: Vec<Operation>,
    then: Vec<Operation>,
    /// Observations of all events up to its begin.
    seen: usize,
}

/// Takes a filter through events, and counts observations on.
fn through(
    filter: &mut Filter,
    (problem, stretch): (&Problem, &Stretch),
    events: &[Event],
    accepted: &[bool],
    seen: &mut usize,
) -> Result<Vec<Done>, CalibrationError> {
    let of_event = |event: &Event| {
        let at = *seen;
        let before = match event {
            Event::Move(block) => {
                filter.propagate(block);
                Vec::new()
            }
            Event::Rest(rest) => {
                rest.begin(filter, &problem.model, stretch);
                let before = filter.kept();
                let mut decided = Decided::new((problem, stretch), accepted, at);
                if filter.stand(&rest.segment, &mut decided) != Taken::Whole {
                    let time = rest.segment.end();
                    return Err(CalibrationError::Diverged { time });
                }
                *seen = decided.next;
                before
            }
        };
        Ok(Done {
            before,
            then: filter.kept(),
            seen: at,
        })
    };
    events.iter().map(of_event).collect()
}

/// The pass of a script with the noise of a problem's model. What is done in so many events is had at once.
pub(super) fn forward(
    problem: &Problem,
    script: &Script,
    accepted: &[bool],
    at_once: usize,
) -> Result<Passed, CalibrationError> {
    let model = &problem.model;
    let mut filter = script.filter(model);
    let states = 0..filter.layout.size();
    let known = states.map(|state| filter.covariance(state, state).sqrt());
    let known = known.collect();
    filter.keep();
    let (mut stretches, mut last) = (Vec::new(), Vec::new());
    let (mut before, mut seen) = (None, 0);
    for (stretch, start, events) in script.stretches(problem) {
        begin(&mut filter, model, before, stretch, &start, script.at());
        before = Some(stretch);
        let begun = filter.kept();
        let mut parts = Vec::new();
        for events in events.chunks(at_once) {
            parts.push(Part {
                filter: filter.clone(),
                seen,
            });
            last = through(&mut filter, (problem, stretch), events, accepted, &mut seen)?;
        }
        stretches.push((begun, parts));
    }
    Ok(Passed {
        filter,
        known,
        stretches,
        last,
        at_once,
    })
}

impl Passed {
    /// Covariance of the estimate by source, followed back from its end.
    pub fn back(
        self,
        problem: &Problem,
        script: &Script,
        accepted: &[bool],
    ) -> Result<Sums, CalibrationError> {
        let filter = &self.filter;
        let drivers = Driver::ALL.into_iter();
        let drivers: Vec<(Driver, Filter)> = drivers
            .filter_map(|driver| Some((driver, filter.driven_by(driver)?)))
            .collect();
        let mut back = Back {
            filter,
            followed: Followed::of(filter),
            sums: Sums::default(),
        };
        let mut last = Some(self.last).filter(|done| !done.is_empty());
        let stretches: Vec<_> = script.stretches(problem).collect();
        for ((stretch, _, events), (begun, parts)) in stretches.iter().zip(self.stretches).rev() {
            let parts = events.chunks(self.at_once).zip(parts);
            let mut done_in = |events, part: Part| match last.take() {
                Some(done) => Ok(done),
                None => {
                    let Part {
                        mut filter,
                        mut seen,
                    } = part;
                    through(&mut filter, (problem, stretch), events, accepted, &mut seen)
                }
            };
            for (events, part) in parts.rev() {
                let done = done_in(events, part)?;
                for (event, done) in events.iter().zip(&done).rev() {
                    match event {
                        Event::Move(block) => {
                            back.through_move((problem, stretch), block, &drivers, &done.then)
                        }
                        Event::Rest(rest) => {
                            let (at_end, of_measured) = back.through_operations(&done.then);
                            let mut decided = Decided::new((problem, stretch), accepted, done.seen);
                            let effects = [at_end.as_slice(), of_measured.as_slice()];
                            let mut told = Within {
                                of: (problem, stretch),
                                sums: &mut back.sums,
                            };
                            let part = &rest.segment;
                            let taken = filter.back_through(
                                part,
                                &mut decided,
                                &drivers,
                                effects,
                                &mut told,
                            );
                            if taken != Taken::Whole {
                                let time = part.end();
                                return Err(CalibrationError::Diverged { time });
                            }
                        }
                    }
                    back.through(&done.before);
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

    fn through_move(
        &mut self,
        of: (&Problem, &Stretch),
        block: &Block,
        drivers: &[(Driver, Filter)],
        operations: &[Operation],
    ) {
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
                .back_through_noise(block, drivers, &effects, &mut told);
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
                _ => of_measured.extend(effects),
            }
        }
        of_measured.reverse();
        (at_end, of_measured)
    }
}

/// Adds what noise within a part of a dwell does.
struct Within<'a> {
    of: (&'a Problem<'a>, &'a Stretch<'a>),
    sums: &'a mut Sums,
}

impl Told for Within<'_> {
    fn observed(&mut self, seen: &Seen, effects: &[Effect; 3]) {
        let (problem, stretch) = self.of;
        let model = &problem.model;
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
    of: (&'a Problem<'a>, &'a Stretch<'a>),
    accepted: &'a [bool],
    next: usize,
}

impl<'a> Decided<'a> {
    fn new(of: (&'a Problem<'a>, &'a Stretch<'a>), accepted: &'a [bool], next: usize) -> Self {
        Self { of, accepted, next }
    }
}

impl Observer for Decided<'_> {
    fn variance(&self, seen: &Seen) -> f64 {
        let (problem, stretch) = self.of;
        stretch.observation_variance(&problem.model, seen.kind, seen.readings)
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
