//! `calibration.json` and `truth.json`.

use std::collections::HashSet;
use std::path::Path;

use super::error::{FileError, Place, suggestion};
use super::small_file;
use super::whole::write_whole;
use crate::calibration::result::{Calibration, FORMAT, FORMAT_WITH_TEMPERATURE, TriadRecord};
use crate::imu::{PARAMETERS, PerSensor, Sensor, ThermalRange, Triad};
use crate::shown::excerpt;

impl Calibration {
    /// Reads and checks a record.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let bytes = small_file::bytes(path).map_err(|error| {
            FileError::io(
                path,
                "read the calibration",
                &error,
                "Give the path of a calibration.json or truth.json.",
            )
        })?;
        let record: Self = serde_json::from_slice(&bytes).map_err(|error| {
            let place = Place::Character {
                line: error.line() as u64,
                column: error.column() as u64,
            };
            let at = format!(" at line {} column {}", error.line(), error.column());
            let what = excerpt(&error.to_string().replace(&at, ""));
            FileError {
                file: path.to_owned(),
                place,
                message: format!(
                    "not a calibration in the format {FORMAT}: {what}. Correct the file or write it \
                     again."
                ),
            }
        })?;
        record.check(path)?;
        record.check_sizes(path)?;
        record.check_correlations(path)?;
        Ok(record)
    }

    /// The record as the bytes of its file, `path` being named in errors.
    pub fn to_json(&self, path: &Path) -> Result<Vec<u8>, FileError> {
        self.check(path)?;
        let mut bytes = serde_json::to_vec_pretty(self).map_err(|error| {
            FileError::new(
                path,
                Place::File,
                error,
                "values that JSON can hold",
                "Nothing was written.",
            )
        })?;
        bytes.push(b'\n');
        Ok(bytes)
    }

    /// Writes the record whole or not at all; an existing file only with `force`.
    pub fn write(&self, path: &Path, force: bool) -> Result<(), FileError> {
        write_whole(path, &self.to_json(path)?, force)
    }

    fn check(&self, path: &Path) -> Result<(), FileError> {
        let error = |found: String, expected: &str, advice: &str| {
            Err(FileError::new(path, Place::File, found, expected, advice))
        };
        if self.format != FORMAT && self.format != FORMAT_WITH_TEMPERATURE {
            return error(
                format!("format = {:?}", self.format),
                &format!("{FORMAT:?} or {FORMAT_WITH_TEMPERATURE:?}"),
                "Give a file that turncal wrote, or convert this one.",
            );
        }
        for (name, triad) in [("gyro", &self.gyro), ("accel", &self.accel)] {
            if !triad.values().all(f64::is_finite) {
                return error(
                    format!("a value in {name} that is not finite"),
                    "finite numbers",
                    "The calibration failed; nothing can be done with it.",
                );
            }
            if triad.scale.contains(&0.0) {
                return error(
                    format!("{name}.scale with a zero"),
                    "three scale factors, none of them zero",
                    "Correct the file.",
                );
            }
        }
        if let Some(sigma) = &self.sigma {
            for sensor in Sensor::ALL {
                let cannot_be = |s: &f64| !(s.is_finite() && *s >= 0.0);
                if let Some(wrong) = sigma.get(sensor).values().find(cannot_be) {
                    return error(
                        format!("{wrong} in sigma.{}", sensor.name()),
                        "finite numbers that are zero or above",
                        "Correct the file.",
                    );
                }
            }
        }
        self.check_parameters(path)?;
        self.check_covariance(path)?;
        self.check_temperature(path)
    }

    fn check_parameters(&self, path: &Path) -> Result<(), FileError> {
        let form = self.installation_form.unwrap_or_default();
        let known: Vec<String> = Sensor::ALL
            .into_iter()
            .flat_map(|sensor| {
                (0..PARAMETERS).filter_map(move |p| Triad::parameter_name(sensor, form, p))
            })
            .collect();
        let mut seen = HashSet::new();
        for (field, names) in [("parameters", &self.parameters), ("fixed", &self.fixed)] {
            for name in names {
                let (found, advice) = if !known.contains(name) {
                    (
                        format!("`{name}` in {field}"),
                        suggestion(
                            name,
                            known.iter().map(String::as_str),
                            "Remove it: this form does not have it.",
                        ),
                    )
                } else if !seen.insert(name) {
                    (
                        format!("`{name}` twice"),
                        "Name every parameter once.".to_owned(),
                    )
                } else {
                    continue;
                };
                let expected =
                    format!("names of parameters of the {} form, once each", form.name());
                return Err(FileError::new(path, Place::File, found, expected, advice));
            }
        }
        Ok(())
    }

    fn check_covariance(&self, path: &Path) -> Result<(), FileError> {
        let error = |found: String, expected: String| {
            let advice = "Correct the file, or write the calibration again.";
            Err(FileError::new(path, Place::File, found, expected, advice))
        };
        let size = self.parameters.len();
        if self.covariance.len() != size {
            return error(
                format!("{} row(s) in covariance", self.covariance.len()),
                format!("{size}, one for each entry of parameters"),
            );
        }
        for (i, row) in self.covariance.iter().enumerate() {
            if row.len() != size {
                return error(
                    format!("{} value(s) in row {} of covariance", row.len(), i + 1),
                    format!("{size}, for covariance is square"),
                );
            }
            if !row.iter().all(|value| value.is_finite()) || row[i] < 0.0 {
                return error(
                    format!("a value in row {} of covariance that cannot be", i + 1),
                    "finite numbers, none below zero on the diagonal".to_owned(),
                );
            }
        }
        Ok(())
    }
}

