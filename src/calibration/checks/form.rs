//! Test of the installation form by the data.

use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::calibration::{
    CalibrationError, Finding, FindingKind as Kind, Linearisation, Prior, Script, Solved,
    in_general_form,
};
use crate::imu::InstallationForm;
use crate::statistics::{FALSE_ALARM, chi_square_limit};

/// The likelihood ratio of a restricted installation form against the general one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FormTest {
    /// Decrease of the cost, −2 ln of likelihood and prior, if the general form is allowed.
    pub gain: f64,
    /// Number of additional angles of the general form.
    pub angles: usize,
    /// Limit of the gain at a false-alarm rate of 0.1 % (χ²).
    pub limit: f64,
}

impl FormTest {
    /// Whether the data reject the form.
    pub fn rejects(&self) -> bool {
        self.gain > self.limit
    }

    /// The finding, if the data reject this form.
    pub fn finding(&self, form: InstallationForm) -> Option<Finding> {
        let Self {
            gain,
            angles,
            limit,
        } = self;
        let text = format!(
            "The {} installation form does not fit the data: the {angles} additional angles of the general form are \
             needed (χ² falls by {gain:.0}; limit {limit:.1}). Rerun with --installation general.",
            form.name()
        );
        let figures = json!({ "form": form, "angles": angles, "gain": gain, "limit": limit });
        self.rejects()
            .then(|| Finding::new(Kind::FormRejected, text, figures))
    }
}

/// Tests the form of a converged pass against the general form, linearised at the same estimate (Van Trees,
/// *Detection, Estimation, and Modulation Theory*, part I, §2.5). `None` for a form with as many angles as the
/// general one, which no data can reject.
pub fn form_test(
    Solved {
        problem: restricted,
        priors,
        iterated,
        ..
    }: &Solved,
) -> Result<Option<FormTest>, CalibrationError> {
    let general = InstallationForm::General;
    let angles = |form: InstallationForm| 2 * form.angle_names().len();
    let more = angles(general) - angles(restricted.model.form);
    if more == 0 {
        return Ok(None);
    }
    let model = restricted.model.in_form(restricted.run(), general);
    let at = Linearisation {
        triads: in_general_form(&iterated.estimate.triads),
        ..iterated.estimate.clone()
    };
    let general = restricted.with_model(model);
    let script = Script::new(&general, priors, &at)?;
    let free = script.reduce(&general, &iterated.held.accepted())?;
    let free = free.posterior(&Prior::new(&free.constants, &general.model, &at));
    Ok(Some(FormTest {
        gain: iterated.held.posterior.cost - free.cost,
        angles: more,
        limit: chi_square_limit(more as f64, FALSE_ALARM),
    }))
}
