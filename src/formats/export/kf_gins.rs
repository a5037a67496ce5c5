//! IMU section of a KF-GINS configuration.
//!
//! Along front, right, down, from true to measured: `n = (1 + s) u + b` axis by axis, with b in °/h and mGal, s in ppm.
//! It is corrected as `u = (n − b) / (1 + s)`.
//!
//! Source: the KF-GINS configuration file and its IMU compensation (GIEngine, i2Nav, Wuhan
//! University).

use nalgebra::{Matrix3, Vector3};

use super::Exported;
use super::document::{Document, yaml_list, yaml_number};
use super::source::{Axes, Normalised, Source};
use crate::imu::{PerSensor, Sensor};
use crate::units::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, PPM};

/// One milligal in m/s².
const MILLIGAL: f64 = 1e-5;
/// One m/s/√h in (m/s)/√s.
const M_PER_S_PER_SQRT_H: f64 = 1.0 / 60.0;
const HOUR: f64 = 3600.0;

pub fn write(source: &Source) -> Exported {
    let axes = Axes::front_right_down(source);
    // `A_ij / A_ii`, the part of another axis' input that stays in the output.
    let misalignment = PerSensor::from_fn(|sensor| {
        let a = axes.triads.get(sensor).sensitivity;
        Matrix3::from_fn(|i, j| if i == j { 0.0 } else { a[(i, j)] / a[(i, i)] })
    });
    let largest = |sensor| {
        let tilt = misalignment.get(sensor).amax();
        format!("{:.1} arcsec ({:.1} ppm)", tilt / ARCSEC, tilt / PPM)
    };
    let lost = format!(
        "misalignment: up to {} (gyros) and {} (accelerometers) remain in the data; if that is too much, give \
         KF-GINS the output of `turncal apply` with zero bias and scale",
        largest(Sensor::Gyro),
        largest(Sensor::Accel)
    );
    let notes = [
        lost,
        "sigma of misalignment, and covariance; they are in calibration.json".to_owned(),
    ];
    let mut file = Document::holding(source, "#", notes, |_| false);
    axes.introduce(&mut file, "KF-GINS reads rad and m/s per sample,");
    for sensor in Sensor::ALL {
        let rows = misalignment.get(sensor).row_iter();
        for (axis, row) in ["front", "right", "down"].iter().zip(rows) {
            let row: Vector3<f64> = row.transpose() / ARCSEC;
            file.comment(&format!(
                "lost, {} {axis}: {:.3} {:.3} {:.3} arcsec of front, right, down",
                sensor.name(),
                row.x,
                row.y,
                row.z
            ));
        }
    }
    file.comment("front, right, down:");
    let PerSensor { gyro, accel } = &axes.triads;
    let error = |triad: &Normalised| triad.sensitivity.diagonal().add_scalar(-1.0);
    for (key, values, unit, name) in [
        ("initgyrbias", gyro.bias, DEG_PER_H, "deg/h"),
        ("initaccbias", accel.bias, MILLIGAL, "mGal"),
        ("initgyrscale", error(gyro), PPM, "ppm"),
        ("initaccscale", error(accel), PPM, "ppm"),
    ] {
        file.line(&format!("{key}: {}  # {name}", yaml_list(&(values / unit))));
    }
    sigma(&mut file, source, &axes);
    noise(&mut file, source);
    file.finish()
}

fn sigma(file: &mut Document, source: &Source, axes: &Axes) {
    file.comment("1 sigma of the calibration; increase it if biases change at switch-on");
    for (key, sensor, is_bias, unit, name) in [
        ("initbgstd", Sensor::Gyro, true, DEG_PER_H, "deg/h"),
        ("initbastd", Sensor::Accel, true, MILLIGAL, "mGal"),
        ("initsgstd", Sensor::Gyro, false, PPM, "ppm"),
        ("initsastd", Sensor::Accel, false, PPM, "ppm"),
    ] {
        let nominal = axes.triads.get(sensor).nominal;
        let sigma = source.sigma(sensor).map(|sigma| {
            let of = if is_bias { sigma.bias } else { sigma.scale };
            Vector3::from_fn(|k, _| of[axes.axis_of_record(k)] / nominal[k].abs() / unit)
        });
        match sigma.filter(|sigma| sigma.iter().all(|&s| s > 0.0)) {
            Some(sigma) => file.line(&format!("{key}: {}  # {name}", yaml_list(&sigma))),
            None => file.comment(&format!(
                "{key}: the calibration does not state sigma for all three axes"
            )),
        }
    }
}

fn noise(file: &mut Document, source: &Source) {
    let missing = source.no_noise();
    // A key without children is no mapping, so without figures it is a comment, too.
    file.line(match source.run {
        Some(_) => "imunoise:",
        None => "# imunoise:",
    });
    let walk = |sensor, unit: f64| source.noise(sensor).map(|noise| noise.random_walk / unit);
    let sigma = |sensor, unit: f64| source.varying(sensor).map(|bias| bias.sigma / unit);
    for (name, value, unit) in [
        ("arw", walk(Sensor::Gyro, DEG_PER_SQRT_H), "deg/sqrt(h)"),
        (
            "vrw",
            walk(Sensor::Accel, M_PER_S_PER_SQRT_H),
            "m/s/sqrt(h)",
        ),
        ("gbstd", sigma(Sensor::Gyro, DEG_PER_H), "deg/h"),
        ("abstd", sigma(Sensor::Accel, MILLIGAL), "mGal"),
    ] {
        file.line(&match value {
            Some(value) => format!("  {name}: {}  # {unit}", yaml_list(&[value; 3])),
            None => format!("#  {name}: [ , , ]  # {unit}: {missing}"),
        });
    }
    file.line("#  gsstd: [ , , ]  # ppm: 1σ of scale-factor variation, from the data sheet");
    file.line("#  asstd: [ , , ]  # ppm: the same");
    let times = Sensor::ALL
        .iter()
        .filter_map(|&sensor| source.varying(sensor));
    let shortest = times.map(|bias| bias.correlation_time).reduce(f64::min);
    file.line(&match shortest {
        Some(time) => format!(
            "  corrtime: {}  # h, one value for all; the shorter of gyros and accelerometers",
            yaml_number(time / HOUR)
        ),
        None => format!("#  corrtime:   # h: {missing}"),
    });
}
