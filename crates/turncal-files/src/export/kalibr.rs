//! IMU intrinsics for Kalibr, model `scale-misalignment`, and for OpenVINS.
//!
//! Source: Rehder et al., "Extending kalibr: calibrating the extrinsics of multiple IMUs and of individual axes", ICRA
//! 2016; OpenVINS, `VioManagerOptions::print_and_load_state` and `Propagator::predict_and_compute`.

use nalgebra::Matrix3;

use super::notation::{list, number, rows};
use super::remarks::{Exported, Remarks, SIGMA};
use super::values::Values;
use turncal::calibration::result::frame::accelerometer_frame;
use turncal::imu::{PerSensor, Sensor, Term};
use turncal::units::ARCSEC;

/// Quantities that Kalibr and OpenVINS estimate themselves.
const BIASES: &str =
    "biases, which it estimates itself, so they leave no error; a comment lists them";

/// From true to measured, in rad/s and m/s²: `a = M_a C_i_b f + b_a`,
/// `ω = M_g C_gyro_i C_i_b ω_b + A C_gyro_i C_i_b f + b_g`, with both `M` lower triangular and both `C` rotations.
/// `C_i_b`, in `T_i_b`, rotates the body frame of the calibration into the accelerometer axes, so K and E are
/// represented completely.
pub fn kalibr(values: &Values) -> Exported {
    let PerSensor { gyro, accel } = &values.triads;
    let (m_accel, imu_b) = lower(&accel.sensitivity);
    let (m_gyro, gyro_imu) = lower(&(gyro.sensitivity * imu_b.transpose()));
    let of_force = gyro.sensitivity * values.g_sensitivity * (gyro_imu * imu_b).transpose();
    let remarks = with_biases(values, "Kalibr");
    let text = format!(
        "\
# measured = M C_i_b f + bias
# measured = M C_gyro_i C_i_b w + A C_gyro_i C_i_b f + bias
# T_i_b rotates the body frame above into the accelerometer axes, {:.1} arcsec away; a program that assumes the \
identity gets u along those axes
{}imu0:
  model: scale-misalignment
  T_i_b:{}
  time_offset: 0.0
  gyroscopes:
    M:{}
    A:{}
    C_gyro_i:{}
  accelerometers:
    M:{}
{}",
        turncal::attitude::log(&imu_b).norm() / ARCSEC,
        biases(values),
        rows(2, &imu_b.to_homogeneous()),
        rows(4, &m_gyro),
        rows(4, &of_force),
        rows(4, &gyro_imu),
        rows(4, &m_accel),
        noise(values)
    );
    remarks.above(&text)
}

fn with_biases<'a>(values: &'a Values, program: &str) -> Remarks<'a> {
    Remarks::new(values, "#", &[BIASES, SIGMA])
        .including(|term| term == Term::GSensitivity)
        .reads(&format!("{program} reads rad/s and m/s^2, here"))
}

fn biases(values: &Values) -> String {
    let [gyro, accel] = Sensor::ALL.map(|sensor| list(&values.triads.get(sensor).bias));
    format!("# bias of gyroscopes: {gyro}\n# bias of accelerometers: {accel}\n")
}

fn noise(values: &Values) -> String {
    let key = |name: &str, value: Option<f64>, unit: &str| match value {
        Some(value) => format!("  {name}: {}  # {unit}\n", number(value)),
        None => format!("  # {name}:   # {unit}: {}\n", values.no_noise()),
    };
    let triad = |sensor, name: &str| {
        let (triad, unit) = (values.triads.get(sensor), Values::input(sensor));
        let walk = triad.varying().map(|bias| bias.walk());
        let key = |what: &str, value, unit: String| key(&format!("{name}_{what}"), value, &unit);
        key("noise_density", triad.density(), format!("{unit}/sqrt(Hz)"))
            + &key("random_walk", walk, format!("{unit}/s/sqrt(Hz)"))
    };
    triad(Sensor::Gyro, "gyroscope")
        + &triad(Sensor::Accel, "accelerometer")
        + &key("update_rate", values.period.map(f64::recip), "Hz")
        + "  # rostopic: /imu0  # the topic of your recording\n"
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
    let remarks = with_biases(values, "OpenVINS");
    let text = format!(
        "\
%YAML:1.0
{}# set imu_intrinsics_model: \"{model}\" in its estimator_config.yaml
{}imu0:
  Tw:{}
  R_IMUtoGYRO:{}
  Ta:{}
  R_IMUtoACC:{}
  Tg:{}
  time_offset: 0.0
{}",
        remarks.text(),
        biases(values),
        rows(2, &tw),
        rows(2, &imu_to_gyro),
        rows(2, &ta),
        rows(2, &imu_to_acc),
        rows(2, &(gyro * values.g_sensitivity)),
        noise(values)
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
