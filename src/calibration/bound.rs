//! The Bayesian Cramér–Rao bound of a run.

use crate::calibration::magnetometer::with_magnetometer;
use crate::calibration::outcome::{auxiliary_of, last_attitude};
use crate::calibration::several::Start;
use crate::calibration::sizes::Effects;
use crate::calibration::start::coarse::initial_attitudes;
use crate::calibration::{
    Auxiliary, CalibrationError, Epoch, ErrorTerm, Estimate, Linearisation, MagneticEstimate,
    Observability, ParameterVector, Problem, Script,
};
use crate::imu::{PerSensor, TermVector, Triad};

/// The bound of a run: the smallest covariance that any estimator can reach.
#[derive(Debug, Clone)]
pub struct Bound {
    /// The truth, with the bound as its covariance.
    pub estimate: Estimate,
    /// Covariance of the parameters of the error terms and of the table errors.
    pub auxiliary: Auxiliary,
    /// σ against time.
    pub history: Vec<Epoch>,
    /// Prior 1σ of the parameters.
    pub prior_sigma: ParameterVector,
    /// Combinations of parameters that the recording determines.
    pub observability: Observability,
    /// The magnetometer, linearised at its start, with the bound as its covariance.
    pub magnetic: Option<MagneticEstimate>,
}

/// An error term that a bound does not include.
#[derive(Debug, Clone, PartialEq)]
pub struct TermLeftOff {
    /// The term.
    pub term: ErrorTerm,
    /// If the term were estimated with its typical σ: the remaining fraction of its prior σ, from 0 (known) to 1 (not
    /// observed). The value applies to the combination of parameters of the term for which the fraction is largest.
    pub remaining: f64,
    /// 1σ of the change of each parameter caused by the term, if the term has its typical magnitude.
    pub change: ParameterVector,
}

/// The covariance of a chain that is linearised at the truth, with the stated noise and error terms of the problem and
/// the true `terms`, in the misalignment form of the truth. It is the inverse of the Bayesian information matrix for
/// Gaussian noise (Van Trees, *Detection, Estimation, and Modulation Theory*, part I, §2.4.3). The initial attitude is
/// taken from the first reading or the coarse start, because arc seconds of tilt and arc minutes of heading have no
/// effect on the covariance.
///
/// # Errors
/// Returns [`CalibrationError`] under the same conditions as [`super::estimate`].
pub fn bound(
    problem: &Problem,
    truth: &PerSensor<Triad>,
    terms: &TermVector,
) -> Result<Bound, CalibrationError> {
    let (bound, _) = bound_without_moves(problem, truth, terms)?;
    Ok(bound)
}

/// The bound, and the 1σ of the parameters without each move in turn.
///
/// # Errors
/// Returns [`CalibrationError`] under the same conditions as [`super::estimate`].
pub fn bound_without_moves(
    problem: &Problem,
    truth: &PerSensor<Triad>,
    terms: &TermVector,
) -> Result<(Bound, Vec<ParameterVector>), CalibrationError> {
    let problem = at_truth(problem, truth).with(|model| {
        model.may_have.clear();
        model.may_be_elsewhere = false;
    });
    let script = script(&problem, Linearisation::new(*truth, *terms, Vec::new()))?;
    let effects = Effects::new(&problem);
    let chain = effects.chain(&problem, &script)?;
    let weighed = effects.weighed(&chain, &problem, &script)?;
    let (filtered, posterior) = (&weighed.filtered, &weighed.posterior);
    let prior_sigma = problem.model.prior_sigma;
    let estimate = Estimate {
        triads: *truth,
        covariance: posterior.parameter_covariance,
    };
    let (_, across) = last_attitude(&weighed, &script.priors);
    let sites = effects.candidates.sites(&weighed.prior);
    let beside = (&weighed.prior, &sites);
    let (_, history) = filtered.innovations((&problem, &script), beside, &effects.dispersion)?;
    let bound = Bound {
        observability: Observability::new(&estimate, &prior_sigma, &across),
        auxiliary: auxiliary_of(posterior, &script.at, &problem.model, |_| true),
        magnetic: MagneticEstimate::new(posterior, &script.at, &problem.model),
        prior_sigma,
        estimate,
        history,
    };
    Ok((bound, filtered.without_moves(posterior)))
}

/// The constant error terms that a problem does not estimate, linearised at a truth as in [`bound`].
///
/// # Errors
/// Returns [`CalibrationError`] under the same conditions as [`super::estimate`].
pub fn terms_left_off(
    problem: &Problem,
    truth: &PerSensor<Triad>,
    terms: &TermVector,
) -> Result<Vec<TermLeftOff>, CalibrationError> {
    let problem = at_truth(problem, truth).with(|model| {
        let off = ErrorTerm::constant().filter(|&term| !model.has(term) && model.can_have(term));
        model.may_have = off.collect();
        model.may_be_elsewhere = false;
    });
    let script = script(&problem, Linearisation::new(*truth, *terms, Vec::new()))?;
    let effects = Effects::new(&problem);
    let chain = effects.chain(&problem, &script)?;
    let weighed = effects.weighed(&chain, &problem, &script)?;
    let first = weighed.prior.constants.len() - weighed.prior.candidates;
    let candidates = &weighed.prior.constants[first..];
    let left_off = problem.model.may_have.iter().filter_map(|&term| {
        let places = candidates.iter().enumerate();
        let places = places.filter(|(_, of)| of.error_term() == Some(term));
        let places: Vec<usize> = places.map(|(place, _)| place).collect();
        let (change, remaining) = weighed.known.effect_of(&places)?;
        Some(TermLeftOff {
            term,
            remaining,
            change,
        })
    });
    Ok(left_off.collect())
}

/// The problem in the misalignment form of a truth, with stated noise.
pub(super) fn at_truth<'a>(problem: &Problem<'a>, truth: &PerSensor<Triad>) -> Problem<'a> {
    problem.with(|model| *model = model.in_form(problem.run(), truth.gyro.form))
}

/// Events, linearised at a truth.
fn script(problem: &Problem, truth: Linearisation) -> Result<Script, CalibrationError> {
    let attitudes = initial_attitudes(problem)?;
    let at = Linearisation {
        initial_attitudes: attitudes.iter().map(|attitude| attitude.mean).collect(),
        ..truth
    };
    let start = Start {
        at,
        priors: attitudes,
        alone: Vec::new(),
    };
    let Start { at, priors, .. } = with_magnetometer(problem, start)?;
    Script::new(problem, &priors, &at)
}
