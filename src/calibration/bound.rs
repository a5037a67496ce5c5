//! The Bayesian Cramér–Rao bound of a run.

use super::coarse::{AttitudePrior, coarse_start};
use super::error::CalibrationError;
use super::further::Further;
use super::linearisation::Linearisation;
use super::outcome::{Estimate, Moment};
use super::pass::{Gate, Mode, pass};
use super::problem::Problem;
use super::schedule::{Schedule, first_reading};
use super::standstill::velocity_sigma;
use crate::imu::{FurtherVector, PerSensor, Triad};
use crate::run::Run;

/// What no estimator of a run can beat.
#[derive(Debug, Clone)]
pub struct Bound {
    /// The truth, with the covariance that is the bound.
    pub estimate: Estimate,
    /// Covariance of the constants beside the parameters.
    pub further: Further,
    /// σ against time.
    pub history: Vec<Moment>,
}

/// The covariance of a held pass linearised at the truth, `terms` those of the instrument, in the truth's own installation form:
/// the inverse of the Bayesian information matrix for Gaussian noise (Van Trees, *Detection,
/// Estimation, and Modulation Theory*, part I, §2.4.3). The initial attitude is that of the first
/// reading or the coarse start: arc seconds of tilt and arc minutes of heading are nothing to the
/// covariance.
///
/// # Errors
/// [`CalibrationError`] as for [`super::estimate`].
pub fn bound(
    run: &Run,
    truth: &PerSensor<Triad>,
    terms: &FurtherVector,
) -> Result<Bound, CalibrationError> {
    let dwells = run.dwells();
    let schedule = Schedule::new(run, &dwells)?;
    let form = truth.gyro.form;
    let attitude = match (&run.table, first_reading(run, &dwells)) {
        (Some(table), Some(reading)) => AttitudePrior::of_reading(table, reading),
        _ => coarse_start(run, &dwells, form)?.attitude,
    };
    let at = Linearisation {
        triads: *truth,
        further: *terms,
        initial_attitude: attitude.mean,
    };
    let sigma = velocity_sigma(run, &dwells);
    let problem = Problem::new(run, schedule, form, attitude, sigma);
    let result = pass(&problem, &at, Mode::Held(Gate::Open))?;
    Ok(Bound {
        estimate: Estimate {
            triads: *truth,
            covariance: result.covariance,
        },
        further: result.further,
        history: result.history,
    })
}
