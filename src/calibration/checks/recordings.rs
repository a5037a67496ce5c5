//! Test whether recordings differ by more than stated.

use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::calibration::{Finding, FindingKind as Kind};

/// Differences between recordings in a group of parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingDifference {
    /// The key of `[day_to_day]`.
    pub key: String,
    /// The stated 1σ, in its unit.
    pub stated: f64,
    /// 1σ estimated from the recordings, in its unit.
    pub found: f64,
    /// −2 ln of the likelihood ratio of the stated to the estimated σ …
    pub ratio: f64,
    /// … and its limit at this group's share of the false-alarm rate.
    pub limit: f64,
}

/// The finding on differences that were estimated and are used.
pub fn recordings_differ(differences: &[RecordingDifference]) -> Finding {
    let one =
        |of: &RecordingDifference| format!("{} = {:.2e} (stated {})", of.key, of.found, of.stated);
    let each: Vec<String> = differences.iter().map(one).collect();
    let text = format!(
        "The recordings differ more than their σ and [day_to_day] allow. turncal estimated the difference ({}) and \
         included it in σ. Usual causes: bias changes at switch-on, remounting (set mounting_arcsec), or a \
         temperature sensor away from the inertial sensors.",
        each.join(", ")
    );
    Finding::new(
        Kind::RecordingsDiffer,
        text,
        json!({ "differences": differences }),
    )
}
