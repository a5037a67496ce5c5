//! `calibration.json` and `truth.json`; the same checks validate them on reading and on writing.
//!
//! A failed calibration is written with values of any size, because its findings state that they must not be used.

use std::collections::HashSet;
use std::ops::RangeInclusive;
use std::path::Path;
use turncal::imu::thermal_state;

use nalgebra::DMatrix;

use crate::directories::write_whole;
use turncal::calibration::result::{Calibration, FORMAT, FORMAT_WITH_TEMPERATURE, TriadRecord};
use turncal::imu::{AXES, PARAMETERS, PerSensor, Sensor, Term, ThermalRange, Triad};
use turncal::units::{DEGREE, STANDARD_GRAVITY};
use turncal_input::{FileError, Place, counted, excerpt, small_file, suggestion};

/// A larger entry of a misalignment matrix belongs to an axis perpendicular to its name.
const INSTALLATION: f64 = 100.0;
/// Bias limit, in rad/s or m/s², beyond the range of any instrument, including registers with zero at mid-range.
const BIAS: f64 = 1e6;
/// Scale factors, in the quantity of the file per rad/s or m/s².
const SCALES: RangeInclusive<f64> = 1e-12..=1e15;
/// Gravity anywhere near the surface of the Earth, m/s².
const GRAVITY: RangeInclusive<f64> = 9.7..=9.9;
/// Maximum error of table base and axes, which are small angles, rad.
const TABLE: f64 = 180.0 * DEGREE;
/// Rounding tolerance of correlations written by other programs.
const ROUNDING: f64 = 1e-6;

/// Refuses a violated condition.
macro_rules! expect {
    ($holds:expr, $expected:expr, $($found:tt)+) => {
        let holds: bool = $holds;
        if !holds {
            return Err((format!($($found)+), $expected.to_string()));
        }
    };
}

mod agreement;

use agreement::{Checked, Wrong, check_agreement};

/// Reads and checks a record.
pub fn read_calibration(path: &Path) -> Result<Calibration, FileError> {
    let advice = "Give the path of a calibration.json or truth.json.";
    record_of(&small_file::bytes(path, "the calibration", advice)?, path)
}

fn record_of(bytes: &[u8], path: &Path) -> Result<Calibration, FileError> {
    let record: Calibration = serde_json::from_slice(bytes).map_err(|error| {
        let (line, column) = (error.line() as u64, error.column() as u64);
        let at = format!(" at line {line} column {column}");
        let what = excerpt(&error.to_string().replace(&at, ""));
        FileError {
            file: path.to_owned(),
            place: Place::Character { line, column },
            message: format!(
                "this is not a calibration in the format {FORMAT}: {what}. Correct the file or write it again with turncal."
            ),
        }
    })?;
    checked(&record).map_err(|wrong| refused(path, &wrong))?;
    Ok(record)
}

/// The record as the bytes of a file that [`read_calibration`] accepts; `path` is used in error messages.
pub fn calibration_json(record: &Calibration, path: &Path) -> Result<Vec<u8>, FileError> {
    let expected = "values that JSON can represent".to_owned();
    let written = || small_file::pretty(record).map_err(|error| (error.to_string(), expected));
    let bytes = check(record).and_then(|()| written());
    let bytes = bytes.map_err(|wrong| refused(path, &wrong))?;
    record_of(&bytes, path)?;
    Ok(bytes)
}

/// Writes the complete record or nothing at all; an existing file is replaced only with `force`.
pub fn write_calibration(record: &Calibration, path: &Path, force: bool) -> Result<(), FileError> {
    write_whole(path, &calibration_json(record, path)?, force)
}

/// All checks of a file.
fn checked(record: &Calibration) -> Checked {
    check(record)?;
    if !record.is_failed() {
        check_sizes(record)?;
    }
    check_correlations(record)?;
    check_agreement(record)
}

