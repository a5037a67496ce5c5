//! IMU configuration for Kalibr, with intrinsics of its model `scale-misalignment`, and for OpenVINS.
//!
//! Source: Rehder et al., "Extending kalibr: calibrating the extrinsics of multiple IMUs and of individual axes", ICRA
//! 2016; Kalibr, `kalibr_common/ConfigReader.py`, `ImuParameters`, and `IccSensors.py`, `IccScaledMisalignedImu`;
//! OpenVINS, `VioManagerOptions::print_and_load_noise` and `print_and_load_state`, `StateOptions::print`,
//! `Propagator::predict_and_compute`, and `YamlParser::parse_external`, which reads with `cv::FileStorage`.

use nalgebra::Matrix3;

use super::notation::{list, number, rows};
use super::remarks::{Exported, Remarks, SIGMA};
use super::values::Values;
use turncal::calibration::result::frame::accelerometer_frame;
use turncal::imu::{PerSensor, Sensor, Term};
use turncal::units::ARCSEC;

/// Quantities that Kalibr and OpenVINS estimate themselves.
const BIASES: &str =
    "the biases: Kalibr estimates them itself, so no error remains; a comment lists their values";
const TOPIC: &str = "the rostopic of your recording, which you must enter in place of /imu0";

/// The model from true to measured values, in rad/s and m/s², is `a = M_a C_i_b f + b_a`, `ω = M_g C_gyro_i C_i_b ω_b +
/// A C_gyro_i C_i_b f + b_g`, with both `M` lower triangular and both `C` rotations. `C_i_b`, in `T_i_b`, rotates the
/// body frame of the calibration into the accelerometer axes, so K and E are represented completely.
pub fn kalibr(values: &Values) -> Exported {
    let PerSensor { gyro, accel } = &values.triads;
    let (m_accel, imu_b) = lower(&accel.sensitivity);
    let (m_gyro, gyro_imu) = lower(&(gyro.sensitivity * imu_b.transpose()));
    let of_force = gyro.sensitivity * values.g_sensitivity * (gyro_imu * imu_b).transpose();
    let (required, remarks) = configuration(values, "Kalibr", "");
    let text = format!(
        "\
{required}model: scale-misalignment
T_i_b:{}
time_offset: 0.0
gyroscopes:
  M:{}
  A:{}
  C_gyro_i:{}
accelerometers:
  M:{}
",
        rows(2, &imu_b.to_homogeneous()),
        rows(4, &m_gyro),
        rows(4, &of_force),
        rows(4, &gyro_imu),
        rows(4, &m_accel)
    );
    let equations = "accelerometers measure M C_i_b f + bias, gyroscopes M C_gyro_i C_i_b w + A C_gyro_i C_i_b f + \
    bias; Kalibr reads only the first six keys and starts from M = 1, A = 0, so give it the output of `turncal apply`";
    let frame = format!(
        "T_i_b rotates the body frame by {:.1} arcsec into the accelerometer axes; in a program that assumes the \
         identity, u is along the accelerometer axes",
        turncal::attitude::log(&imu_b).norm() / ARCSEC
    );
    remarks.defines([equations.to_owned(), frame]).above(&text)
}

