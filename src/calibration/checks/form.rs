//! Test of the misalignment form by the data.

use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::calibration::iterations::Solved;
use crate::calibration::{
    CalibrationError, Finding, FindingKind as Kind, Linearisation, Problem, Script, in_general_form,
};
use crate::imu::InstallationForm;
use crate::statistics::{FALSE_ALARM, chi_square_limit};

/// The likelihood ratio of a restricted misalignment form against the general one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FormTest {
    /// Decrease of the cost (−2 ln of the product of likelihood and prior) if the general form is allowed.
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
            "The {} misalignment form does not fit the data: the {angles} additional angles of the general form are \
             needed (χ² falls by {gain:.0}; limit {limit:.1}). Rerun with --installation general.",
            form.name()
        );
        let figures = json!({ "form": form, "angles": angles, "gain": gain, "limit": limit });
        self.rejects()
            .then(|| Finding::new(Kind::FormRejected, text, figures))
    }
}

/// Tests the form of an estimate against the general form, linearised at this estimate (Van Trees, *Detection,
/// Estimation, and Modulation Theory*, part I, §2.5). `None` for a form with as many angles as the general form,
/// because no data can reject it.
///
/// # Errors
/// Returns [`CalibrationError::Diverged`] if a covariance is not positive definite.
pub fn form_test(problem: &Problem, solved: &Solved) -> Result<Option<FormTest>, CalibrationError> {
    let general = InstallationForm::General;
    let angles = |form: InstallationForm| 2 * form.angle_names().len();
    let more = angles(general) - angles(problem.model.form);
    if more == 0 {
        return Ok(None);
    }
    let free = problem.with(|model| *model = model.in_form(problem.run(), general));
    let at = Linearisation {
        triads: in_general_form(&solved.estimate.triads),
        ..solved.estimate.clone()
    };
    let script = Script::new(&free, &solved.script.priors, &at)?;
    let chain = solved.effects.chain(&free, &script)?;
    let of_general = solved.effects.weighed(&chain, &free, &script)?;
    Ok(Some(FormTest {
        gain: solved.posterior.cost - of_general.posterior.cost,
        angles: more,
        limit: chi_square_limit(more as f64, FALSE_ALARM),
    }))
}
