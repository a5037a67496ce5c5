//! SlimeVR's calibration of a tracker, as the fields of its `SoftFusionSensorConfig`.
//!
//! It computes `A_Ainv (counts − A_B)` for accelerometers and `G_Sens ⊙ (counts − G_off)` for gyros, then scales both
//! by the nominal sensitivity of the sensor.
//!
//! Source: SlimeVR-Tracker-ESP, `src/configuration/SensorConfig.h` and `src/sensors/softfusion`.

use nalgebra::{Matrix3, Vector3};

use super::Exported;
use super::document::Document;
use super::source::{Axes, Held, Source};
use crate::imu::PerSensor;

pub fn write(source: &Source) -> Exported {
    let axes = Axes::log(source);
    let PerSensor { gyro, accel } = &axes.triads;
    let held = PerSensor {
        gyro: Held {
            matrix: Matrix3::from_diagonal(&gyro.sensitivity.diagonal().map(f64::recip)),
            offset: gyro.bias,
        },
        accel: Held::all(accel),
    };
    let notes = [
        "gyro misalignment",
        "sample rates and magnetometer, which keep the values found by the tracker",
    ];
    let reads = ("//", "SlimeVR reads counts, here");
    let mut file = Document::correcting(source, &axes, reads, &held, &notes);
    file.comment("offsets are in the unit of the log, which must be counts of the tracker driver");
    let list = |v: &Vector3<f64>| {
        let [x, y, z] = [v.x, v.y, v.z].map(|value| value as f32);
        format!("{{{x:?}f, {y:?}f, {z:?}f}}")
    };
    let counts = |v: &Vector3<f64>, nominal: &Vector3<f64>| list(&v.component_mul(nominal));
    file.line(&format!(".A_B = {},", counts(&accel.bias, &accel.nominal)));
    // In counts a row has the nominal scale of its axis, a column that of what it reads.
    let scale = accel.nominal;
    let of_counts = Matrix3::from_diagonal(&scale)
        * held.accel.matrix
        * Matrix3::from_diagonal(&scale.map(f64::recip));
    let rows = [0, 1, 2].map(|i| list(&of_counts.row(i).transpose()));
    file.line(&format!(".A_Ainv = {{{}}},", rows.join(", ")));
    file.line(&format!(".G_off = {},", counts(&gyro.bias, &gyro.nominal)));
    file.line(&format!(
        ".G_Sens = {},",
        list(&held.gyro.matrix.diagonal())
    ));
    file.finish()
}
