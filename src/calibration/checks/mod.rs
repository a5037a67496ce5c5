//! Checks of model, noise and recording against the data: each file contains one check with its messages.

pub mod event;
pub mod finding;
pub mod form;
pub mod innovation;
pub mod labels;
pub mod latitude;
pub mod magnetic;
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

use crate::calibration::{Level, Outcome, Problem};
use event::Event;
use finding::Finding;
use term::TermEvidence;

/// Findings of all checks of a filter outcome; causes come before their possible consequences. `problem` is the problem
/// as it was stated.
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
    let of_noise = rest_scatter::scatter_at_rest(problem, &estimate.triads);
    // If the stated noise is too small, noise appears as events, terms and innovations.
    let by_noise = of_noise.iter().any(|finding| finding.level() > Level::Note);
    let far = prior_distance::far_from_prior(&problem.model, estimate);
    let not_observed = observability::not_observed_by_path(outcome, far.as_ref());
    let of_fit = outcome.events.iter().map(Event::finding);
    let of_fit = of_fit
        .chain(settling::settles(problem, outcome))
        .chain(TermEvidence::findings(&outcome.terms))
        .filter(|_| !by_noise);
    let inconsistent = innovation::inconsistent(innovations, &problem.with_pulses());
    let remarks = problem.remarks().into_iter();
    remarks
        .chain(unexplained::not_converged(outcome))
        .chain(unexplained::absurd(problem, outcome))
        .chain(latitude::earth_rate(problem, outcome))
        .chain(magnetic::magnetic(problem, outcome))
        .chain(far)
        .chain(form)
        .chain(of_noise)
        .chain(of_fit)
        .chain(outcome.noise.finding(problem))
        .chain(rounding::rounded(problem, &rounding, &estimate.covariance))
        .chain(not_observed)
        .chain(unexplained)
        .chain(inconsistent.filter(|_| !by_noise))
        .chain(recordings::recordings_differ(&outcome.differences))
        .collect()
}
