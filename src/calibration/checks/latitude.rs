//! Whether the gyros sense the Earth rate of the stated latitude.

use nalgebra::Vector3;
use serde_json::json;

use super::term::is_shown;
use crate::calibration::{Candidate, Constant, Finding, FindingKind as Kind, Outcome};
use crate::units::DEG_PER_H;

/// The finding, if Earth rate is not that of the stated latitude.
pub fn earth_rate(outcome: &Outcome) -> Option<Finding> {
    let candidates = &outcome.solved.effects.candidates;
    let count = candidates.absent().count();
    let mut absent = candidates.absent();
    let (_, absent) = absent.find(|(candidate, _)| *candidate == Candidate::EarthRate)?;
    if !is_shown(absent, count) {
        return None;
    }
    let posterior = &outcome.solved.posterior;
    let constants = posterior.constants.iter().zip(&posterior.mean);
    let mut rate = Vector3::zeros();
    for (constant, mean) in constants {
        if let Constant::EarthRate(axis) = constant {
            rate[*axis] = mean / DEG_PER_H;
        }
    }
    let text = format!(
        "The gyros sense an Earth rate that differs from the one at latitude_deg by {:+.4}, {:+.4}, {:+.4} °/h (East, \
         North, Up). turncal estimated it. Check latitude_deg and the north and level of the table.",
        rate.x, rate.y, rate.z
    );
    let figures = json!({ "deg_per_h": [rate.x, rate.y, rate.z], "present": 1.0 - absent });
    Some(Finding::new(Kind::EarthRateWrong, text, figures))
}
