//! The part of a KF-GINS configuration that is about the IMU.
//!
//! Along front, right, down, from true to measured: `n = (1 + s) u + b` axis by axis, with b in °/h
//! and mGal, s in ppm. It is taken out as `u = (n − b) / (1 + s)`.
//!
//! Source: the KF-GINS configuration file and its IMU compensation (GIEngine, i2Nav, Wuhan
//! University).

use nalgebra::{Matrix3, Vector3};

use super::Exported;
use super::source::{Document, Normalised, Source, divide, yaml_list, yaml_number};
use crate::calibration::result::TriadRecord;
use crate::imu::{PerSensor, Sensor};
use crate::units::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, PPM};

/// One milligal in m/s².
const MILLIGAL: f64 = 1e-5;
/// One m/s/√h in (m/s)/√s.
const M_PER_S_PER_SQRT_H: f64 = 1.0 / 60.0;
const HOUR: f64 = 3600.0;

/// A triad along front, right, down.
struct FrontRightDown {
    scale_error: Vector3<f64>,
    bias: Vector3<f64>,
    /// `A_ij / A_ii`, the part of another axis' input that stays in the output, pure number.
    misalignment: Matrix3<f64>,
}

impl FrontRightDown {
    fn new(triad: &Normalised) -> Self {
        let turn = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
        let a = turn * triad.sensitivity * turn.transpose();
        Self {
            scale_error: a.diagonal().add_scalar(-1.0),
            bias: turn * triad.bias,
            misalignment: Matrix3::from_fn(|i, j| if i == j { 0.0 } else { a[(i, j)] / a[(i, i)] }),
        }
    }
}

/// Values of right, front, up without a sign, as front, right, down.
fn reordered(values: Vector3<f64>) -> [f64; 3] {
    [values.y, values.x, values.z]
}

pub(super) fn write(source: &Source) -> Exported {
    let normalised = PerSensor::from_fn(|sensor| source.normalised(sensor));
    let triads = PerSensor::from_fn(|sensor| FrontRightDown::new(normalised.get(sensor)));
    let largest = |sensor| {
        let tilt = triads.get(sensor).misalignment.amax();
        format!("{:.1} arcsec ({:.1} ppm)", tilt / ARCSEC, tilt / PPM)
    };
    let lost = format!(
        "misalignment: up to {} of the gyros, {} of the accelerometers stay in the data; where that \
         is too much give KF-GINS what `turncal apply` writes, and zero bias and scale",
        largest(Sensor::Gyro),
        largest(Sensor::Accel)
    );
    let notes = [
        lost,
        "sigma of misalignment, and covariance; they are in calibration.json".to_owned(),
    ];
    let mut file = Document::holding(source, "#", notes, |_| false);
    file.comment("");
    let nominal = PerSensor::from_fn(|sensor| reordered(normalised.get(sensor).nominal));
    file.comment("KF-GINS reads rad and m/s a sample, along front, right, down;");
    file.comment(&divide(&nominal));
    for sensor in Sensor::ALL {
        for (axis, row) in ["front", "right", "down"]
            .iter()
            .zip(triads.get(sensor).misalignment.row_iter())
        {
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
    let PerSensor { gyro, accel } = &triads;
    for (key, values, unit, name) in [
        ("initgyrbias", gyro.bias, DEG_PER_H, "deg/h"),
        ("initaccbias", accel.bias, MILLIGAL, "mGal"),
        ("initgyrscale", gyro.scale_error, PPM, "ppm"),
        ("initaccscale", accel.scale_error, PPM, "ppm"),
    ] {
        file.line(&format!("{key}: {}  # {name}", yaml_list(&(values / unit))));
    }
    sigma(&mut file, source, &normalised);
    noise(&mut file, source);
    file.finish()
}

fn sigma(file: &mut Document, source: &Source, normalised: &PerSensor<Normalised>) {
    file.comment(
        "1 sigma of the calibration; biases that change from switch-on to switch-on need more",
    );
    let of = |sensor, values: fn(&TriadRecord) -> [f64; 3]| {
        let sigma = source.record.sigma.as_ref()?.get(sensor);
        let nominal = normalised.get(sensor).nominal;
        let sigma = Vector3::from(values(sigma)).component_div(&nominal.abs());
        sigma.iter().all(|&s| s > 0.0).then(|| reordered(sigma))
    };
    for (key, sensor, values, unit, name) in [
        (
            "initbgstd",
            Sensor::Gyro,
            bias as fn(&TriadRecord) -> [f64; 3],
            DEG_PER_H,
            "deg/h",
        ),
        ("initbastd", Sensor::Accel, bias, MILLIGAL, "mGal"),
        ("initsgstd", Sensor::Gyro, scale, PPM, "ppm"),
        ("initsastd", Sensor::Accel, scale, PPM, "ppm"),
    ] {
        match of(sensor, values) {
            Some(sigma) => {
                file.line(&format!(
                    "{key}: {}  # {name}",
                    yaml_list(&sigma.map(|s| s / unit))
                ));
            }
            None => file.comment(&format!(
                "{key}: the calibration states no sigma of all three"
            )),
        }
    }
}

fn bias(sigma: &TriadRecord) -> [f64; 3] {
    sigma.bias
}

fn scale(sigma: &TriadRecord) -> [f64; 3] {
    sigma.scale
}

fn noise(file: &mut Document, source: &Source) {
    let missing = match source.run {
        Some(_) => "[imu.noise] of the run does not state it",
        None => "`turncal allan` finds it; or export with --run RUN.toml",
    };
    // A key without children is no mapping, so without figures it is a comment, too.
    file.line(if source.run.is_some() {
        "imunoise:"
    } else {
        "# imunoise:"
    });
    let noise = source.run.map(|run| run.instrument.noise);
    let bias = |sensor| {
        noise
            .as_ref()
            .and_then(|noise| noise.get(sensor).gauss_markov)
    };
    let mut key = |name: &str, value: Option<f64>, unit: &str| match value {
        Some(value) => {
            file.line(&format!("  {name}: {}  # {unit}", yaml_list(&[value; 3])));
        }
        None => file.line(&format!("#  {name}: [ , , ]  # {unit}: {missing}")),
    };
    let walk = |sensor, unit| {
        noise
            .as_ref()
            .map(|noise| noise.get(sensor).random_walk / unit)
    };
    key("arw", walk(Sensor::Gyro, DEG_PER_SQRT_H), "deg/sqrt(h)");
    key(
        "vrw",
        walk(Sensor::Accel, M_PER_S_PER_SQRT_H),
        "m/s/sqrt(h)",
    );
    let sigma = |sensor, unit: f64| bias(sensor).map(|bias| bias.sigma / unit);
    key("gbstd", sigma(Sensor::Gyro, DEG_PER_H), "deg/h");
    key("abstd", sigma(Sensor::Accel, MILLIGAL), "mGal");
    file.line("#  gsstd: [ , , ]  # ppm: 1σ by which scale factors vary, from the data sheet");
    file.line("#  asstd: [ , , ]  # ppm: the same");
    let times = Sensor::ALL.map(bias).into_iter().flatten();
    match times.map(|bias| bias.correlation_time).reduce(f64::min) {
        Some(time) => file.line(&format!(
            "  corrtime: {}  # h, one for all; the shorter of gyros and accelerometers",
            yaml_number(time / HOUR)
        )),
        None => file.line(&format!("#  corrtime:   # h: {missing}")),
    }
}
