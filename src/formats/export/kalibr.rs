//! Kalibr's IMU intrinsics, model `scale-misalignment`.
//!
//! From true to measured, in rad/s and m/s²: `a = M_a C_i_b f + b_a`,
//! `ω = M_g C_gyro_i C_i_b ω_b + A C_gyro_i C_i_b f + b_g`, with both `M` lower triangular and both
//! `C` rotations. `C_i_b`, in `T_i_b`, takes the body frame of the calibration to the axes of the
//! accelerometers, so nothing of K and E is lost.
//!
//! Source: Rehder et al., "Extending kalibr: calibrating the extrinsics of multiple IMUs and of
//! individual axes", ICRA 2016; the keys are those of Kalibr's IMU chain files.

use nalgebra::{Matrix3, Vector3};

use super::Exported;
use super::source::{Document, Source, divide, yaml_list, yaml_number};
use crate::calibration::result::frame::accelerometer_frame;
use crate::imu::{Noise, PerSensor, Sensor, Term};
use crate::units::ARCSEC;

pub(super) fn write(source: &Source) -> Exported {
    let triads = PerSensor::from_fn(|sensor| source.normalised(sensor));
    let imu_b = accelerometer_frame(&triads.accel.sensitivity);
    let gyro = triads.gyro.sensitivity * imu_b.transpose();
    let gyro_imu = accelerometer_frame(&gyro);
    let matrices = PerSensor {
        gyro: lower(gyro * gyro_imu.transpose()),
        accel: lower(triads.accel.sensitivity * imu_b.transpose()),
    };
    let q = Term::GSensitivity.parameters().start;
    let q = Matrix3::from_fn(|i, j| source.correction.terms[q + 3 * i + j]);
    let of_force = triads.gyro.sensitivity * q * (gyro_imu * imu_b).transpose();

    let notes = [
        "biases, which Kalibr finds itself; they are in a comment".to_owned(),
        "sigma and covariance of the parameters; they are in calibration.json".to_owned(),
    ];
    let mut file = Document::holding(source, "#", notes, |term| term == Term::GSensitivity);
    file.comment("");
    file.comment("Kalibr reads rad/s and m/s^2;");
    let nominal = PerSensor::from_fn(|sensor| triads.get(sensor).nominal.into());
    file.comment(&divide(&nominal));
    file.comment("measured = M C_i_b f + bias");
    file.comment("measured = M C_gyro_i C_i_b w + A C_gyro_i C_i_b f + bias");
    let turned = turn(&imu_b) / ARCSEC;
    file.comment(&format!(
        "T_i_b takes the body frame above to the axes of the accelerometers, {turned:.1} arcsec \
         away; what takes it for the identity gets u along those"
    ));
    for (name, sensor) in [
        ("gyroscopes", Sensor::Gyro),
        ("accelerometers", Sensor::Accel),
    ] {
        let bias = triads.get(sensor).bias;
        file.comment(&format!("bias of {name}: {}", yaml_list(&bias)));
    }
    file.line("imu0:\n  model: scale-misalignment\n  T_i_b:");
    for i in 0..4 {
        let of_rotation = |j| {
            if i < 3 && j < 3 {
                imu_b[(i, j)]
            } else {
                f64::from(u8::from(i == j))
            }
        };
        file.line(&format!(
            "  - {}",
            yaml_list(&[0, 1, 2, 3].map(of_rotation))
        ));
    }
    file.line("  time_offset: 0.0\n  gyroscopes:");
    matrix(&mut file, "M", &matrices.gyro);
    matrix(&mut file, "A", &of_force);
    matrix(&mut file, "C_gyro_i", &gyro_imu);
    file.line("  accelerometers:");
    matrix(&mut file, "M", &matrices.accel);
    noise(&mut file, source);
    file.finish()
}

/// Above the diagonal there is only rounding.
pub(super) fn lower(mut matrix: Matrix3<f64>) -> Matrix3<f64> {
    matrix.fill_upper_triangle(0.0, 1);
    matrix
}

/// Angle of a rotation, rad.
fn turn(rotation: &Matrix3<f64>) -> f64 {
    crate::attitude::log(rotation).norm()
}

fn matrix(file: &mut Document, name: &str, matrix: &Matrix3<f64>) {
    file.line(&format!("    {name}:"));
    for i in 0..3 {
        let row: Vector3<f64> = matrix.row(i).transpose();
        file.line(&format!("    - {}", yaml_list(&row)));
    }
}

pub(super) fn noise(file: &mut Document, source: &Source) {
    let missing = match source.run {
        Some(_) => "[imu.noise] of the run does not state it",
        None => "`turncal allan` finds it; or export with --run RUN.toml",
    };
    let mut key = |name: &str, value: Option<f64>, unit: &str| match value {
        Some(value) => file.line(&format!("  {name}: {}  # {unit}", yaml_number(value))),
        None => file.line(&format!("  # {name}:   # {unit}: {missing}")),
    };
    for (name, sensor, unit) in [
        ("gyroscope", Sensor::Gyro, "rad/s"),
        ("accelerometer", Sensor::Accel, "m/s^2"),
    ] {
        let noise: Option<&Noise> = source.run.map(|run| run.instrument.noise.get(sensor));
        // Over times short against its correlation time a Gauss–Markov bias walks like this.
        let walk = noise
            .and_then(|noise| noise.gauss_markov)
            .map(|bias| bias.sigma * (2.0 / bias.correlation_time).sqrt());
        let density = noise.map(|noise| noise.random_walk);
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
