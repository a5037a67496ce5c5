//! The Bayesian Cramér–Rao bound of a run.

use nalgebra::DVector;

use crate::calibration::start::coarse::initial_attitudes;
use crate::calibration::{
    Auxiliary, CalibrationError, Epoch, Estimate, Gate, Linearisation, PARAMETERS, Prior, Problem,
    Script, pass,
};
use crate::imu::{PerSensor, TermVector, ThermalCoefficients, Triad};

/// What no estimator of a run can beat.
#[derive(Debug, Clone)]
pub struct Bound {
    /// The truth, with the covariance that is the bound.
    pub estimate: Estimate,
    /// Covariance of the parameters of error terms and table.
    pub auxiliary: Auxiliary,
    /// σ against time.
    pub history: Vec<Epoch>,
}

/// The covariance of a pass linearised at the truth, `terms` those of the instrument, in the truth's own
/// installation form, whatever that of the problem:
/// the inverse of the Bayesian information matrix for Gaussian noise (Van Trees, *Detection,
/// Estimation, and Modulation Theory*, part I, §2.4.3). The initial attitude is that of the first
/// reading or the coarse start: arc seconds of tilt and arc minutes of heading are nothing to the
/// covariance.
///
/// # Errors
/// [`CalibrationError`] as for [`super::estimate`].
pub fn bound(
    problem: &Problem,
    truth: &PerSensor<Triad>,
    terms: &TermVector,
) -> Result<Bound, CalibrationError> {
    let model = problem.model.in_form(problem.run(), truth.gyro.form);
    let problem = problem.with_model(model);
    let attitudes = initial_attitudes(&problem)?;
    let initial = attitudes.iter().map(|attitude| attitude.mean).collect();
    let at = Linearisation::new(*truth, *terms, initial);
    let result = pass(
        &problem,
        &Script::new(&problem, &attitudes, &at)?,
        Gate::Open,
    )?;
    let prior = Prior::new(&result.reduction.constants, &problem.model, &at);
    Ok(Bound {
        estimate: Estimate {
            triads: *truth,
            covariance: result.posterior.parameter_covariance,
        },
        auxiliary: result.auxiliary(&problem.model),
        history: result.reduction.history(&prior, &at),
    })
}

/// The variances that no estimator of recordings together can beat, at a truth with these coefficients of
/// temperature: of the parameters of both triads at the reference, then of the coefficients that the problem has on.
///
/// # Errors
/// [`CalibrationError`] as for [`super::estimate`].
pub fn thermal_bound(
    problem: &Problem,
    truth: &PerSensor<Triad>,
    coefficients: &PerSensor<ThermalCoefficients>,
) -> Result<DVector<f64>, CalibrationError> {
    let attitudes = initial_attitudes(problem)?;
    let initial = attitudes.iter().map(|attitude| attitude.mean).collect();
    let at = Linearisation {
        thermal: *coefficients,
        ..Linearisation::new(*truth, TermVector::zeros(), initial)
    };
    let result = pass(problem, &Script::new(problem, &attitudes, &at)?, Gate::Open)?;
    let of_coefficients = result.thermal(&problem.model);
    let of_coefficients = of_coefficients.map(|thermal| thermal.covariance.diagonal());
    let of_coefficients = of_coefficients.unwrap_or_else(|| DVector::zeros(0));
    let of_parameters = result.posterior.parameter_covariance.diagonal();
    Ok(DVector::from_fn(
        PARAMETERS + of_coefficients.len(),
        |k, _| match k.checked_sub(PARAMETERS) {
            None => of_parameters[k],
            Some(k) => of_coefficients[k],
        },
    ))
}
