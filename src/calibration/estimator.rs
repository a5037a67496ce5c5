//! The estimator, described from top to bottom.

use crate::calibration::checks::prior_distance::widened;
use crate::calibration::iterations::solve;
use crate::calibration::magnetometer::with_magnetometer;
use crate::calibration::several::start;
use crate::calibration::{
    CalibrationError, Estimate, Linearisation, Outcome, ParameterMatrix, Problem, Progress, checks,
};

/// Estimates both triads from zero velocity in dwells and, if observed, the attitude of the table.
///
/// Each pass navigates once, linearised at the previous estimate, and then solves the chain of dwells with the most
/// likely sizes of all effects. One pass is a Gauss–Newton step on all data. Source: after Maybeck, *Stochastic Models,
/// Estimation and Control*, vol. 2, §9.7 (iterated, linearised filters).
///
/// # Errors
/// Returns [`CalibrationError`] if the runs cannot give a calibration. Without convergence, the result is an
/// [`Outcome`] with `converged = false` and a finding.
pub fn estimate(problem: &Problem, progress: Progress) -> Result<Outcome, CalibrationError> {
    let start = with_magnetometer(problem, start(problem)?)?;
    let wide = with_wide_prior(problem, &start.at);
    let solved = solve(&wide, (&start.at, &start.priors), progress)?;
    let mut outcome = Outcome::new((problem, &wide), start.alone, solved)?;
    outcome.findings = checks::findings(problem, &outcome);
    Ok(outcome)
}

/// Fraction of the prior σ to which the start determines a parameter.
const STARTED: f64 = 0.1;

/// The problem with a prior that its start does not contradict; the error of a wrong prior would become noise.
fn with_wide_prior<'a>(problem: &Problem<'a>, start: &Linearisation) -> Problem<'a> {
    let variances = (problem.model.prior_sigma * STARTED).map(|sigma| sigma.powi(2));
    let started = Estimate {
        triads: start.triads,
        covariance: ParameterMatrix::from_diagonal(&variances),
    };
    match widened(&problem.model, &started) {
        Some(model) => problem.with_model(model),
        None => problem.clone(),
    }
}
