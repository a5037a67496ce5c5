//! K, E and D with their σ: as arrays, and as a table for notebooks, which may not show frames.

use std::fmt::Write;

use nalgebra::Matrix3;
use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use turncal::calibration::result::TriadRecord;
use turncal::imu::{AXES, PerSensor, Sensor};

use crate::calibration::{Calibration, digits};

/// A vector of each sensor as arrays of Python.
pub fn vectors<'py>(
    py: Python<'py>,
    of: impl Fn(Sensor) -> [f64; 3],
) -> PyResult<Bound<'py, PyAny>> {
    let array = |sensor| PyArray1::from_slice(py, &of(sensor)).into_any();
    per_sensor(py, Sensor::ALL.map(array))
}

/// A matrix of each sensor as arrays of Python.
pub fn matrices<'py>(py: Python<'py>, of: &PerSensor<Matrix3<f64>>) -> PyResult<Bound<'py, PyAny>> {
    let array = |sensor| {
        let of = of.get(sensor);
        matrix(py, &of.transpose().data.0).into_any()
    };
    per_sensor(py, Sensor::ALL.map(array))
}

/// A matrix, given by its rows, as an array of Python.
pub fn matrix<'py>(py: Python<'py>, rows: &[[f64; 3]; 3]) -> Bound<'py, PyArray2<f64>> {
    PyArray2::from_owned_array(py, Array2::from(rows.to_vec()))
}

fn per_sensor<'py>(py: Python<'py>, of: [Bound<'py, PyAny>; 2]) -> PyResult<Bound<'py, PyAny>> {
    let frames = py.import("turncal._frames")?;
    let [gyro, accel] = of;
    frames.call_method1("PerSensor", (gyro, accel))
}

/// A table of each sensor in HTML, with an axis a row.
pub fn html(calibration: &Calibration) -> String {
    let record = &calibration.record;
    let mut html = String::new();
    for sensor in Sensor::ALL {
        let unit = |name| {
            calibration
                .unit(&format!("{}.{name}", sensor.name()))
                .replace('<', "&lt;")
        };
        let heads = [
            format!("{}s", sensor.name()),
            format!("K ± 1σ, {}", unit("scale")),
            format!("D ± 1σ, {}", unit("bias")),
        ];
        html += "<table><thead><tr>";
        for head in heads {
            let _ = write!(html, "<th>{head}</th>");
        }
        html += "<th colspan=\"3\">E ± 1σ</th></tr></thead><tbody>";
        let sigma = record.sigma.as_ref().map(|sigma| sigma.get(sensor));
        for (axis, name) in AXES.into_iter().enumerate() {
            let values = row(record.triad(sensor), axis);
            let sigmas = sigma.map_or([0.0; 5], |sigma| row(sigma, axis));
            let _ = write!(html, "<tr><th>{name}</th>");
            let of = |kind| format!("{}.{kind}.{name}", sensor.name());
            let misalignments = AXES.map(|to| format!("{}{to}", of("installation")));
            let names = [of("scale"), of("bias")].into_iter().chain(misalignments);
            for ((value, sigma), of) in values.into_iter().zip(sigmas).zip(names) {
                // The prior of an undetermined parameter is no result.
                let cell = match record.undetermined().any(|name| *name == of) {
                    true => "–".to_owned(),
                    false => with_sigma(value, sigma),
                };
                let _ = write!(html, "<td>{cell}</td>");
            }
            html += "</tr>";
        }
        html += "</tbody></table>";
    }
    html
}

/// K, D and the row of E of an axis.
fn row(of: &TriadRecord, axis: usize) -> [f64; 5] {
    let [x, y, z] = of.installation[axis];
    [of.scale[axis], of.bias[axis], x, y, z]
}

/// A value with the decimals that its σ determines, on one line.
fn with_sigma(value: f64, sigma: f64) -> String {
    if sigma == 0.0 {
        return digits(value, 7);
    }
    let decimals = (1.0 - sigma.log10().floor()).max(0.0) as usize;
    format!("{value:.decimals$}\u{a0}±\u{a0}{sigma:.decimals$}")
}
