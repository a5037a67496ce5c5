//! Events of a pass: navigation, which does not depend on noise.

pub mod dwell;
pub mod schedule;
pub mod standstill;

use nalgebra::Matrix3;

use crate::calibration::linearisation::singular;
use crate::calibration::{CalibrationError, Layout, Linearisation, Model, Problem, Stretch};
use crate::navigation::{Block, Navigator, State};
pub use dwell::{Rest, between, part_of};
use dwell::{longest, samples_of};
use schedule::{cut, step_length};

/// A move or a piece of one, or a part of a dwell.
pub enum Event {
    Move(Box<Block>),
    Rest(Box<Rest>),
}

/// Events in a stretch of a problem, for a filter of this layout, linearised at this point; `initial` is the attitude
/// at the first sample.
pub fn events(
    of: (&Problem, &Stretch),
    layout: &Layout,
    at: (&Linearisation, &Matrix3<f64>),
) -> Result<Vec<Event>, CalibrationError> {
    let (problem, stretch) = of;
    let imu = &stretch.run.recording.imu;
    // Where biases vary a move is cut as dwells are.
    let varies = !layout.varying_biases.is_empty();
    let piece = varies.then(|| step_length(imu.period));
    let mut navigator = navigator(stretch, at, (&problem.model, layout))?;
    let mut events = Vec::new();
    let (mut next, mut most, mut new_position) = (0, 0, false);
    let mut held = *at.1;
    while let Some(step) = stretch.steps.get(next) {
        let Some(at_rest) = &step.at_rest else {
            let length = piece.unwrap_or(step.samples.len());
            let pieces = cut(step.samples.clone(), length);
            events.extend(pieces.map(|of| Event::Move(Box::new(navigator.advance(of)))));
            next += 1;
            continue;
        };
        if at_rest.first {
            // The start holds what the first dwell says of table and position.
            (most, new_position) = (longest(step), next > 0);
        }
        let count = part_of(&stretch.steps[next..], most);
        let part = &stretch.steps[next..next + count];
        next += count;
        let from = navigator.state;
        navigator.warm(&samples_of(part));
        navigator.state = at_rest.tied(&from, &navigator.triads().accel);
        if at_rest.first {
            held = navigator.state.attitude;
        }
        let following = stretch
            .steps
            .get(next)
            .and_then(|step| step.at_rest.as_ref());
        events.push(Event::Rest(Box::new(Rest {
            first: at_rest.first,
            last: following.is_none_or(|following| following.first),
            new_position,
            from,
            ..Rest::navigate(&mut navigator, of, part, &held)
        })));
    }
    Ok(events)
}

/// Navigator for a stretch, starting from this attitude.
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
