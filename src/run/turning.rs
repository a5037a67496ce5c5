//! What counts as a turn of the gyros, and as another one than a label or the table says.

use std::ops::Range;

use nalgebra::Vector3;

use super::Run;
use crate::navigation::samples_of;
use crate::recording::ImuSamples;
use crate::units::DEGREE;

/// Turns are measured in steps this long, s, so that noise adds little to them.
pub const STEP: f64 = 0.1;
/// What turns by less has not turned, rad.
pub const SMALLEST: f64 = 1.0 * DEGREE;
/// A turn that differs by more than this part of it is another one …
const OTHER_ANGLE: f64 = 0.1;
/// … or that many σ of the gyros' scale.
pub const SCALE_SIGMAS: f64 = 5.0;

/// By which part of a turn the gyros may be off before it is another one.
pub fn tolerance(run: &Run) -> f64 {
    OTHER_ANGLE.max(SCALE_SIGMAS * run.instrument.prior.gyro.scale_sigma.amax())
}

/// The steps of some samples, with this output of the gyros as zero, rad/s: time in the middle and duration, s, and
/// turn, rad.
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
