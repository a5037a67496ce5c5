//! What Betaflight holds of a calibration: the accelerometers' zeros, in whole counts.
//!
//! It takes `acc_calibration` from the counts of each axis and divides by the counts for one g; gyros are zeroed at
//! every start.
//!
//! Source: Betaflight, `acceleration.c` (`applyAccelerationTrims`) and `settings.c` (`acc_calibration`).

use nalgebra::{Matrix3, Vector3};

use super::Exported;
use super::along::{Along, Remainder};
use super::source::{Document, Source};
use crate::imu::Sensor;
use crate::units::STANDARD_GRAVITY;

/// Counts for one g of a 16-bit sensor of ±16 g, to which Betaflight sets those that it knows.
const COUNTS: f64 = 2048.0;

pub(super) fn write(source: &Source) -> Exported {
    let along = Along::log(source);
    let accel = &along.triads.accel;
    let counts = accel
        .bias
        .map(|bias| (bias * COUNTS / STANDARD_GRAVITY).round());
    let offset = counts * STANDARD_GRAVITY / COUNTS;
    let identity = Matrix3::identity();
    let gyro = &along.triads.gyro;
    let left = [
        Remainder::of(Sensor::Gyro, gyro, &identity, &Vector3::zeros()),
        Remainder::of(Sensor::Accel, accel, &identity, &offset),
    ];
    let notes = [
        format!(
            "anything of the gyros, which it zeroes at every start; {}",
            left[0].words()
        ),
        left[1].words(),
        "sigma and covariance of the parameters; they are in calibration.json".to_owned(),
    ];
    let mut file = Document::holding(source, "#", notes, |_| false);
    along.introduce(&mut file, "lines for its command line,");
    file.comment(&format!("counts are of an accelerometer with {COUNTS} for one g; at another number n, times n / {COUNTS}"));
    left.iter().for_each(|left| left.lines(&mut file));
    let [x, y, z] = [counts.x, counts.y, counts.z].map(|count| count as i64);
    file.line(&format!("set acc_calibration = {x},{y},{z},1\nsave"));
    file.finish()
}
