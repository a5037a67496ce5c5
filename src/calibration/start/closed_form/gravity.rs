//! Without a table and without labels: every dwell and every move between two, by gravity alone.

use super::result::{ClosedForm, Reference, hidden};
use crate::calibration::checks::prior_distance::far_by_data;
use crate::calibration::error::CalibrationError;
use crate::calibration::problem::Problem;
use crate::calibration::start::coarse::{self, ByGravity};
use crate::imu::PerSensor;

/// Both triads from whatever positions there are, tied down by the prior where they are too few.
pub fn by_gravity(problem: &Problem) -> Result<ClosedForm, CalibrationError> {
    let ByGravity {
        estimate,
        distance,
        by_hand,
        ringing,
    } = coarse::by_gravity(problem)?;
    let model = &problem.model;
    let far = far_by_data(model, &estimate, &distance);
    let hidden = hidden(model, &estimate, Reference::Gravity);
    let noise = by_hand.as_ref().map(|by_hand| by_hand.report(problem));
    let learnt = by_hand.zip(noise.as_ref());
    let learnt = learnt.map(|(by_hand, report)| by_hand.finding(report));
    let findings = far.into_iter().chain(hidden).chain(learnt).chain(ringing);
    let stretches = problem.stretches();
    let time_at_rest = stretches.iter().map(|stretch| {
        let samples: usize = stretch.dwells.iter().map(|dwell| dwell.samples.len()).sum();
        samples as f64 * stretch.run.recording.imu.period
    });
    let dwells = problem.dwells().count();
    Ok(ClosedForm {
        estimate,
        reference: Reference::Gravity,
        positions: PerSensor::from_fn(|_| dwells),
        turns: dwells - stretches.len(),
        standing_time: time_at_rest.sum(),
        findings: findings.collect(),
        noise,
    })
}