impl Calibration {
    fn check_temperature(&self, path: &Path) -> Result<(), FileError> {
        let error = |found: String, expected: &str| {
            let advice = "Correct the file, or write the calibration again.";
            Err(FileError::new(path, Place::File, found, expected, advice))
        };
        let Some(thermal) = &self.temperature else {
            return Ok(());
        };
        for sensor in Sensor::ALL {
            let ThermalRange {
                lowest,
                highest,
                reference,
                largest_rate: rate,
            } = *thermal.range.get(sensor);
            let finite = [lowest, highest, reference, rate]
                .iter()
                .all(|v| v.is_finite());
            if !finite || lowest > highest || rate < 0.0 {
                return error(
                    format!(
                        "temperature.range.{} from {lowest} to {highest} °C",
                        sensor.name()
                    ),
                    "a finite range, its lower end first, and a rate that is not negative",
                );
            }
        }
        let n = thermal.coefficients.len();
        let rows = [&thermal.covariance, &thermal.cross];
        let mut values = thermal.coefficients.iter().map(|c| c.value);
        let mut inner = rows.into_iter().flatten().flatten();
        if !values.all(f64::is_finite) || !inner.all(|v| v.is_finite()) {
            return error(
                "a number in temperature that is not finite".to_owned(),
                "finite numbers",
            );
        }
        let covered = thermal.covariance.is_empty()
            || (thermal.covariance.len() == n && thermal.cross.len() == self.parameters.len());
        if !covered || !rows.into_iter().flatten().all(|row| row.len() == n) {
            return error(
                "temperature.covariance or .cross of another size".to_owned(),
                "a row of covariance for each coefficient, one of cross for each parameter",
            );
        }
        let anywhere = thermal
            .range
            .state(&PerSensor::default(), &PerSensor::default());
        match self.in_state(&anywhere) {
            Ok(_) => Ok(()),
            Err(found) => error(
                found.to_string(),
                "names of parameters and orders from 1 to 5",
            ),
        }
    }
}

impl TriadRecord {
    fn values(&self) -> impl Iterator<Item = f64> {
        self.scale
            .into_iter()
            .chain(self.installation.into_iter().flatten())
            .chain(self.bias)
    }
}
