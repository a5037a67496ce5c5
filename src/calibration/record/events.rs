//! What happens in a pass, event by event: navigation, which no noise changes.

use nalgebra::Matrix3;

use super::segment::{Segment, Segments, moves, segments};
use crate::calibration::error::CalibrationError;
use crate::calibration::filter::Filter;
use crate::calibration::filter::measurement::Measurement;
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
    /// Computed state at its begin; the segment's is where the pass linearises.
    from: State,
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
}

impl Rest {
    /// What a filter of this model does before it takes in what is observed.
    pub fn begin(&self, filter: &mut Filter, model: &Model, stretch: &Stretch) {
        if self.first {
            filter.come_to_rest(&self.from);
        }
        filter.refer(&self.from, &self.segment.begin);
        if self.first {
            filter.begin_dwell();
            filter.begin_to_hold();
        }
        if self.first && self.new_position && model.velocity_anew {
            filter.redraw_velocity(stretch.velocity_sigma());
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

/// What happens in a stretch of a problem, for a filter of this layout, linearised at this point, `initial` its attitude at
/// the stretch's first sample.
pub fn events(
    of: (&Problem, &Stretch),
    layout: &Layout,
    at: (&Linearisation, &Matrix3<f64>),
) -> Result<Vec<Event>, CalibrationError> {
    let (problem, stretch) = of;
    let imu = &stretch.run.recording.imu;
    let mut navigator = navigator(stretch, at, (&problem.model, layout))?;
    let mut events = Vec::new();
    let mut next = 0;
    while let Some(step) = stretch.steps.get(next) {
        if step.at_rest.is_some() {
            let parts = segments(&stretch.steps[next..]);
            // The start holds what the first dwell says of table and position.
            next += rests(&mut events, &mut navigator, of, parts, next > 0);
        } else {
            for samples in moves(step.samples.clone(), layout, imu) {
                let end = imu.time(samples.end);
                events.push(Event::Move(Box::new(navigator.advance(samples)), end));
            }
            next += 1;
        }
    }
    Ok(events)
}

/// Adds the parts of a dwell; how many steps it has.
fn rests(
    events: &mut Vec<Event>,
    navigator: &mut Navigator,
    of: (&Problem, &Stretch),
    mut parts: Segments,
    new_position: bool,
) -> usize {
    let mut steps = 0;
    let mut held = None;
    while let Some(part) = parts.next() {
        steps += part.len();
        let from = navigator.state;
        if let (Some((begin, at_rest)), Some((end, _))) = (part.first(), part.last()) {
            navigator.warm(&(begin.samples.start..end.samples.end));
            navigator.state = at_rest.tied(&from, &navigator.triads().accel);
        }
        let first = held.is_none();
        let attitude = *held.get_or_insert(navigator.state.attitude);
        let segment = Segment::navigate(navigator, of, &part, &attitude);
        let last = parts.is_done();
        events.push(Event::Rest(Box::new(Rest {
            first,
            last,
            new_position,
            from,
            segment,
        })));
        if last {
            break;
        }
    }
    steps
}

/// Navigation through a stretch from this initial attitude on.
fn navigator<'a>(
    stretch: &Stretch<'a>,
    (at, initial): (&Linearisation, &Matrix3<f64>),
    (model, layout): (&Model, &Layout),
) -> Result<Navigator<'a>, CalibrationError> {
    let run = stretch.run;
    let on = layout.terms();
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
