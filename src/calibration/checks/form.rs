//! Whether the data reject the installation form.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::calibration::error::CalibrationError;
use crate::calibration::linearisation::{AttitudePrior, Linearisation};
use crate::calibration::parameters::in_general_form;
use crate::calibration::pass::{Gate, Mode, PassResult, pass};
use crate::calibration::problem::Problem;
use crate::imu::InstallationForm;

/// The likelihood ratio of a restricted installation form against the general one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FormTest {
    /// By how much the cost, −2 ln of likelihood and prior, falls if the general form is allowed.
    pub gain: f64,
    /// Angles that the general form has more.
    pub angles: usize,
    /// What the gain stays below in all but one in a thousand runs if the form is right (χ²).
    pub limit: f64,
}

/// Chance that a right form is rejected.
const FALSE_REJECTION: f64 = 1e-3;

impl FormTest {
    /// Whether the data reject the form.
    pub fn rejects(&self) -> bool {
        self.gain > self.limit
    }
}

/// Tests the form of a converged pass by one more in the general form, linearised at the same
/// estimate (Van Trees, *Detection, Estimation, and Modulation Theory*, part I, §2.5). `None` for a form with as many
/// angles as the general one, which no data can reject.
pub fn form_test(
    restricted: &Problem,
    priors: &[AttitudePrior],
    held: &PassResult,
) -> Result<Option<FormTest>, CalibrationError> {
    let general = InstallationForm::General;
    let angles = |form: InstallationForm| 2 * form.angle_names().len();
    let more = angles(general) - angles(restricted.model.form);
    let Ok(chi2) = ChiSquared::new(more as f64) else {
        return Ok(None);
    };
    let model = restricted.model.in_form(restricted.run(), general);
    let at = Linearisation {
        triads: in_general_form(&held.estimate.triads),
        ..held.estimate.clone()
    };
    let gate = Gate::As(&held.innovations);
    let free = pass(&restricted.with_model(model), priors, &at, Mode::Held(gate))?;
    Ok(Some(FormTest {
        gain: held.cost - free.cost,
        angles: more,
        limit: chi2.inverse_cdf(1.0 - FALSE_REJECTION),
    }))
}
