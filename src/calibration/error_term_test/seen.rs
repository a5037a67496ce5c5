//! What error terms that the data show do to an estimate that does without them.

use super::super::error::CalibrationError;
use super::super::error_term::ErrorTerm;
use super::super::outcome::Outcome;
use super::super::parameters::{ParameterMatrix, to_vector};
use super::super::pass::PassResult;
use super::super::problem::Problem;
use super::joint::{Joint, once_more};
use super::{ErrorTermTest, Role};

/// What the covariance of an estimate lacks for the error terms that the data show and that are not
/// estimated; none where they show none.
///
/// With the terms the estimate would be `θ + Δ`, with the covariance `P + P_b`; so the mean square error of
/// `θ` is `P + P_b + Δ Δᵀ`. Explanations that cannot be told apart count as much as each is likely
/// (Hoeting, Madigan, Raftery, Volinsky 1999, "Bayesian model averaging: a tutorial", Statistical
/// Science 14(4)).
///
/// # Errors
/// [`CalibrationError`] where the problem is not the one of the outcome.
pub fn seen_and_left_off(
    problem: &Problem,
    outcome: &Outcome,
    tests: &[ErrorTermTest],
) -> Result<Option<ParameterMatrix>, CalibrationError> {
    let Some(likeliest) = tests.iter().find(|test| test.role == Role::Likeliest) else {
        return Ok(None);
    };
    let problem = &outcome.with_noise(problem);
    let joint = Joint::new(problem, outcome)?;
    let of = |role: Role| tests.iter().filter(move |test| test.role == role);
    let varying = ErrorTerm::GaussMarkovBias;
    let drifts = match tests.iter().find(|test| test.term == varying) {
        Some(test) if test.role != Role::None => {
            let mut model = problem.model.clone();
            model.switch_on(varying);
            let with = once_more(&problem.with_model(model), outcome, &[])?;
            Some(between(&with, &joint.own))
        }
        _ => None,
    };
    let effect = |terms: &[ErrorTerm]| {
        let of_drift = drifts.filter(|_| terms.contains(&varying));
        Some(joint.effect(terms)? + of_drift.unwrap_or_default())
    };
    let further: Vec<ErrorTerm> = of(Role::Further).map(|test| test.term).collect();
    let explanations = std::iter::once(likeliest).chain(of(Role::Alternative));
    let weighed = explanations.filter_map(|test| {
        let weight = (0.5 * (test.significance - likeliest.significance)).exp();
        let terms: Vec<ErrorTerm> = [test.term].into_iter().chain(further.clone()).collect();
        Some((weight, effect(&terms)? * weight))
    });
    let (weights, sum) = weighed.fold(
        (0.0, ParameterMatrix::zeros()),
        |(weights, sum), (weight, effect)| (weights + weight, sum + effect),
    );
    Ok((weights > 0.0).then(|| sum / weights))
}

/// Mean square of what a pass with more states finds, less the covariance of one without.
pub(super) fn between(with: &PassResult, without: &PassResult) -> ParameterMatrix {
    let change = to_vector(&with.estimate.triads) - to_vector(&without.estimate.triads);
    with.covariance - without.covariance + change * change.transpose()
}
