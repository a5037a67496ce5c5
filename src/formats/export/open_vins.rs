//! OpenVINS' IMU intrinsics, in its models `kalibr` and `rpng`.
//!
//! From measured to true, in rad/s and m/s²: `a = R_IMUtoACCᵀ Ta⁻¹ (a_m − b_a)`,
//! `ω = R_IMUtoGYROᵀ Tw⁻¹ (ω_m − Tg a − b_g)`, with `Ta`, `Tw` lower triangular (`kalibr`) or upper (`rpng`): only
//! that triangle of their inverses is read. `Tg` acts on the corrected a along the IMU's axes, so it is what Kalibr
//! calls `A C_gyro_i`; the comment in OpenVINS' example files says otherwise.
//!
//! Source: OpenVINS, `VioManagerOptions::print_and_load_state` and `Propagator::predict_and_compute`.

use nalgebra::Matrix3;

use super::Exported;
use super::along::{Along, upper};
use super::kalibr::{self, lower};
use super::source::{Document, Source, yaml_list};
use crate::calibration::result::frame::accelerometer_frame;
use crate::imu::{PerSensor, Sensor, Term};

/// Which triangle intrinsics are kept in.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Model {
    Kalibr,
    Rpng,
}

pub(super) fn write(source: &Source, model: Model) -> Exported {
    let along = Along::log(source);
    let parts = PerSensor::from_fn(|sensor| {
        let a = along.triads.get(sensor).sensitivity;
        match model {
            Model::Kalibr => {
                let rotation = accelerometer_frame(&a);
                (lower(a * rotation.transpose()), rotation)
            }
            Model::Rpng => upper(&a),
        }
    });
    let of_force = along.triads.gyro.sensitivity * along.g_sensitivity;
    let name = match model {
        Model::Kalibr => "kalibr",
        Model::Rpng => "rpng",
    };
    let notes = [
        "biases, which OpenVINS finds itself, so no error is left of them; they are in a comment"
            .to_owned(),
        "sigma and covariance of the parameters; they are in calibration.json".to_owned(),
    ];
    let mut file = Document::holding(source, "#", notes, |term| term == Term::GSensitivity);
    file.begin("%YAML:1.0");
    along.introduce(&mut file, "OpenVINS reads rad/s and m/s^2, here");
    file.comment(&format!(
        "set imu_intrinsics_model: \"{name}\" in its estimator_config.yaml"
    ));
    for (name, sensor) in [
        ("gyroscopes", Sensor::Gyro),
        ("accelerometers", Sensor::Accel),
    ] {
        let bias = along.triads.get(sensor).bias;
        file.comment(&format!("bias of {name}: {}", yaml_list(&bias)));
    }
    file.line("imu0:");
    matrix(&mut file, "Tw", &parts.gyro.0);
    matrix(&mut file, "R_IMUtoGYRO", &parts.gyro.1);
    matrix(&mut file, "Ta", &parts.accel.0);
    matrix(&mut file, "R_IMUtoACC", &parts.accel.1);
    matrix(&mut file, "Tg", &of_force);
    file.line("  time_offset: 0.0");
    kalibr::noise(&mut file, source);
    file.finish()
}

fn matrix(file: &mut Document, name: &str, matrix: &Matrix3<f64>) {
    file.line(&format!("  {name}:"));
    for row in matrix.row_iter() {
        let row: Vec<f64> = row.iter().copied().collect();
        file.line(&format!("  - {}", yaml_list(&row)));
    }
}
