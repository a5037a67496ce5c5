//! The noise of an IMU in Gazebo (SDFormat).
//!
//! A sample is the true value plus white noise of `stddev`, plus a bias drawn from `bias_mean` ± `bias_stddev` with
//! either sign, plus a correlated walk with `dynamic_bias_correlation_time`, whose stationary standard deviation is
//! `dynamic_bias_stddev √(τ/2)`.
//!
//! Source: gz-sensors, `GaussianNoiseModel.cc`; SDFormat 1.6 and later, `noise.sdf`.

use super::Exported;
use super::document::Document;
use super::source::{Axes, Held, Source};
use crate::imu::{PerSensor, Sensor};

pub fn write(source: &Source) -> Exported {
    let axes = Axes::log(source);
    let held = PerSensor::from_fn(|sensor| Held::offset(axes.triads.get(sensor).bias));
    let notes = [
        "the sign of the bias: Gazebo draws it at random for each axis, so half of the axes get the opposite sign",
    ];
    let reads = ("", "Gazebo writes rad/s and m/s^2, here");
    let mut file = Document::correcting(source, &axes, reads, &held, &notes);
    if source.run.is_none() {
        file.comment("no noise: export with --run RUN.toml");
    }
    file.enclose("<!--", "-->");
    file.line("<imu>");
    for (name, sensor) in [
        ("angular_velocity", Sensor::Gyro),
        ("linear_acceleration", Sensor::Accel),
    ] {
        file.line(&format!("  <{name}>"));
        let triad = axes.triads.get(sensor);
        let sigma = source
            .sigma(sensor)
            .map(|sigma| sigma.bias)
            .unwrap_or_default();
        let stddev = source.run.zip(source.noise(sensor));
        let stddev = stddev.map(|(run, noise)| noise.random_walk / run.recording.imu.period.sqrt());
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            file.line(&format!("    <{letter}>\n      <noise type=\"gaussian\">"));
            let mut set =
                |key: &str, value: f64| file.line(&format!("        <{key}>{value:e}</{key}>"));
            set("mean", 0.0);
            set("stddev", stddev.unwrap_or(0.0));
            set("bias_mean", triad.bias[axis]);
            let of_record = axes.axis_of_record(axis);
            set("bias_stddev", sigma[of_record] / triad.nominal[axis].abs());
            if let Some(bias) = source.varying(sensor) {
                set("dynamic_bias_stddev", bias.walk());
                set("dynamic_bias_correlation_time", bias.correlation_time);
            }
            file.line(&format!("      </noise>\n    </{letter}>"));
        }
        file.line(&format!("  </{name}>"));
    }
    file.line("</imu>");
    file.finish()
}