/// Topic, rate and noise (required by both programs), each on a line after `indent`, and comments.
fn configuration<'a>(values: &'a Values<'a>, program: &str, indent: &str) -> (String, Remarks<'a>) {
    // cv::FileStorage treats a comment after an unquoted text as part of the text.
    let mut text = format!("{indent}rostopic: \"/imu0\"\n");
    let mut missing = Vec::new();
    let mut key = |name: String, value: Option<f64>, unit: &str| match value {
        Some(value) => text += &format!("{indent}{name}: {}  # {unit}\n", number(value)),
        None => missing.push(name),
    };
    key("update_rate".to_owned(), values.rate, "Hz");
    for (sensor, name) in [
        (Sensor::Accel, "accelerometer"),
        (Sensor::Gyro, "gyroscope"),
    ] {
        let (triad, unit) = (values.triads.get(sensor), Values::input(sensor));
        let density = format!("{unit}/sqrt(Hz)");
        key(format!("{name}_noise_density"), triad.density(), &density);
        let (walk, is_usual) = triad.varying().unzip();
        let usual = match is_usual {
            Some(true) => {
                ", the value that is usual for this noise density; measure the bias random walk with `turncal allan`"
            }
            _ => "",
        };
        let unit = format!("{unit}/s/sqrt(Hz){usual}");
        key(
            format!("{name}_random_walk"),
            walk.map(|bias| bias.walk()),
            &unit,
        );
    }
    let [gyro, accel] = Sensor::ALL.map(|sensor| list(&values.triads.get(sensor).bias));
    let remarks = Remarks::new(values, "#", &[BIASES, TOPIC, SIGMA])
        .including(|term| term == Term::GSensitivity)
        .omitting(Values::missing(&missing, program))
        .reads(&format!("{program} reads rad/s and m/s^2"))
        .defines([format!(
            "bias of the gyroscopes: {gyro}, of the accelerometers: {accel}"
        )]);
    (text, remarks)
}

/// A triangle and the rotation before it: `A = triangle · rotation`.
type Split = (Matrix3<f64>, Matrix3<f64>);

/// The split with a lower triangle of positive diagonal.
fn lower(a: &Matrix3<f64>) -> Split {
    let rotation = accelerometer_frame(a);
    let mut lower = a * rotation.transpose();
    // The entries above the diagonal are only rounding errors.
    lower.fill_upper_triangle(0.0, 1);
    (lower, rotation)
}

/// The split with an upper triangle of positive diagonal.
fn upper(a: &Matrix3<f64>) -> Split {
    let reverse = Matrix3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0);
    let rotation = reverse * accelerometer_frame(&(reverse * a * reverse)) * reverse;
    let mut upper = a * rotation.transpose();
    upper.fill_lower_triangle(0.0, 1);
    (upper, rotation)
}

pub fn open_vins_kalibr(values: &Values) -> Exported {
    open_vins(values, "kalibr", lower)
}

pub fn open_vins_rpng(values: &Values) -> Exported {
    open_vins(values, "rpng", upper)
}

/// From measured to true, in rad/s and m/s²: `a = R_IMUtoACCᵀ Ta⁻¹ (a_m − b_a)`,
/// `ω = R_IMUtoGYROᵀ Tw⁻¹ (ω_m − Tg a − b_g)`, with `Ta`, `Tw` lower triangular (`kalibr`) or upper (`rpng`): only
/// that triangle of their inverses is read. `Tg` acts on the corrected a along the IMU's axes, so it is what Kalibr
/// calls `A C_gyro_i`; the comment in OpenVINS' example files says otherwise.
fn open_vins(values: &Values, model: &str, split: fn(&Matrix3<f64>) -> Split) -> Exported {
    let gyro = &values.triads.gyro.sensitivity;
    let ((tw, imu_to_gyro), (ta, imu_to_acc)) =
        (split(gyro), split(&values.triads.accel.sensitivity));
    let (required, remarks) = configuration(values, "OpenVINS", "  ");
    let text = format!(
        "\
%YAML:1.0
{}imu0:
  model: \"{model}\"
{required}  time_offset: 0.0
  Tw:{}
  R_IMUtoGYRO:{}
  Ta:{}
  R_IMUtoACC:{}
  Tg:{}
",
        remarks.text(),
        rows(4, &tw),
        rows(4, &imu_to_gyro),
        rows(4, &ta),
        rows(4, &imu_to_acc),
        rows(4, &(gyro * values.g_sensitivity))
    );
    remarks.of_file(text.into_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_is_its_upper_triangle_times_a_rotation() {
        let a = Matrix3::new(1.1, 0.2, -0.3, 0.1, 0.9, 0.05, -0.2, 0.3, 1.2);
        let (u, r) = upper(&a);
        assert!((u * r - a).amax() < 1e-14);
        assert!((r * r.transpose() - Matrix3::identity()).amax() < 1e-14);
        assert!(r.determinant() > 0.0 && u.diagonal().min() > 0.0);
        assert_eq!([u[(1, 0)], u[(2, 0)], u[(2, 1)]], [0.0; 3]);
    }
}