fn check(record: &Calibration) -> Checked {
    let formats = [FORMAT, FORMAT_WITH_TEMPERATURE];
    expect!(
        formats.contains(&record.format.as_str()),
        format!("{FORMAT:?} or {FORMAT_WITH_TEMPERATURE:?}"),
        "format = {:?}",
        record.format
    );
    for (name, triad) in [("gyro", &record.gyro), ("accel", &record.accel)] {
        expect!(
            values(triad).all(f64::is_finite),
            "finite numbers",
            "a non-finite value in {name}"
        );
        expect!(
            !triad.scale.contains(&0.0),
            "three non-zero scale factors",
            "a zero in {name}.scale"
        );
    }
    let of_triads = |of: &PerSensor<TriadRecord>| [("gyro", of.gyro), ("accel", of.accel)];
    for (name, sigma) in record.sigma.iter().flat_map(of_triads) {
        for value in values(&sigma) {
            expect!(
                value.is_finite() && value >= 0.0,
                "finite numbers of at least zero",
                "{value} in sigma.{name}"
            );
        }
    }
    check_parameters(record)?;
    check_covariance(record)?;
    check_temperature(record)
}

fn check_parameters(record: &Calibration) -> Checked {
    let form = record.installation_form.unwrap_or_default();
    let of_sensor =
        |sensor| (0..PARAMETERS).filter_map(move |p| Triad::parameter_name(sensor, form, p));
    let known: Vec<String> = Sensor::ALL.into_iter().flat_map(of_sensor).collect();
    let mut seen = HashSet::new();
    for (field, names) in [("parameters", &record.parameters), ("fixed", &record.fixed)] {
        for name in names {
            let expected = || {
                let known = known.iter().map(String::as_str);
                let advice = suggestion(name, known, "a name that is not a parameter of this form");
                format!("names of parameters of the {} form ({advice})", form.name())
            };
            expect!(known.contains(name), expected(), "`{name}` in {field}");
            expect!(seen.insert(name), "each parameter once", "`{name}` twice");
        }
    }
    Ok(())
}

fn check_covariance(record: &Calibration) -> Checked {
    let size = record.parameters.len();
    expect!(
        record.covariance.len() == size,
        format!("{size} rows, one per entry of parameters"),
        "{} in covariance",
        counted(record.covariance.len(), "row")
    );
    for (i, row) in record.covariance.iter().enumerate() {
        expect!(
            row.len() == size,
            format!("{size} values in each row, because the covariance is square"),
            "{} in row {} of covariance",
            counted(row.len(), "value"),
            i + 1
        );
        expect!(
            row.iter().all(|value| value.is_finite()) && row[i] >= 0.0,
            "finite numbers, with none below zero on the diagonal",
            "an impossible value in row {} of covariance",
            i + 1
        );
    }
    Ok(())
}

fn check_temperature(record: &Calibration) -> Checked {
    let Some(thermal) = &record.temperature else {
        return Ok(());
    };
    for sensor in Sensor::ALL {
        let ThermalRange {
            lowest,
            highest,
            reference,
            largest_rate: rate,
        } = *thermal.range.get(sensor);
        let all = [lowest, highest, reference, rate];
        expect!(
            all.iter().all(|v| v.is_finite()) && lowest <= highest && rate >= 0.0,
            "a finite range with its lower end first, and a rate of at least zero",
            "temperature.range.{} from {lowest} to {highest} °C",
            sensor.name()
        );
    }
    let n = thermal.coefficients.len();
    let rows = || thermal.covariance.iter().chain(&thermal.cross);
    let coefficients = thermal.coefficients.iter().map(|c| &c.value);
    expect!(
        coefficients.chain(rows().flatten()).all(|v| v.is_finite()),
        "finite numbers",
        "a non-finite number in temperature"
    );
    let covered = thermal.covariance.is_empty()
        || (thermal.covariance.len() == n && thermal.cross.len() == record.parameters.len());
    expect!(
        covered && rows().all(|row| row.len() == n),
        "one row of covariance per coefficient and one row of cross per parameter",
        "temperature.covariance or .cross with the wrong size"
    );
    let none = PerSensor::default();
    let anywhere = thermal_state(&thermal.range, &none, &none);
    let expected = || "parameter names and orders from 1 to 5".to_owned();
    let at = record.in_state(&anywhere);
    at.map(drop)
        .map_err(|found| (found.to_string(), expected()))
}

