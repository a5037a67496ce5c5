//! The Bayesian Cramér–Rao bound of a run.

use crate::calibration::checks::error_term_test::{TermsOn, with_everything};
use crate::calibration::start::coarse::initial_attitudes;
use crate::calibration::{
    Auxiliary, CalibrationError, Epoch, ErrorTerm, Estimate, Gate, Linearisation, Observability,
    ParameterVector, PassResult, Prior, Problem, Script, pass,
};
use crate::imu::{PerSensor, TermVector, Triad};

/// The bound of a run: the smallest covariance that any estimator can reach.
#[derive(Debug, Clone)]
pub struct Bound {
    /// The truth, with the bound as its covariance.
    pub estimate: Estimate,
    /// Covariance of the parameters of error terms and table.
    pub auxiliary: Auxiliary,
    /// σ against time.
    pub history: Vec<Epoch>,
    /// Prior 1σ of the parameters.
    pub prior_sigma: ParameterVector,
    /// Which combinations of parameters the record determines.
    pub observability: Observability,
}

/// An error term that a bound does not include.
#[derive(Debug, Clone, PartialEq)]
pub struct TermLeftOff {
    /// The term.
    pub term: ErrorTerm,
    /// Largest remaining part of the prior σ of any combination of its parameters, if it were estimated with its usual
    /// σ: from 0 (known) to 1 (not observed).
    pub remaining: f64,
    /// 1σ of the change of each parameter if the term has its usual size.
    pub change: ParameterVector,
}

/// The covariance of a pass linearised at the truth, with `terms` the true error terms, in the installation
/// form of the truth: the inverse of the Bayesian information matrix for Gaussian noise (Van Trees, *Detection,
/// Estimation, and Modulation Theory*, part I, §2.4.3). The initial attitude is that of the first
/// reading or the coarse start: arc seconds of tilt and arc minutes of heading have no effect on the
/// covariance.
///
/// # Errors
/// [`CalibrationError`] as for [`super::estimate`].
pub fn bound(
    problem: &Problem,
    truth: &PerSensor<Triad>,
    terms: &TermVector,
) -> Result<Bound, CalibrationError> {
    let (bound, _) = bound_with_parts(problem, truth, terms, &[])?;
    Ok(bound)
}

/// The same, with the 1σ of the parameters without the rows between each of these increasing times in s and the next.
///
/// # Errors
/// [`CalibrationError`] as for [`super::estimate`].
pub fn bound_with_parts(
    problem: &Problem,
    truth: &PerSensor<Triad>,
    terms: &TermVector,
    times: &[f64],
) -> Result<(Bound, Vec<ParameterVector>), CalibrationError> {
    let problem = problem.with(|model| *model = model.in_form(problem.run(), truth.gyro.form));
    let at = Linearisation::new(*truth, *terms, Vec::new());
    let at_truth = pass_at(&problem, at)?;
    let prior = Prior::new(&at_truth.reduction.constants, &problem.model, &at_truth.at);
    let prior_sigma = problem.model.prior_sigma;
    let estimate = Estimate {
        triads: *truth,
        covariance: at_truth.posterior.parameter_covariance,
    };
    let (_, across) = at_truth.last_attitude();
    let without = at_truth.reduction.sigma_without(&prior, times);
    let bound = Bound {
        observability: Observability::new(&estimate, &prior_sigma, &across),
        prior_sigma,
        estimate,
        auxiliary: at_truth.auxiliary(&problem.model),
        history: at_truth.reduction.history(&prior, &at_truth.at),
    };
    Ok((bound, without))
}

/// The constant error terms that a problem does not estimate, at a truth as for [`bound`].
///
/// # Errors
/// [`CalibrationError`] as for [`super::estimate`].
pub fn terms_left_off(
    problem: &Problem,
    truth: &PerSensor<Triad>,
    terms: &TermVector,
) -> Result<Vec<TermLeftOff>, CalibrationError> {
    let problem = problem.with(|model| *model = model.in_form(problem.run(), truth.gyro.form));
    let at = Linearisation::new(*truth, *terms, Vec::new());
    let PassResult { at, reduction, .. } = pass_at(&with_everything(&problem), at)?;
    let terms_on = TermsOn::new(&problem, &at, reduction.folded());
    let off = ErrorTerm::constant().filter(|&term| !problem.model.has(term));
    let left_off = off.filter_map(|term| {
        Some(TermLeftOff {
            term,
            remaining: terms_on.remaining(term)?,
            change: terms_on.left_off(term)?.usual,
        })
    });
    Ok(left_off.collect())
}

/// A pass at the truth.
fn pass_at(problem: &Problem, truth: Linearisation) -> Result<PassResult, CalibrationError> {
    let attitudes = initial_attitudes(problem)?;
    let at = Linearisation {
        initial_attitudes: attitudes.iter().map(|attitude| attitude.mean).collect(),
        ..truth
    };
    pass(problem, &Script::new(problem, &attitudes, &at)?, Gate::Open)
}
