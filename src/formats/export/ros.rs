//! The covariances of `sensor_msgs/Imu`.
//!
//! Row-major about x, y, z: the variance of a sample, density² × rate.
//!
//! Source: ROS common_interfaces, `sensor_msgs/Imu`.

use super::Exported;
use super::source::{Document, Source, yaml_list};
use crate::imu::Sensor;

pub(super) fn write(source: &Source) -> Exported {
    let notes = [
        "scale, misalignment and bias; publish what `turncal apply` writes, whose errors they are not".to_owned(),
        "wander of biases, which is not white; `turncal allan` finds it".to_owned(),
    ];
    let mut file = Document::new(source, "#", notes);
    file.comment("");
    file.comment("variance of a sample: density^2 times rate, (rad/s)^2 and (m/s^2)^2");
    for (key, sensor) in [
        ("angular_velocity_covariance", Sensor::Gyro),
        ("linear_acceleration_covariance", Sensor::Accel),
    ] {
        let Some(run) = source.run else {
            file.comment(&format!(
                "{key}: needs the noise and rate of a run; export with --run RUN.toml"
            ));
            continue;
        };
        let density = run.instrument.noise.get(sensor).random_walk;
        let variance = density.powi(2) / run.recording.imu.period;
        let all: Vec<f64> = (0..9)
            .map(|k| if k % 4 == 0 { variance } else { 0.0 })
            .collect();
        file.line(&format!("{key}: {}", yaml_list(&all)));
    }
    file.finish()
}
