//! IMU intrinsics for iKalibr.
//!
//! From true to measured: `f_m = MAP_a f + BIAS_a`, `ω_m = MAP_g (SO3_AtoG ω) + BIAS_g`, both maps upper triangular
//! with the coefficients (00, 11, 22, 01, 02, 12). The body frame is that of the accelerometer map.
//!
//! Source: iKalibr, `include/sensor/imu_intrinsic.hpp` and `config/imu-intri.yaml`.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::Exported;
use super::document::{Document, SIGMA, yaml_list, yaml_number};
use super::source::{Axes, Source, upper};
use crate::imu::{PerSensor, Sensor};
use crate::units::ARCSEC;

pub fn write(source: &Source) -> Exported {
    let axes = Axes::log(source);
    let (accel, own) = upper(&axes.triads.accel.sensitivity);
    let (gyro, of_gyro) = upper(&axes.triads.gyro.sensitivity);
    let accel_to_gyro = Rotation3::from_matrix_unchecked(of_gyro * own.transpose());
    let turn = crate::attitude::log(&own).norm() / ARCSEC;
    let notes = [
        format!(
            "the body frame: its frame differs from that of the calibration by {turn:.1} arcsec (the rotation below)"
        ),
        SIGMA.to_owned(),
    ];
    let mut file = Document::holding(source, "#", notes, |_| false);
    axes.introduce(&mut file, "iKalibr reads rad/s and m/s^2, here");
    for (axis, row) in ["x", "y", "z"].iter().zip(own.row_iter()) {
        let row: Vector3<f64> = row.transpose();
        file.comment(&format!(
            "its {axis} axis along the body axes: {}",
            yaml_list(&row)
        ));
    }
    // The pointer through which iKalibr reads them.
    file.line("Intrinsics:\n  ptr_wrapper:\n    id: 2147483649\n    data:");
    let maps = PerSensor { gyro, accel };
    for (name, sensor) in [("ACCE", Sensor::Accel), ("GYRO", Sensor::Gyro)] {
        file.line(&format!("      {name}:"));
        column(&mut file, "BIAS", axes.triads.get(sensor).bias.as_slice());
        column(&mut file, "MAP_COEFF", &coefficients(maps.get(sensor)));
    }
    let q = UnitQuaternion::from_rotation_matrix(&accel_to_gyro);
    file.line("      SO3_AtoG:");
    for (name, value) in [("qx", q.i), ("qy", q.j), ("qz", q.k), ("qw", q.w)] {
        file.line(&format!("        {name}: {}", yaml_number(value)));
    }
    file.finish()
}

fn coefficients(map: &Matrix3<f64>) -> [f64; 6] {
    [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|place| map[place])
}

fn column(file: &mut Document, name: &str, values: &[f64]) {
    file.line(&format!("        {name}:"));
    for (row, &value) in values.iter().enumerate() {
        file.line(&format!("          r{row}c0: {}", yaml_number(value)));
    }
}
