//! Criteria for a turn sensed by the gyros, and for its disagreement with a label or the table.

use std::ops::Range;

use nalgebra::Vector3;

use super::Run;
use crate::navigation::samples_of;
use crate::recording::ImuSamples;
use crate::units::DEGREE;

/// Length of the steps in which turns are measured, s, so that noise adds little to them.
pub const STEP: f64 = 0.1;
/// Smallest angle that counts as a turn, rad.
pub const SMALLEST: f64 = 1.0 * DEGREE;
/// A turn disagrees if its angle differs by more than this fraction.
const OTHER_ANGLE: f64 = 0.1;
/// A turn disagrees only if its angle also differs by more than this many σ of the gyros' scale factor.
pub const SCALE_SIGMAS: f64 = 5.0;

/// Maximum relative error of a gyro turn that still agrees with a label or the table.
pub fn tolerance(run: &Run) -> f64 {
    OTHER_ANGLE.max(SCALE_SIGMAS * run.instrument.prior.gyro.scale_sigma.amax())
}

/// Divides samples into steps, each with the time of its middle, s, its duration, s, and its turn, rad. `zero` is the
/// gyro output at rest, rad/s.
pub fn steps(
    imu: &ImuSamples,
    samples: Range<usize>,
    zero: Vector3<f64>,
) -> impl Iterator<Item = (f64, f64, Vector3<f64>)> {
    let length = samples_of(STEP, imu.period);
    samples.clone().step_by(length).map(move |start| {
        let part = start..(start + length).min(samples.end);
        let duration = part.len() as f64 * imu.period;
        let turned = imu.gyro.sum(part) - zero * duration;
        (imu.time(start) + 0.5 * duration, duration, turned)
    })
}
