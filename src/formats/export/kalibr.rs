//! IMU intrinsics for Kalibr, model `scale-misalignment`, and for OpenVINS.
//!
//! From true to measured, in rad/s and m/s²: `a = M_a C_i_b f + b_a`,
//! `ω = M_g C_gyro_i C_i_b ω_b + A C_gyro_i C_i_b f + b_g`, with both `M` lower triangular and both `C` rotations. `C_i_b`, in `T_i_b`, rotates the body frame of the
//! calibration into the accelerometer axes, so K and E are represented completely.
//!
//! Source: Rehder et al., "Extending kalibr: calibrating the extrinsics of multiple IMUs and of
//! individual axes", ICRA 2016; the keys are those of Kalibr's IMU chain files.

use nalgebra::Matrix3;

use super::Exported;
use super::document::{Document, SIGMA, yaml_list, yaml_number};
use super::source::{Axes, Source, upper};
use crate::calibration::result::frame::accelerometer_frame;
use crate::imu::{PerSensor, Sensor, Term};
use crate::units::ARCSEC;

/// Quantities that Kalibr and OpenVINS estimate themselves.
const BIASES: &str =
    "biases, which it estimates itself, so they leave no error; a comment lists them";

fn begin(source: &Source) -> Document {
    Document::holding(source, "#", [BIASES, SIGMA], |term| {
        term == Term::GSensitivity
    })
}

fn biases(file: &mut Document, axes: &Axes) {
    for (name, sensor) in [
        ("gyroscopes", Sensor::Gyro),
        ("accelerometers", Sensor::Accel),
    ] {
        let bias = yaml_list(&axes.triads.get(sensor).bias);
        file.comment(&format!("bias of {name}: {bias}"));
    }
}

pub fn write(source: &Source) -> Exported {
    let axes = Axes::right_front_up(source);
    let triads = &axes.triads;
    let imu_b = accelerometer_frame(&triads.accel.sensitivity);
    let gyro = triads.gyro.sensitivity * imu_b.transpose();
    let gyro_imu = accelerometer_frame(&gyro);
    let matrices = PerSensor {
        gyro: lower(gyro * gyro_imu.transpose()),
        accel: lower(triads.accel.sensitivity * imu_b.transpose()),
    };
    let of_force = triads.gyro.sensitivity * axes.g_sensitivity * (gyro_imu * imu_b).transpose();
    let mut file = begin(source);
    axes.introduce(&mut file, "Kalibr reads rad/s and m/s^2, here");
    file.comment("measured = M C_i_b f + bias");
    file.comment("measured = M C_gyro_i C_i_b w + A C_gyro_i C_i_b f + bias");
    let turned = crate::attitude::log(&imu_b).norm() / ARCSEC;
    file.comment(&format!(
        "T_i_b rotates the body frame above into the accelerometer axes, {turned:.1} arcsec away; a program that \
         assumes the identity gets u along those axes"
    ));
    biases(&mut file, &axes);
    file.line("imu0:\n  model: scale-misalignment\n  T_i_b:");
    for row in imu_b.to_homogeneous().row_iter() {
        file.line(&format!("  - {}", yaml_list(row.iter())));
    }
    file.line("  time_offset: 0.0\n  gyroscopes:");
    matrix(&mut file, "    M", &matrices.gyro);
    matrix(&mut file, "    A", &of_force);
    matrix(&mut file, "    C_gyro_i", &gyro_imu);
    file.line("  accelerometers:");
    matrix(&mut file, "    M", &matrices.accel);
    noise(&mut file, source);
    file.finish()
}

/// Tolerance for rounding above the diagonal.
fn lower(mut matrix: Matrix3<f64>) -> Matrix3<f64> {
    matrix.fill_upper_triangle(0.0, 1);
    matrix
}

/// A matrix row by row below its indented name.
fn matrix(file: &mut Document, name: &str, matrix: &Matrix3<f64>) {
    let indent = " ".repeat(name.len() - name.trim_start().len());
    file.line(&format!("{name}:"));
    for row in matrix.row_iter() {
        file.line(&format!("{indent}- {}", yaml_list(row.iter())));
    }
}

fn noise(file: &mut Document, source: &Source) {
    let missing = source.no_noise();
    let mut key = |name: &str, value: Option<f64>, unit: &str| match value {
        Some(value) => file.line(&format!("  {name}: {}  # {unit}", yaml_number(value))),
        None => file.line(&format!("  # {name}:   # {unit}: {missing}")),
    };
    for (name, sensor, unit) in [
        ("gyroscope", Sensor::Gyro, "rad/s"),
        ("accelerometer", Sensor::Accel, "m/s^2"),
    ] {
        let walk = source.varying(sensor).map(|bias| bias.walk());
        let density = source.noise(sensor).map(|noise| noise.random_walk);
        key(
            &format!("{name}_noise_density"),
            density,
            &format!("{unit}/sqrt(Hz)"),
        );
        key(
            &format!("{name}_random_walk"),
            walk,
            &format!("{unit}/s/sqrt(Hz)"),
        );
    }
    let rate = source.run.map(|run| run.recording.imu.period.recip());
    key("update_rate", rate, "Hz");
    file.line("  # rostopic: /imu0  # the topic of your recording");
}

/// A triangle and the rotation before it.
type Split = (Matrix3<f64>, Matrix3<f64>);

pub fn open_vins_kalibr(source: &Source) -> Exported {
    open_vins(source, "kalibr", |a| {
        let rotation = accelerometer_frame(a);
        (lower(a * rotation.transpose()), rotation)
    })
}

pub fn open_vins_rpng(source: &Source) -> Exported {
    open_vins(source, "rpng", upper)
}

/// IMU intrinsics for OpenVINS, models `kalibr` and `rpng`.
///
/// From measured to true, in rad/s and m/s²: `a = R_IMUtoACCᵀ Ta⁻¹ (a_m − b_a)`,
/// `ω = R_IMUtoGYROᵀ Tw⁻¹ (ω_m − Tg a − b_g)`, with `Ta`, `Tw` lower triangular (`kalibr`) or upper (`rpng`): only
/// that triangle of their inverses is read. `Tg` acts on the corrected a along the IMU's axes, so it is what Kalibr
/// calls `A C_gyro_i`; the comment in OpenVINS' example files says otherwise.
///
/// Source: OpenVINS, `VioManagerOptions::print_and_load_state` and `Propagator::predict_and_compute`.
fn open_vins(source: &Source, name: &str, split: fn(&Matrix3<f64>) -> Split) -> Exported {
    let axes = Axes::log(source);
    let parts = PerSensor::from_fn(|sensor| split(&axes.triads.get(sensor).sensitivity));
    let of_force = axes.triads.gyro.sensitivity * axes.g_sensitivity;
    let mut file = begin(source);
    file.begin("%YAML:1.0");
    axes.introduce(&mut file, "OpenVINS reads rad/s and m/s^2, here");
    file.comment(&format!(
        "set imu_intrinsics_model: \"{name}\" in its estimator_config.yaml"
    ));
    biases(&mut file, &axes);
    file.line("imu0:");
    matrix(&mut file, "  Tw", &parts.gyro.0);
    matrix(&mut file, "  R_IMUtoGYRO", &parts.gyro.1);
    matrix(&mut file, "  Ta", &parts.accel.0);
    matrix(&mut file, "  R_IMUtoACC", &parts.accel.1);
    matrix(&mut file, "  Tg", &of_force);
    file.line("  time_offset: 0.0");
    noise(&mut file, source);
    file.finish()
}
