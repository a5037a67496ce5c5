//! What error terms that the data show do to an estimate that does without them.

use super::super::error::CalibrationError;
use super::super::error_term::ErrorTerm;
use super::super::outcome::Outcome;
use super::super::parameters::{ParameterMatrix, to_vector};
use super::super::pass::PassResult;
use super::super::problem::Problem;
use super::joint::{Joint, once_more};
use super::{ErrorTermTest, Role};

/// What the covariance of an estimate lacks for error terms that are not estimated and that are likelier to be
/// there than none is; none where no term is.
///
/// With the terms the estimate would be `θ + Δ`, with the covariance `P + P_b`; so the mean square error of
/// `θ` is `P + P_b + Δ Δᵀ`. Explanations, and that there is none, count as much as each is likely (Hoeting,
/// Madigan, Raftery, Volinsky 1999, "Bayesian model averaging: a tutorial", Statistical Science 14(4)). Before the
/// data it is as likely that there is a term as that there is none, and one term as likely as another.
///
/// # Errors
/// [`CalibrationError`] where the problem is not the one of the outcome.
pub fn seen_and_left_off(
    problem: &Problem,
    outcome: &Outcome,
    tests: &[ErrorTermTest],
) -> Result<Option<ParameterMatrix>, CalibrationError> {
    let off = || tests.iter().filter(|test| !test.on);
    let none = (off().count() as f64).ln();
    let explanations: Vec<(&ErrorTermTest, f64)> = off()
        .map(|test| (test, ln_odds(test.significance)))
        .filter(|&(_, odds)| odds > none)
        .collect();
    let Some(best) = explanations.iter().map(|&(_, odds)| odds).reduce(f64::max) else {
        return Ok(None);
    };
    let problem = &outcome.with_noise(problem);
    let joint = Joint::new(problem, outcome)?;
    let further = tests.iter().filter(|test| test.role == Role::Further);
    let further: Vec<ErrorTerm> = further.map(|test| test.term).collect();
    let varying = ErrorTerm::GaussMarkovBias;
    let varies = explanations.iter().any(|(test, _)| test.term == varying);
    let drifts = match varies || further.contains(&varying) {
        true => {
            let mut model = problem.model.clone();
            model.switch_on(varying);
            let with = once_more(&problem.with_model(model), outcome, &[])?;
            Some(between(&with, &joint.own))
        }
        false => None,
    };
    let effect = |terms: &[ErrorTerm]| {
        let of_drift = drifts.filter(|_| terms.contains(&varying));
        Some(joint.effect(terms)? + of_drift.unwrap_or_default())
    };
    let weighed = explanations.iter().filter_map(|&(test, odds)| {
        let weight = (odds - best).exp();
        let terms: Vec<ErrorTerm> = [test.term].into_iter().chain(further.clone()).collect();
        Some((weight, effect(&terms)? * weight))
    });
    let (weights, sum) = weighed.fold(
        ((none - best).exp(), ParameterMatrix::zeros()),
        |(weights, sum), (weight, effect)| (weights + weight, sum + effect),
    );
    Ok(Some(sum / weights))
}

/// ln of how many times as likely the data are with a term as without, at most, where −2 ln of the chance of what
/// it explains is this.
///
/// Source: Sellke, Bayarri, Berger 2001, "Calibration of p values for testing precise null hypotheses", The
/// American Statistician 55(1), Eq. 3.
fn ln_odds(significance: f64) -> f64 {
    let surprise = 0.5 * significance;
    if surprise > 1.0 {
        surprise - 1.0 - surprise.ln()
    } else {
        0.0
    }
}

/// Mean square of what a pass with more states finds, less the covariance of one without.
pub(super) fn between(with: &PassResult, without: &PassResult) -> ParameterMatrix {
    let change = to_vector(&with.estimate.triads) - to_vector(&without.estimate.triads);
    with.covariance - without.covariance + change * change.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Lower bounds of the odds of none, Sellke, Bayarri, Berger 2001, table 1, to its digits.
    #[test]
    fn odds_are_those_of_the_tabulated_calibration_of_chances() {
        for (chance, of_none) in [(0.1f64, 0.63), (0.05, 0.41), (0.01, 0.13), (0.001, 0.0188)] {
            let odds = ln_odds(-2.0 * chance.ln()).exp();
            assert_relative_eq!(odds.recip(), of_none, max_relative = 0.04);
        }
        assert_relative_eq!(ln_odds(0.0), 0.0);
    }
}
