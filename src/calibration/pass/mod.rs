//! One pass of the filter over all stretches: with feedback as it goes, or linearised at a given point.

mod filter;
mod gate;
mod initial_attitude;
mod local;
mod measurement;
mod mode;
mod posteriors;
mod result;
mod segment;
mod sensitivity;
mod stretch;

use super::auxiliary::auxiliary_vector;
use super::error::CalibrationError;
use super::linearisation::{AttitudePrior, Linearisation, Start};
use super::model::Model;
use super::parameters::{ParameterVector, to_vector};
use super::problem::{Problem, Stretch};
use crate::imu::TermVector;
pub(super) use filter::{Filter, Innovations, Observer, Taken, Verdict};
use initial_attitude::InitialAttitude;
pub(super) use measurement::{Measurement, ScalarInnovation};
pub(super) use mode::{Gate, Mode};
use posteriors::Posteriors;
pub use result::Epoch;
use result::Sums;
pub(super) use result::{PassResult, Tried};
pub(super) use segment::{Seen, Segment, moves, segments};
use stretch::OneStretch;
pub(super) use stretch::navigator;

/// A pass over all stretches of a problem, `priors` what is known of the initial attitude of each.
pub(super) fn pass(
    problem: &Problem,
    priors: &[AttitudePrior],
    at: &Linearisation,
    mode: Mode,
) -> Result<PassResult, CalibrationError> {
    pass_trying(problem, priors, at, mode, &[])
}

/// The same, and what auxiliary parameters that are no states would do to it.
pub(super) fn pass_trying(
    problem: &Problem,
    priors: &[AttitudePrior],
    at: &Linearisation,
    mode: Mode,
    tried: &[usize],
) -> Result<PassResult, CalibrationError> {
    let model = &problem.model;
    // The prior keeps its own mean, wherever the pass linearises; a pass with feedback begins at the
    // point it is given and finds its way from there.
    let (parameters, terms) = match mode {
        Mode::Feedback => (ParameterVector::zeros(), TermVector::zeros()),
        Mode::Held(_) => (model.prior_mean - to_vector(&at.triads), -at.terms),
    };
    let mut sums = Sums {
        at: at.clone(),
        filter: Filter::new(model, &parameters, &terms).trying(tried),
        innovations: Vec::new(),
        history: Vec::new(),
        posteriors: Posteriors::default(),
        cost: 0.0,
        log_determinant: 0.0,
    };
    let mut before = None;
    let mut attitudes = Vec::new();
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
        begin(&mut sums.filter, model, before, stretch, &start);
        if before.is_none() {
            sums.posteriors.begin(sums.filter.constants());
        }
        before = Some(stretch);
        let mut one = OneStretch::new(problem, stretch, number, mode, sums)?;
        one.run()?;
        sums = one.sums;
        if number + 1 < problem.stretches().len() {
            attitudes.push(InitialAttitude::of(&sums.filter, mode));
        }
    }
    let prior_sigma = auxiliary_vector(&model.geometry.vector(), &model.term_sigma);
    Ok(sums.result(prior_sigma, &attitudes))
}

/// A stretch begins after another: what is of another recording or site starts anew.
pub(super) fn begin(
    filter: &mut Filter,
    model: &Model,
    before: Option<&Stretch>,
    stretch: &Stretch,
    start: &Start,
) {
    let anew = before.is_none_or(|before| before.recording != stretch.recording);
    let moved = before.is_none_or(|before| before.run.site != stretch.run.site);
    let gravity = moved.then_some(stretch.run.site.gravity_sigma);
    filter.begin(start, model.position_sigma, anew, gravity);
}
