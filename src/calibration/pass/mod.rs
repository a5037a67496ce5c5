//! One pass of the filter over all stretches: with feedback as it goes, or linearised at a given point.

mod earlier;
mod gate;
mod mode;
mod result;
mod stretch;

use super::error::CalibrationError;
use super::linearisation::{AttitudePrior, Linearisation, Start};
use super::model::Model;
use super::problem::{Problem, Stretch};
pub use crate::calibration::filter::measurement::ScalarInnovation;
pub use crate::calibration::filter::{
    DwellFilters, Filter, Innovations, ObservationJudge, PriorErrors, Since, Taken, Verdict,
};
pub use crate::calibration::record::segment::Seen;
use earlier::Earlier;
pub use mode::{Gate, Mode};
pub use result::PassResult;
use result::Sums;
pub use result::{Epoch, Own};
use stretch::OneStretch;

/// A pass over all stretches of a problem, `priors` what is known of the initial attitude of each.
pub fn pass(
    problem: &Problem,
    priors: &[AttitudePrior],
    at: &Linearisation,
    mode: Mode,
) -> Result<PassResult, CalibrationError> {
    let model = &problem.model;
    // The prior keeps its own mean, wherever the pass linearises; a pass with feedback begins at the
    // point it is given and finds its way from there.
    let errors = match mode {
        Mode::Feedback => PriorErrors::none(),
        Mode::Held(_) => PriorErrors::at(model, at),
    };
    let filter = Filter::new(model, &errors);
    let dwells = DwellFilters::of(&filter);
    let mut sums = Sums {
        at: at.clone(),
        filter,
        dwells,
        innovations: Vec::new(),
        history: Vec::new(),
        dwells_done: 0,
        cost: 0.0,
        log_determinant: 0.0,
        attitudes: Vec::new(),
        own: Vec::new(),
    };
    let limit = problem.gate_limit();
    let mut before = None;
    for (number, (stretch, prior)) in problem.stretches().iter().zip(priors).enumerate() {
        let known = match mode {
            // The given point is where it begins.
            Mode::Feedback => AttitudePrior {
                mean: at.initial_attitudes[number],
                ..*prior
            },
            Mode::Held(_) => *prior,
        };
        let start = stretch.start(&known, &at.initial_attitudes[number]);
        begin(&mut sums.filter, model, before, stretch, &start, at);
        before = Some(stretch);
        let mut one = OneStretch::new(problem, stretch, number, (mode, limit), sums)?;
        one.run()?;
        sums = one.sums;
        let (filter, next) = (&sums.filter, problem.stretches().get(number + 1));
        let initial = filter.layout.initial_attitude();
        let initial: Vec<usize> = (initial..initial + 3).collect();
        sums.attitudes.push(Earlier::of(filter, mode, &initial));
        let own: Vec<usize> = filter.layout.own().map(|(state, _)| state).collect();
        let ends = next.is_none_or(|next| next.recording != stretch.recording);
        if ends && !own.is_empty() {
            sums.own.push(Earlier::of(filter, mode, &own));
        }
    }
    Ok(sums.result(model))
}

/// A stretch begins after another: what is of another recording or site starts anew.
pub fn begin(
    filter: &mut Filter,
    model: &Model,
    before: Option<&Stretch>,
    stretch: &Stretch,
    start: &Start,
    at: &Linearisation,
) {
    let own = at.own(stretch.recording);
    let turned = (model.day_to_day.mounting > 0.0).then(|| own.response(&at.triads));
    let since = match before.filter(|before| before.recording == stretch.recording) {
        Some(before) => Since::Lost(before.time_until(stretch)),
        None => Since::Anew(&own, turned.as_ref()),
    };
    let moved = before.is_none_or(|before| before.run.site != stretch.run.site);
    let gravity = moved.then_some(stretch.run.site.gravity_sigma);
    filter.begin(start, model.position_sigma, since, gravity);
}
