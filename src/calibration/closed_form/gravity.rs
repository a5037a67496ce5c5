//! Without a table and without labels: every dwell and every turn between two, by gravity alone.

use super::super::coarse::{self, ByGravity};
use super::super::error::CalibrationError;
use super::{ClosedForm, Reference, remarks};
use crate::imu::{InstallationForm, PerSensor};
use crate::run::{Dwell, Run};

/// Weighted residuals above this times what noise makes are worth a warning.
const DOUBTFUL: f64 = 1.2;

/// Both triads from whatever positions there are, tied down by the prior where they are too few.
pub(super) fn by_gravity(
    run: &Run,
    dwells: &[Dwell],
    form: InstallationForm,
) -> Result<ClosedForm, CalibrationError> {
    if !run.imu.continuous {
        return Err(CalibrationError::not_continuous(&run.imu));
    }
    let ByGravity { estimate, misfit } = coarse::by_gravity(run, dwells, form)?;
    let mut warnings = remarks(run, &estimate, Reference::Gravity);
    let misfit = misfit.sqrt();
    if misfit > DOUBTFUL {
        warnings.push(format!(
            "Residuals of dwells and turns are {misfit:.1} times as large as noise figures and Earth rate \
             say: what is not modelled, such as flicker of the sensors or a hand that is not still, is as \
             much larger than noise, and the σ are as much too small."
        ));
    }
    let samples: usize = dwells.iter().map(|dwell| dwell.samples.len()).sum();
    Ok(ClosedForm {
        estimate,
        reference: Reference::Gravity,
        positions: PerSensor::from_fn(|_| dwells.len()),
        turns: dwells.len() - 1,
        standing_time: samples as f64 * run.imu.period,
        warnings,
    })
}
