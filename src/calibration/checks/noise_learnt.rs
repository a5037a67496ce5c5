//! Whether the data contradict the stated noise.

use serde_json::json;

use super::finding::Finding;
use crate::calibration::noise::{NoiseReport, SourceFigures};
use crate::calibration::problem::Problem;

/// The finding of a report of noise that was learnt because the data contradict what is stated.
pub fn of_report(problem: &Problem, noise: &NoiseReport) -> Option<Finding> {
    let test = noise.test.filter(|test| noise.learnt && test.rejected)?;
    noise_learnt(problem, (test.ratio, test.limit), &noise.sources)
}

/// Noise that was learnt: −2 ln of the likelihood ratio of stated to learnt noise, its limit, and the sources.
/// None where none was stated.
pub fn noise_learnt(
    problem: &Problem,
    (ratio, limit): (f64, f64),
    sources: &[SourceFigures],
) -> Option<Finding> {
    let stated = problem.run().instrument.noise_is_stated;
    if !(stated.gyro || stated.accel) {
        return None;
    }
    let used = sources.iter().filter(|figures| figures.counts());
    let used: Vec<String> = used.map(SourceFigures::to_string).collect();
    let text = format!(
        "The noise you stated does not fit this record (likelihood-ratio statistic {ratio:.0}; expected below \
         {limit:.0}). turncal used the noise it estimated from the record \
         instead; all σ include it: {}. To keep it, paste noise.run_toml of calibration.json into [imu.noise].",
        used.join("; ")
    );
    let figures = json!({ "ratio": ratio, "limit": limit, "sources": sources });
    Some(Finding::new("noise-learnt", text, figures))
}
