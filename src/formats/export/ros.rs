//! ROS: covariances of `sensor_msgs/Imu`, the accelerometers' calibration of `imu_calib`, and DLIO's intrinsics.
//!
//! Source: ROS common_interfaces, `sensor_msgs/Imu`; imu_calib, `AccelCalib::applyCalib` and
//! `ApplyCalib::rawImuCallback`; direct_lidar_inertial_odometry, `odom.cc`, `callbackImu`, and `cfg/dlio.yaml`.

use super::Exported;
use super::document::{Document, yaml_list};
use super::source::{Axes, Held, Source};
use crate::imu::{PerSensor, Sensor};

/// Row-major about x, y, z: variance per sample, density² × rate.
pub fn covariance(source: &Source) -> Exported {
    let notes = [
        "scale, misalignment and bias; publish the output of `turncal apply`, which has these errors removed",
        "bias drift, which is not white; measure it with `turncal allan`",
    ];
    let mut file = Document::new(source, "#", notes);
    file.comment("");
    file.comment("variance per sample: density^2 times rate, (rad/s)^2 and (m/s^2)^2");
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
        let all = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|k| if k % 4 == 0 { variance } else { 0.0 });
        file.line(&format!("{key}: {}", yaml_list(&all)));
    }
    file.finish()
}

/// All accelerometer parameters, and gyro offsets.
fn held(axes: &Axes) -> PerSensor<Held> {
    PerSensor {
        gyro: Held::offset(axes.triads.gyro.bias),
        accel: Held::all(&axes.triads.accel),
    }
}

/// `SM n − bias` for the accelerometers, so the bias is in corrected units.
pub fn imu_calib(source: &Source) -> Exported {
    let axes = Axes::log(source);
    let held = held(&axes);
    let notes = [
        "gyro biases: imu_calib averages the gyros at its start, which includes Earth rate of up to 15.041 deg/h",
    ];
    let reads = ("#", "imu_calib reads rad/s and m/s^2, here");
    let mut file = Document::correcting(source, &axes, reads, &held, &notes);
    file.line(&format!("SM: {}", yaml_list(&held.accel.rows())));
    let bias = held.accel.matrix * held.accel.offset;
    file.line(&format!("bias: {}", yaml_list(&bias)));
    file.finish()
}

/// `sm n − bias` for the accelerometers and `n − bias` for the gyros, along the axes of `baselink`.
pub fn dlio(source: &Source) -> Exported {
    let axes = Axes::log(source);
    let held = held(&axes);
    let notes = [
        "gyro scale and misalignment; rotation from the log axes to baselink, which DLIO applies first",
    ];
    let reads = ("#", "DLIO reads rad/s and m/s^2, here");
    let mut file = Document::correcting(source, &axes, reads, &held, &notes);
    file.line("dlio:\n  imu:\n    calibration: false\n    intrinsics:\n      accel:");
    let bias = held.accel.matrix * held.accel.offset;
    file.line(&format!("        bias: {}", yaml_list(&bias)));
    file.line(&format!("        sm: {}", yaml_list(&held.accel.rows())));
    let bias = yaml_list(&held.gyro.offset);
    file.line(&format!("      gyro:\n        bias: {bias}"));
    file.finish()
}
