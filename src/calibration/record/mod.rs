//! Events of a recording, found by navigation; they do not depend on the noise.

pub mod dwell;
pub mod schedule;
pub mod script;
pub mod standstill;

use nalgebra::Matrix3;

use crate::calibration::linearisation::singular;
use crate::calibration::{CalibrationError, Constant, Linearisation, Model, Problem, Stretch};
use crate::navigation::{Block, Navigator, State};
pub use dwell::{Rest, between, part_of};
use dwell::{longest, samples_of};
pub use script::Script;

/// A move, or a part of a dwell.
#[derive(Debug)]
pub enum Event {
    Move(Box<Block>),
    Rest(Box<Rest>),
}

/// Events in a stretch of a problem, linearised at this point. The arguments include the attitude at the first sample
/// and the number of the first dwell of the stretch.
pub fn events(
    of: (&Problem, &Stretch),
    (at, initial, first_dwell): (&Linearisation, &Matrix3<f64>, usize),
) -> Result<Vec<Event>, CalibrationError> {
    let (problem, stretch) = of;
    let mut navigator = navigator(stretch, (at, initial), &problem.model)?;
    let mut events = Vec::new();
    let (mut next, mut most, mut new_position) = (0, 0, false);
    let (mut held, mut dwells) = (*initial, first_dwell);
    while let Some(step) = stretch.steps.get(next) {
        let Some(at_rest) = &step.at_rest else {
            let block = navigator.advance(step.samples.clone());
            events.push(Event::Move(Box::new(block)));
            next += 1;
            continue;
        };
        if at_rest.first {
            // The initial state already contains what the first dwell shows of table and position.
            (most, new_position) = (longest(step), next > 0);
            dwells += 1;
        }
        let count = part_of(&stretch.steps[next..], most);
        let part = &stretch.steps[next..next + count];
        next += count;
        let from = navigator.state;
        navigator.warm(&samples_of(part));
        let known = at.dwells.get(dwells - 1);
        navigator.state = at_rest.tied(&from, &navigator.triads().accel, known);
        if at_rest.first {
            held = navigator.state.attitude;
        }
        events.push(Event::Rest(Box::new(Rest {
            first: at_rest.first,
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
    model: &Model,
) -> Result<Navigator<'a>, CalibrationError> {
    let run = stretch.run;
    let constants = Constant::all(model, false).into_iter();
    let on = constants.filter_map(|constant| match constant {
        Constant::Term(index) => Some(index),
        _ => None,
    });
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
