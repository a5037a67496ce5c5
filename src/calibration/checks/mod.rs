//! Checks of model, noise and record by the data: each file is a check with its messages.

pub mod cause;
pub mod dwell_scatter;
pub mod error_term_test;
pub mod finding;
pub mod form;
pub mod innovation;
pub mod labels;
pub mod observability;
pub mod prior_distance;
pub mod quality;
pub mod recordings;
pub mod residuals;
pub mod rest_scatter;
pub mod rounding;
pub mod unexplained;

use crate::calibration::{BudgetSource, Outcome, Problem};
use cause::{FoundCause, settling};
use error_term_test::{ErrorTermTest, biases_may_vary};
use finding::Finding;

/// Findings of all checks of a filter's outcome, and earlier findings; causes before their possible consequences.
/// `problem` is the problem as stated.
pub fn findings(problem: &Problem, outcome: &Outcome, others: Vec<Finding>) -> Vec<Finding> {
    let (estimate, innovations) = (&outcome.estimate, &outcome.innovations);
    let rounding = outcome.part(BudgetSource::Rounding);
    let form = outcome
        .form_test
        .and_then(|test| test.finding(estimate.form()));
    let widened = outcome
        .covariance_parts
        .contains_key(&BudgetSource::DwellScatter);
    let scattered = outcome.dwell_scatter.filter(|_| widened);
    let scattered = scattered.map(|of| of.finding(outcome.growth_by(BudgetSource::DwellScatter)));
    // Angles that the form lacks are a cause that is found.
    let unexplained = match form {
        Some(_) => None,
        None => unexplained::unexplained(&outcome.consistency.all, innovations),
    };
    let remarks = problem.remarks().into_iter();
    remarks
        .chain(unexplained::not_converged(outcome))
        .chain(outcome.causes.iter().map(FoundCause::finding))
        .chain(settling::finding(problem, outcome.settling))
        .chain(outcome.noise.finding(problem))
        .chain(rest_scatter::scatter_at_rest(problem, &estimate.triads))
        .chain(rounding::rounded(problem, &rounding, &estimate.covariance))
        .chain(prior_distance::far_from_prior(&problem.model, estimate))
        .chain(observability::not_observed_by_path(outcome))
        .chain(form)
        .chain(innovation::outliers(innovations))
        .chain(unexplained)
        .chain(innovation::inconsistent(innovations))
        .chain(others)
        .chain(scattered)
        .collect()
}

impl Outcome {
    /// The outcome's findings with those on error terms, and on their addition to the covariance.
    pub fn findings_with(&self, tests: &[ErrorTermTest]) -> Vec<Finding> {
        let [variation, left_off] = [
            BudgetSource::UnseenVariation,
            BudgetSource::ErrorTermsLeftOff,
        ]
        .map(|of| self.growth_by(of));
        let findings = self.findings.iter().cloned();
        findings
            .chain(biases_may_vary(variation))
            .chain(ErrorTermTest::most_significant(tests, Some(left_off)))
            .collect()
    }
}
