//! The Bayesian Cramér–Rao bound of a run.

use super::auxiliary::Auxiliary;
use super::coarse::initial_attitudes;
use super::error::CalibrationError;
use super::estimate::Estimate;
use super::linearisation::Linearisation;
use super::pass::{Epoch, Gate, Mode, pass};
use super::problem::Problem;
use crate::imu::{PerSensor, TermVector, Triad};

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
    let result = pass(&problem, &attitudes, &at, Mode::Held(Gate::Open))?;
    Ok(Bound {
        estimate: Estimate {
            triads: *truth,
            covariance: result.covariance,
        },
        auxiliary: result.auxiliary,
        history: result.history,
    })
}
