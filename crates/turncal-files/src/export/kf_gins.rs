//! IMU section of a KF-GINS configuration.
//!
//! Along front, right, down, from true to measured: `n = (1 + s) u + b` axis by axis, with b in °/h and mGal, s in ppm.
//! KF-GINS corrects by `u = (n − b) / (1 + s)`.
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
    let omissions: [&str; 2] = [
        &format!(
            "misalignment: up to {gyros} (gyros) and {accelerometers} (accelerometers) remain in the data; if that is \
             too much, give KF-GINS the output of `turncal apply` with zero bias and scale"
        ),
        "sigma of misalignment, and covariance; they are in calibration.json",
    ];
    let lost = Sensor::ALL.into_iter().flat_map(|sensor| {
        let rows = misalignment.get(sensor).row_iter();
        rows.zip(["front", "right", "down"])
            .map(move |(row, axis)| {
                let [x, y, z] = [row[0], row[1], row[2]].map(|part| part / ARCSEC);
                let name = sensor.name();
                format!("lost, {name} {axis}: {x:.3} {y:.3} {z:.3} arcsec of front, right, down")
            })
    });
    let PerSensor { gyro, accel } = &values.triads;
    let error = |triad: &Normalised| triad.sensitivity.diagonal().add_scalar(-1.0);
    let text = format!(
        "\
# front, right, down:
initgyrbias: {}  # deg/h
initaccbias: {}  # mGal
initgyrscale: {}  # ppm
initaccscale: {}  # ppm
# 1 sigma of the calibration; increase it if biases change at switch-on
{}{}",
        list(&(gyro.bias / DEG_PER_H)),
        list(&(accel.bias / MILLIGAL)),
        list(&(error(gyro) / PPM)),
        list(&(error(accel) / PPM)),
        sigma(values),
        noise(values)
    );
    Remarks::new(values, "#", &omissions)
        .reads("KF-GINS reads rad and m/s per sample,")
        .defines(lost)
        .above(&text)
}

fn sigma(values: &Values) -> String {
    let PerSensor { gyro, accel } = &values.triads;
    let line = |key: &str, sigma: Option<Vector3<f64>>, unit: f64, name: &str| match sigma
        .filter(|sigma| sigma.min() > 0.0)
    {
        Some(sigma) => format!("{key}: {}  # {name}\n", list(&(sigma / unit))),
        None => format!("# {key}: the calibration does not state sigma for all three axes\n"),
    };
    [
        line("initbgstd", gyro.bias_sigma, DEG_PER_H, "deg/h"),
        line("initbastd", accel.bias_sigma, MILLIGAL, "mGal"),
        line("initsgstd", gyro.scale_sigma, PPM, "ppm"),
        line("initsastd", accel.scale_sigma, PPM, "ppm"),
    ]
    .concat()
}

fn noise(values: &Values) -> String {
    let missing = values.no_noise();
    let PerSensor { gyro, accel } = &values.triads;
    let line = |name: &str, value: Option<f64>, unit: f64, unit_name: &str| match value {
        Some(value) => format!("  {name}: {}  # {unit_name}\n", list(&[value / unit; 3])),
        None => format!("#  {name}: [ , , ]  # {unit_name}: {missing}\n"),
    };
    let varying = |triad: &Normalised| triad.varying().map(|bias| bias.sigma);
    let times = [gyro, accel].into_iter().filter_map(Normalised::varying);
    let shortest = times.map(|bias| bias.correlation_time).reduce(f64::min);
    let correlation = match shortest {
        Some(time) => format!(
            "  corrtime: {}  # h, one value for all; the shorter of gyros and accelerometers\n",
            number(time / HOUR)
        ),
        None => format!("#  corrtime:   # h: {missing}\n"),
    };
    // A key without children is not a mapping, so without figures it becomes a comment too.
    let key = if values.period.is_some() {
        "imunoise:\n"
    } else {
        "# imunoise:\n"
    };
    [
        key,
        &line("arw", gyro.density(), DEG_PER_SQRT_H, "deg/sqrt(h)"),
        &line("vrw", accel.density(), M_PER_S_PER_SQRT_H, "m/s/sqrt(h)"),
        &line("gbstd", varying(gyro), DEG_PER_H, "deg/h"),
        &line("abstd", varying(accel), MILLIGAL, "mGal"),
        "#  gsstd: [ , , ]  # ppm: 1σ of scale-factor variation, from the data sheet\n",
        "#  asstd: [ , , ]  # ppm: the same\n",
        &correlation,
    ]
    .concat()
}
