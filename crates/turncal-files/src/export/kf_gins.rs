//! IMU section of a KF-GINS configuration.
//!
//! The model from true to measured values, along the front, right and down axes, is `n = (1 + s) u + b` axis by axis,
//! with b in °/h and mGal, s in ppm. KF-GINS corrects by `u = (n − b) / (1 + s)`.
//!
//! Source: the KF-GINS configuration file and its IMU compensation (GIEngine, i2Nav, Wuhan University).

use nalgebra::{Matrix3, Vector3};

use super::notation::{list, number};
use super::remarks::{Exported, Remarks};
use super::values::{Normalised, Values};
use turncal::imu::{PerSensor, Sensor};
use turncal::units::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, HOUR, MILLIGAL, PPM};

/// One m/s/√h in (m/s)/√s.
const M_PER_S_PER_SQRT_H: f64 = 1.0 / 60.0;

pub fn write(values: &Values) -> Exported {
    // `A_ij / A_ii`, the part of the input along another axis that remains in the output.
    let misalignment = PerSensor::from_fn(|sensor| {
        let a = values.triads.get(sensor).sensitivity;
        Matrix3::from_fn(|i, j| if i == j { 0.0 } else { a[(i, j)] / a[(i, i)] })
    });
    let [gyros, accelerometers] = Sensor::ALL.map(|sensor| {
        let tilt = misalignment.get(sensor).amax();
        format!("{:.1} arcsec ({:.1} ppm)", tilt / ARCSEC, tilt / PPM)
    });
    let omissions: [&str; 3] = [
        &format!(
            "misalignment: up to {gyros} (gyros) and {accelerometers} (accelerometers) remain in the data; if this \
             error is too large, give KF-GINS the output of `turncal apply` with zero bias and scale"
        ),
        "sigma of the misalignment, and the covariance; both are in calibration.json",
        "gsstd and asstd of imunoise, which KF-GINS requires: the variation of the scale factors in ppm, as stated in \
         the data sheet",
    ];
    let PerSensor { gyro, accel } = &values.triads;
    let error = |triad: &Normalised| triad.sensitivity.diagonal().add_scalar(-1.0);
    let (mut unstated, mut missing) = (Vec::new(), Vec::new());
    let [sigma, noise] = [sigma(values, &mut unstated), noise(values, &mut missing)];
    let unstated = (!unstated.is_empty()).then(|| {
        let names = unstated.join(", ");
        format!("{names}: the calibration does not state sigma for all axes, so KF-GINS uses the value of imunoise")
    });
    let text = format!(
        "\
initgyrbias: {}  # deg/h
initaccbias: {}  # mGal
initgyrscale: {}  # ppm
initaccscale: {}  # ppm
{sigma}{noise}",
        list(&(gyro.bias / DEG_PER_H)),
        list(&(accel.bias / MILLIGAL)),
        list(&(error(gyro) / PPM)),
        list(&(error(accel) / PPM))
    );
    let sigma = "init...std: 1 sigma of the calibration; increase the value if the biases change at switch-on";
    Remarks::new(values, "#", &omissions)
        .omitting(unstated)
        .omitting(Values::missing(&missing, "KF-GINS"))
        .reads("KF-GINS reads rad and m/s per sample")
        .defines([sigma.to_owned()])
        .above(&text)
}

/// 1σ of the initial values; `unstated` receives the names of values that the calibration does not state for all axes.
fn sigma(values: &Values, unstated: &mut Vec<&str>) -> String {
    let PerSensor { gyro, accel } = &values.triads;
    let all = [
        ("initbgstd", gyro.bias_sigma, DEG_PER_H, "deg/h"),
        ("initbastd", accel.bias_sigma, MILLIGAL, "mGal"),
        ("initsgstd", gyro.scale_sigma, PPM, "ppm"),
        ("initsastd", accel.scale_sigma, PPM, "ppm"),
    ];
    let lines = all.map(|(key, sigma, unit, name)| {
        match sigma.filter(|sigma: &Vector3<f64>| sigma.min() > 0.0) {
            Some(sigma) => format!("{key}: {}  # {name}\n", list(&(sigma / unit))),
            None => {
                unstated.push(key);
                String::new()
            }
        }
    });
    lines.concat()
}

/// Noise, if the white noise of both triads is known; otherwise `missing` receives all its names.
fn noise(values: &Values, missing: &mut Vec<String>) -> String {
    let PerSensor { gyro, accel } = &values.triads;
    let of = |triad: &Normalised| triad.density().zip(triad.varying());
    let Some(((arw, (g, g_is_usual)), (vrw, (a, a_is_usual)))) = of(gyro).zip(of(accel)) else {
        missing.extend(["arw", "vrw", "gbstd", "abstd", "corrtime"].map(str::to_owned));
        return String::new();
    };
    let line = |name: &str, value: f64, unit: f64, unit_name: &str, is_usual: bool| {
        let usual = if is_usual {
            ", the value that is usual for this white noise"
        } else {
            ""
        };
        format!(
            "  {name}: {}  # {unit_name}{usual}\n",
            list(&[value / unit; 3])
        )
    };
    let time = match (g_is_usual, a_is_usual) {
        (false, true) => g.correlation_time,
        (true, false) => a.correlation_time,
        _ => g.correlation_time.min(a.correlation_time),
    };
    [
        "imunoise:\n",
        &line("arw", arw, DEG_PER_SQRT_H, "deg/sqrt(h)", false),
        &line("vrw", vrw, M_PER_S_PER_SQRT_H, "m/s/sqrt(h)", false),
        &line("gbstd", g.sigma, DEG_PER_H, "deg/h", g_is_usual),
        &line("abstd", a.sigma, MILLIGAL, "mGal", a_is_usual),
        &format!(
            "  corrtime: {}  # h, one value for all; the shorter of gyros and accelerometers\n",
            number(time / HOUR)
        ),
    ]
    .concat()
}
