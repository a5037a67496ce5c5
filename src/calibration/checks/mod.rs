//! Checks of model, noise and recording against the data: each file contains one check with its messages.

pub mod event;
pub mod finding;
pub mod form;
pub mod innovation;
pub mod labels;
pub mod latitude;
pub mod observability;
pub mod prior_distance;
pub mod quality;
pub mod recordings;
pub mod residuals;
pub mod rest_scatter;
pub mod rounding;
pub mod settling;
pub mod term;
pub mod unexplained;

use crate::calibration::{Outcome, Problem};
use event::Event;
use finding::Finding;
use term::TermEvidence;

/// Findings of all checks of a filter outcome; causes come before their possible consequences. `problem` is the problem
/// as stated.
pub fn findings(problem: &Problem, outcome: &Outcome) -> Vec<Finding> {
    let (estimate, innovations) = (&outcome.estimate, &outcome.innovations);
    let rounding = rounding::by_rounding(problem, &estimate.triads);
    let form = outcome
        .form_test
        .and_then(|test| test.finding(estimate.form()));
    // Angles missing from the form are one of the causes that can be found.
    let unexplained = match form {
        Some(_) => None,
        None => unexplained::unexplained(&outcome.consistency.all, innovations),
    };
    let remarks = problem.remarks().into_iter();
    remarks
        .chain(unexplained::not_converged(outcome))
        .chain(unexplained::absurd(problem, outcome))
        .chain(latitude::earth_rate(problem, outcome))
        .chain(outcome.events.iter().map(Event::finding))
        .chain(settling::settles(problem, outcome))
        .chain(TermEvidence::findings(&outcome.terms))
        .chain(outcome.noise.finding(problem))
        .chain(rest_scatter::scatter_at_rest(problem, &estimate.triads))
        .chain(rounding::rounded(problem, &rounding, &estimate.covariance))
        .chain(prior_distance::far_from_prior(&problem.model, estimate))
        .chain(observability::not_observed_by_path(outcome))
        .chain(form)
        .chain(unexplained)
        .chain(innovation::inconsistent(
            innovations,
            &problem.with_pulses(),
        ))
        .chain(recordings::recordings_differ(&outcome.differences))
        .collect()
}
