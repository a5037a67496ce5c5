//! What happens in a pass, event by event: navigation, which no noise changes.

use std::ops::Range;

use nalgebra::Matrix3;

use super::segment::{Segment, Segments, moves, segments};
use crate::calibration::error::CalibrationError;
use crate::calibration::filter::measurement::Measurement;
use crate::calibration::filter::{DwellFilters, Filter, ObservationJudge, Taken};
use crate::calibration::layout::Layout;
use crate::calibration::linearisation::{Linearisation, singular};
use crate::calibration::model::Model;
use crate::calibration::problem::{Problem, Stretch};
use crate::navigation::{Block, Navigator, State};

/// A move, or a piece of one, or a part of a dwell.
pub enum Event {
    /// Its block and when it ends, s.
    Move(Box<Block>, f64),
    Rest(Box<Rest>),
}

/// A part of a dwell.
pub struct Rest {
    /// Whether it is the dwell's first and its last.
    pub first: bool,
    pub last: bool,
    /// Whether the body was elsewhere before.
    pub new_position: bool,
    /// Computed state at its begin where the pass linearises at another one, the segment's.
    from: Option<State>,
    pub segment: Segment,
}

impl Event {
    /// When it ends, s.
    pub fn end(&self) -> f64 {
        match self {
            Self::Move(_, end) => *end,
            Self::Rest(rest) => rest.segment.end(),
        }
    }

    /// Takes a filter of this model through it.
    pub fn take_in(
        &self,
        (filter, dwells): (&mut Filter, &mut DwellFilters),
        (model, stretch): (&Model, &Stretch),
        observer: &mut impl ObservationJudge,
    ) -> Taken {
        match self {
            Self::Move(block, _) => {
                filter.propagate(block);
                Taken::Whole
            }
            Self::Rest(rest) => {
                rest.begin(filter, model, stretch);
                dwells.take_in(filter, &rest.segment, observer)
            }
        }
    }
}

impl Rest {
    /// What a filter does before it takes in what is observed.
    fn begin(&self, filter: &mut Filter, model: &Model, stretch: &Stretch) {
        if let Some(from) = &self.from {
            if self.first {
                filter.come_to_rest(from);
            }
            filter.refer(from, &self.segment.begin);
        }
        if self.first {
            filter.begin_to_hold();
        }
        if self.first && self.new_position {
            filter.redraw_table(model.position_sigma);
            // Between positions the IMU moves by its distance from the table's centre, within one
            // not at all: one observation a dwell, however long it is.
            let variance = stretch.position_variance(model);
            filter.update(&Measurement::position(&self.segment.begin, variance));
        }
    }
}

/// What happens in a stretch. A clone goes its own way from where this one is, so nothing needed twice has to be kept.
#[derive(Clone)]
pub struct Events<'a> {
    problem: &'a Problem<'a>,
    stretch: &'a Stretch<'a>,
    layout: Layout,
    /// Whether the linearisation is held: dwells are tied to their mean attitude, and nothing is fed back.
    held: bool,
    pub navigator: Navigator<'a>,
    /// The first of the steps that have not begun.
    next: usize,
    within: Within<'a>,
}

#[derive(Clone)]
enum Within<'a> {
    /// The remainder of a move.
    Move(Range<usize>),
    Dwell(Dwell<'a>),
}

/// The remainder of a dwell.
#[derive(Clone)]
struct Dwell<'a> {
    parts: Segments<'a>,
    /// Computed attitude when the body came to rest; none before.
    attitude: Option<Matrix3<f64>>,
    new_position: bool,
}

impl<'a> Events<'a> {
    /// Of a stretch of a problem, for a filter of this layout, linearised at this point, `initial` its attitude at the
    /// stretch's first sample.
    pub fn new(
        (problem, stretch): (&'a Problem<'a>, &'a Stretch<'a>),
        layout: &Layout,
        (at, initial): (&Linearisation, &Matrix3<f64>),
        held: bool,
    ) -> Result<Self, CalibrationError> {
        Ok(Self {
            problem,
            stretch,
            navigator: navigator(stretch, at, initial, (&problem.model, layout))?,
            layout: layout.clone(),
            held,
            next: 0,
            within: Within::Move(0..0),
        })
    }

    fn moved(&mut self, samples: Range<usize>) -> Option<Event> {
        let imu = &self.stretch.run.recording.imu;
        let first = moves(samples.clone(), &self.layout, imu).next()?;
        self.within = Within::Move(first.end..samples.end);
        let end = imu.time(first.end);
        Some(Event::Move(Box::new(self.navigator.advance(first)), end))
    }

    fn rested(&mut self, mut dwell: Dwell<'a>) -> Option<Event> {
        let part = dwell.parts.next()?;
        self.next += part.len();
        let navigator = &mut self.navigator;
        let computed = navigator.state;
        if let (Some((begin, at_rest)), Some((end, _))) = (part.first(), part.last()) {
            navigator.warm(&(begin.samples.start..end.samples.end));
            if self.held {
                navigator.state = at_rest.tied(&computed, &navigator.triads().accel);
            }
        }
        let first = dwell.attitude.is_none();
        let attitude = *dwell.attitude.get_or_insert(navigator.state.attitude);
        let of = (self.problem, self.stretch);
        let rest = Rest {
            first,
            last: dwell.parts.is_done(),
            new_position: dwell.new_position,
            from: self.held.then_some(computed),
            segment: Segment::navigate(navigator, of, &part, self.held, &attitude),
        };
        self.within = Within::Dwell(dwell);
        Some(Event::Rest(Box::new(rest)))
    }
}

impl Iterator for Events<'_> {
    type Item = Event;

    fn next(&mut self) -> Option<Event> {
        loop {
            let event = match std::mem::replace(&mut self.within, Within::Move(0..0)) {
                Within::Move(samples) => self.moved(samples),
                Within::Dwell(dwell) => self.rested(dwell),
            };
            if event.is_some() {
                return event;
            }
            let step = self.stretch.steps.get(self.next)?;
            self.within = match step.at_rest {
                None => {
                    self.next += 1;
                    Within::Move(step.samples.clone())
                }
                Some(_) => Within::Dwell(Dwell {
                    parts: segments(&self.stretch.steps[self.next..], self.held),
                    attitude: None,
                    // The start holds what the first dwell says of table and position.
                    new_position: self.next > 0,
                }),
            };
        }
    }
}

/// Navigation through a stretch from this initial attitude on.
fn navigator<'a>(
    stretch: &Stretch<'a>,
    at: &Linearisation,
    initial: &Matrix3<f64>,
    (model, layout): (&Model, &Layout),
) -> Result<Navigator<'a>, CalibrationError> {
    let run = stretch.run;
    let on = layout.terms_on();
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
