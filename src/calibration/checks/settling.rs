//! Tests whether the table settles after its stops.

use serde_json::json;

use crate::calibration::noise::INTERVAL;
use crate::calibration::{Finding, FindingKind as Kind, Outcome, Problem, Source};
use crate::number::three_digits;
use crate::statistics::{FALSE_ALARM, chi_square_limit};

/// The finding, if a settling error that is not stated is larger than the error of a reading.
pub fn settles(problem: &Problem, outcome: &Outcome) -> Option<Finding> {
    let mut sources = outcome.noise.sources.iter();
    let found = sources.find(|of| of.source == Source::Settling && of.stated.is_none())?;
    let [_, high] = found.interval?;
    let (_, unit) = found.source.unit();
    let log = (found.used * unit / problem.model.reading_sigma).ln();
    let sigma = (high / found.used).ln() / INTERVAL;
    let is_larger = log > 0.0 && (log / sigma).powi(2) > chi_square_limit(1.0, FALSE_ALARM);
    let size = three_digits(found.used);
    let text = format!(
        "After a stop, the table attitude differs from its reading by an error of initially {size} {} (1σ) that fades \
         within seconds. turncal estimated this error, and the σ include it. Wait longer after each stop, or state \
         settling_sigma_arcsec in [turntable].",
        found.unit
    );
    let figures = json!({ "size": found.used * unit });
    is_larger.then(|| Finding::new(Kind::Settling, text, figures))
}