/// Refuses values impossible for an instrument.
fn check_sizes(record: &Calibration) -> Checked {
    let mut sizes: Vec<(String, f64, RangeInclusive<f64>)> = Vec::new();
    let about_zero = |largest: f64| -largest..=largest;
    let mut triads = vec![
        ("gyro", &record.gyro, &record.gyro),
        ("accel", &record.accel, &record.accel),
    ];
    if let Some(PerSensor { gyro, accel }) = &record.sigma {
        triads.extend([
            ("sigma.gyro", &record.gyro, gyro),
            ("sigma.accel", &record.accel, accel),
        ]);
    }
    for (name, of, values) in triads {
        for (i, axis) in AXES.iter().enumerate() {
            let (scale, bias) = (of.scale[i].abs(), about_zero(BIAS * of.scale[i].abs()));
            let largest = about_zero(*SCALES.end());
            sizes.push((format!("{name}.scale.{axis}"), values.scale[i], largest));
            sizes.push((format!("|{name}.scale.{axis}|"), scale, SCALES));
            sizes.push((format!("{name}.bias.{axis}"), values.bias[i], bias));
            for (other, value) in AXES.iter().zip(values.installation[i]) {
                let field = format!("{name}.installation.{axis}{other}");
                sizes.push((field, value, about_zero(INSTALLATION)));
            }
        }
    }
    for (name, term) in &record.terms {
        let known = Term::parameter_named(name).and_then(Term::of);
        let largest = known.map_or(TABLE, |term| term.entry().largest);
        let sigma = term.sigma.unwrap_or(0.0);
        let value = format!("terms.{name}.value");
        sizes.push((value, term.value, about_zero(largest)));
        sizes.push((format!("terms.{name}.sigma"), sigma, 0.0..=largest));
    }
    if let Some(of) = &record.gravity {
        let sigma = 0.0..=STANDARD_GRAVITY;
        sizes.push(("gravity.m_s2".to_owned(), of.m_s2, GRAVITY));
        sizes.push(("gravity.sigma_m_s2".to_owned(), of.sigma_m_s2, sigma));
    }
    for (name, value, possible) in sizes {
        let short = |end: &f64| format!("{end:.2e}").parse().unwrap_or(*end);
        let words = |of: f64| {
            if of.abs() >= 1e6 {
                format!("{of:e}")
            } else {
                format!("{of:?}")
            }
        };
        let [least, most] = [possible.start(), possible.end()].map(|end| words(short(end)));
        expect!(
            possible.contains(&value),
            format!("a value from {least} to {most} in SI units"),
            "{name} = {}",
            words(value)
        );
    }
    Ok(())
}

/// Refuses an invalid covariance: not symmetric, or not positive semidefinite.
fn check_correlations(record: &Calibration) -> Checked {
    let size = record.parameters.len();
    if size == 0 {
        return Ok(());
    }
    let sigma: Vec<f64> = (0..size).map(|k| record.covariance[k][k].sqrt()).collect();
    let mut correlation = DMatrix::identity(size, size);
    for (i, j) in (0..size).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let both = format!("of {} and {}", record.parameters[i], record.parameters[j]);
        let (value, mirrored) = (record.covariance[i][j], record.covariance[j][i]);
        let scale = sigma[i] * sigma[j];
        expect!(
            (value - mirrored).abs() <= ROUNDING * scale,
            "equal values, because the covariance is symmetric",
            "two covariances {both}, {value:e} and {mirrored:e}"
        );
        expect!(
            value.abs() <= (1.0 + ROUNDING) * scale,
            "a correlation from −1 to 1",
            "a covariance {both} of {value:e} with σ of {:e} and {:e}",
            sigma[i],
            sigma[j]
        );
        let of_both = if scale > 0.0 { value / scale } else { 0.0 };
        correlation[(i, j)] = of_both;
        correlation[(j, i)] = of_both;
    }
    let least = correlation.symmetric_eigenvalues().min();
    expect!(
        least >= -ROUNDING * size as f64,
        "a positive semidefinite matrix",
        "a covariance that gives a combination of parameters a negative variance (smallest eigenvalue of the \
         correlation matrix {least:.3})"
    );
    Ok(())
}

fn refused(path: &Path, (found, expected): &Wrong) -> FileError {
    let advice = "Correct the file or write it again with turncal.";
    FileError::of(path, found, expected, advice)
}

fn values(triad: &TriadRecord) -> impl Iterator<Item = f64> {
    let installation = triad.installation.into_iter().flatten();
    triad
        .scale
        .into_iter()
        .chain(installation)
        .chain(triad.bias)
}
