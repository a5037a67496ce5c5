//! Tests whether recordings differ by more than stated.

use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::calibration::sizes::Usual;
use crate::calibration::{DayToDay, Finding, FindingKind as Kind, Group, Model};

/// Differences between recordings in a group of parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingDifference {
    /// The key of `[day_to_day]`.
    pub key: String,
    /// The stated 1σ, in the unit of the key.
    pub stated: f64,
    /// 1σ estimated from the recordings, in the unit of the key.
    pub found: f64,
    /// −2 ln of the likelihood ratio of the stated to the estimated σ.
    pub ratio: f64,
    /// Limit of the ratio at this group's share of the false-alarm rate.
    pub limit: f64,
}

impl RecordingDifference {
    /// The difference of a group, given the logarithm of its size over the usual size; the test is not filled in.
    pub(in crate::calibration) fn new(
        group: Group,
        model: &Model,
        usual: &Usual,
        log: f64,
    ) -> Self {
        let (key, unit) = DayToDay::key(group);
        let first = group.parameters(model.form).into_iter();
        let prior = first
            .map(|index| model.prior_sigma[index])
            .fold(0.0, f64::max);
        let stated = if usual.stated { usual.sigma } else { 0.0 };
        Self {
            key,
            stated: stated * prior / unit,
            found: usual.sigma * log.exp() * prior / unit,
            ratio: 0.0,
            limit: 0.0,
        }
    }
}

/// The finding on differences between recordings that were estimated, if there are any.
pub fn recordings_differ(differences: &[RecordingDifference]) -> Option<Finding> {
    let one =
        |of: &RecordingDifference| format!("{} = {:.2e} (stated {})", of.key, of.found, of.stated);
    let each: Vec<String> = differences.iter().map(one).collect();
    let text = format!(
        "The recordings differ by more than their σ and [day_to_day] allow. turncal estimated the difference ({}) and \
         included it in the σ. The usual causes are bias changes at switch-on, remounting (set mounting_arcsec), and \
         a temperature sensor that is not close to the inertial sensors.",
        each.join(", ")
    );
    let figures = json!({ "differences": differences });
    (!differences.is_empty()).then(|| Finding::new(Kind::RecordingsDiffer, text, figures))
}
