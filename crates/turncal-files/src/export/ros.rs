//! ROS: covariances of `sensor_msgs/Imu`, the accelerometer calibration file that `imu_calib` reads, and the hard iron that
//! `imu_filter_madgwick` subtracts.
//!
//! Source: ROS common_interfaces, `sensor_msgs/Imu`; imu_calib, `AccelCalib::applyCalib` and
//! `ApplyCalib::rawImuCallback`; imu_tools, `ImuFilterRos::imuMagCallback`.

use super::affine::Affine;
use super::notation::{list, number};
use super::remarks::{Exported, Remarks};
use super::values::Values;
use crate::quantity::units_of_field;
use turncal::imu::{AXES, PerSensor, Sensor};

/// Covariance matrices about x, y, z in row-major order, with the variance per sample, density² × rate.
pub fn covariance(values: &Values) -> Exported {
    let notes = [
        "scale, misalignment and bias; publish the output of `turncal apply`, from which these errors are removed",
        "bias drift, because it is not white; measure it with `turncal allan`",
    ];
    let line = |(key, sensor)| match values.triads.get(sensor).density().zip(values.rate) {
        Some((density, rate)) => {
            let variance = density.powi(2) * rate;
            let all = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|k| if k % 4 == 0 { variance } else { 0.0 });
            format!("{key}: {}\n", list(&all))
        }
        None => format!("# {key}: needs the noise and rate of a run; export with --run RUN.toml\n"),
    };
    let lines = [
        ("angular_velocity_covariance", Sensor::Gyro),
        ("linear_acceleration_covariance", Sensor::Accel),
    ];
    let variance = "variance per sample: density^2 times rate, (rad/s)^2 and (m/s^2)^2";
    Remarks::new(values, "#", &notes)
        .including(|_| true)
        .defines([variance.to_owned()])
        .above(&lines.map(line).concat())
}

/// The program computes `SM n − bias` for the accelerometers, so the bias is in corrected units.
pub fn imu_calib(values: &Values) -> Exported {
    let program = PerSensor {
        gyro: Affine::offset(values.triads.gyro.bias),
        accel: Affine::complete(&values.triads.accel),
    };
    let notes = [
        "gyro biases: imu_calib averages the gyros at its start, and the average includes Earth rate of up to 15.041 \
         deg/h",
    ];
    let reads = ("#", "imu_calib reads rad/s and m/s^2");
    let matrix = list(&program.accel.matrix.transpose());
    let bias = list(&program.accel.corrected_bias());
    Remarks::of_program(values, reads, &program, &notes)
        .above(&format!("SM: {matrix}\nbias: {bias}\n"))
}

/// Hard iron, which `imu_filter_madgwick` subtracts from `sensor_msgs/MagneticField`.
pub fn madgwick(values: &Values) -> Exported {
    let notes = [
        "scale, misalignment and bias of gyros and accelerometers, and soft iron; publish the output of `turncal \
                  apply`, from which these errors are removed",
    ];
    let remarks = Remarks::new(values, "#", &notes).including(|_| true);
    let Some(mag) = &values.record.mag else {
        return remarks
            .omitting(["the calibration has no magnetometer".to_owned()])
            .above("");
    };
    let unit = units_of_field().find(|(name, _)| *name == mag.unit);
    let per_tesla = unit.map_or(1.0, |(_, per_tesla)| per_tesla);
    let line = |k: usize| {
        let bias = number(mag.bias[k] / per_tesla);
        format!("mag_bias_{}: {bias}\n", AXES[k])
    };
    remarks.above(&[0, 1, 2].map(line).concat())
}
