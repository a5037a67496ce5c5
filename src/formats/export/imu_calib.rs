//! The accelerometers' calibration of the ROS package `imu_calib`.
//!
//! It makes `SM n − bias` of the accelerometers' output, so its bias is in corrected units, and takes the mean of the
//! gyros over their first samples for their bias.
//!
//! Source: imu_calib, `AccelCalib::applyCalib` and `ApplyCalib::rawImuCallback`.

use nalgebra::Matrix3;

use super::Exported;
use super::along::{Along, Remainder};
use super::source::{Document, Source, yaml_list};
use crate::imu::Sensor;

pub(super) fn write(source: &Source) -> Exported {
    let along = Along::log(source);
    let accel = &along.triads.accel;
    // A calibration that can be exported has an inverse.
    let matrix = accel
        .sensitivity
        .try_inverse()
        .unwrap_or_else(Matrix3::identity);
    let gyro = &along.triads.gyro;
    let left = Remainder::of(Sensor::Gyro, gyro, &Matrix3::identity(), &gyro.bias);
    let notes = [
        format!(
            "{}; imu_calib takes the mean of the gyros at its start for their bias, and with it the rate of the \
             Earth, up to 15.041 deg/h",
            left.words()
        ),
        "sigma and covariance of the parameters; they are in calibration.json".to_owned(),
    ];
    let mut file = Document::holding(source, "#", notes, |_| false);
    along.introduce(&mut file, "imu_calib reads rad/s and m/s^2, here");
    left.lines(&mut file);
    let rows: Vec<f64> = matrix.transpose().iter().copied().collect();
    file.line(&format!("SM: {}", yaml_list(&rows)));
    file.line(&format!("bias: {}", yaml_list(&(matrix * accel.bias))));
    file.finish()
}
