//! What happens in a pass with the linearisation held, whatever the noise: navigation, event by event.

use std::ops::Range;

use nalgebra::Matrix3;

use crate::calibration::error::CalibrationError;
use crate::calibration::layout::Layout;
use crate::calibration::linearisation::Linearisation;
use crate::calibration::model::Model;
use crate::calibration::pass::{
    Filter, Measurement, Segment, Segments, moves, navigator, segments,
};
use crate::calibration::problem::{Problem, Stretch};
use crate::navigation::{Block, Navigator, State};

pub enum Event {
    Move(Box<Block>),
    Rest(Box<Rest>),
}

/// A part of a dwell.
pub struct Rest {
    /// Whether it is the dwell's first.
    first: bool,
    new_position: bool,
    /// Computed state at its begin; where the pass linearises instead is the segment's.
    from: State,
    pub segment: Segment,
}

impl Rest {
    /// What a filter of this model does before it takes in what is observed.
    pub fn begin(&self, filter: &mut Filter, model: &Model, stretch: &Stretch) {
        if self.first {
            filter.come_to_rest(&self.from);
        }
        filter.refer(&self.from, &self.segment.begin);
        if self.first {
            filter.begin_to_hold();
        }
        if self.new_position {
            filter.redraw_table(model.position_sigma);
            let variance = stretch.variance.position;
            filter.update(&Measurement::position(&self.segment.begin, variance));
        }
    }
}

/// What happens in a stretch. A clone goes on from where this one is: what is needed twice need not be kept.
#[derive(Clone)]
pub struct Events<'a> {
    problem: &'a Problem<'a>,
    stretch: &'a Stretch<'a>,
    layout: Layout,
    navigator: Navigator<'a>,
    /// The first of the steps that have not begun.
    next: usize,
    within: Within<'a>,
}

#[derive(Clone)]
enum Within<'a> {
    /// What is left of a move.
    Move(Range<usize>),
    Dwell(Dwell<'a>),
}

/// What is left of a dwell.
#[derive(Clone)]
struct Dwell<'a> {
    parts: Segments<'a>,
    /// Computed attitude when the body came to rest; none before.
    held: Option<Matrix3<f64>>,
    /// Whether the body was elsewhere before.
    new_position: bool,
}

impl<'a> Events<'a> {
    /// Of a stretch of a problem, linearised at this point, `initial` its attitude at the stretch's first sample.
    pub fn new(
        problem: &'a Problem<'a>,
        stretch: &'a Stretch<'a>,
        at: &Linearisation,
        initial: &Matrix3<f64>,
    ) -> Result<Self, CalibrationError> {
        let layout = Layout::new(&problem.model);
        let navigator = navigator(stretch, at, initial, (&problem.model, &layout))?;
        Ok(Self {
            problem,
            stretch,
            layout,
            navigator,
            next: 0,
            within: Within::Move(0..0),
        })
    }

    fn moved(&mut self, samples: Range<usize>) -> Option<Event> {
        let imu = &self.stretch.run.recording.imu;
        let first = moves(samples.clone(), &self.layout, imu).next()?;
        self.within = Within::Move(first.end..samples.end);
        Some(Event::Move(Box::new(self.navigator.advance(first))))
    }

    fn rested(&mut self, mut dwell: Dwell<'a>) -> Option<Event> {
        let part = dwell.parts.next()?;
        self.next += part.len();
        let navigator = &mut self.navigator;
        let from = navigator.state;
        if let (Some((begin, at_rest)), Some((end, _))) = (part.first(), part.last()) {
            navigator.warm(&(begin.samples.start..end.samples.end));
            navigator.state = at_rest.tied(&from, &navigator.triads().accel);
        }
        let first = dwell.held.is_none();
        let held = *dwell.held.get_or_insert(navigator.state.attitude);
        let of = (self.problem, self.stretch);
        let rest = Rest {
            first,
            new_position: first && dwell.new_position,
            from,
            segment: Segment::navigate(navigator, of, &part, true, &held),
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
                    parts: segments(&self.stretch.steps[self.next..], true),
                    held: None,
                    new_position: self.next > 0,
                }),
            };
        }
    }
}
