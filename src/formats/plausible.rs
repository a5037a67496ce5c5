//! What no instrument and no covariance can be, in a calibration that is read. A calibration that was reached
//! here is written whatever it is, for its findings say what it is worth.

use std::path::Path;

use nalgebra::DMatrix;

use super::error::{FileError, Place};
use crate::calibration::result::{Calibration, TriadRecord};
use crate::imu::{AXES, Term};
use crate::units::{DEGREE, STANDARD_GRAVITY};

/// An entry of an installation matrix beyond this is of an axis across the one that it is named for.
const INSTALLATION: f64 = 100.0;
/// A bias, in rad/s or m/s², beyond the range of any instrument: registers that read half their range at zero
/// included.
const BIAS: f64 = 1e6;
/// Scale factors, in the file's quantity for one rad/s or m/s².
const SCALES: std::ops::RangeInclusive<f64> = 1e-12..=1e15;
/// Gravity anywhere near the surface of the Earth, m/s².
const GRAVITY: std::ops::RangeInclusive<f64> = 9.7..=9.9;
/// Errors of a table's base and axes are small angles, rad.
const TABLE: f64 = 180.0 * DEGREE;
/// Digits that another program may have rounded a correlation to.
const ROUNDING: f64 = 1e-6;

const ADVICE: &str = "Correct the file, or write the calibration again.";

impl Calibration {
    /// Refuses values beyond what an instrument has.
    pub(super) fn check_sizes(&self, path: &Path) -> Result<(), FileError> {
        for (name, triad) in [("gyro", &self.gyro), ("accel", &self.accel)] {
            let sigma = self.sigma.as_ref().map(|sigma| match name {
                "gyro" => &sigma.gyro,
                _ => &sigma.accel,
            });
            check_triad(path, name, triad, triad)?;
            if let Some(sigma) = sigma {
                check_triad(path, &format!("sigma.{name}"), sigma, triad)?;
            }
        }
        for (name, term) in &self.terms {
            let known = Term::parameter_named(name).and_then(Term::of);
            let largest = known.map_or(TABLE, |term| term.entry().largest);
            let within = |value: f64| value.abs() <= largest;
            if !within(term.value) {
                return Err(refused(
                    path,
                    format_args!("terms.{name}.value = {:e}", term.value),
                    format_args!("a value from {:.3} to {largest:.3} in SI", -largest),
                ));
            }
            if let Some(sigma) = term.sigma.filter(|&s| !(within(s) && s >= 0.0)) {
                return Err(refused(
                    path,
                    format_args!("terms.{name}.sigma = {sigma:e}"),
                    format_args!("a 1σ from 0 to {largest:.3} in SI"),
                ));
            }
        }
        if let Some(gravity) = &self.gravity {
            if !GRAVITY.contains(&gravity.m_s2) {
                return Err(refused(
                    path,
                    format_args!("gravity.m_s2 = {}", gravity.m_s2),
                    format_args!("{} to {} m/s²", GRAVITY.start(), GRAVITY.end()),
                ));
            }
            if !(0.0..=STANDARD_GRAVITY).contains(&gravity.sigma_m_s2) {
                return Err(refused(
                    path,
                    format_args!("gravity.sigma_m_s2 = {}", gravity.sigma_m_s2),
                    "a 1σ in m/s², zero or above",
                ));
            }
        }
        Ok(())
    }

    /// Refuses what is no covariance: not symmetric, or with a combination of parameters of negative
    /// variance.
    pub(super) fn check_correlations(&self, path: &Path) -> Result<(), FileError> {
        let size = self.parameters.len();
        if size == 0 {
            return Ok(());
        }
        let sigma: Vec<f64> = (0..size).map(|k| self.covariance[k][k].sqrt()).collect();
        let of_both = |i: usize, j: usize| {
            let (one, other) = (&self.parameters[i], &self.parameters[j]);
            format!("of {one} and {other}")
        };
        let mut correlation = DMatrix::identity(size, size);
        for i in 0..size {
            for j in 0..i {
                let (value, mirrored) = (self.covariance[i][j], self.covariance[j][i]);
                let scale = sigma[i] * sigma[j];
                if (value - mirrored).abs() > ROUNDING * scale {
                    return Err(refused(
                        path,
                        format_args!(
                            "the covariance {} twice, {value:e} and {mirrored:e}",
                            of_both(i, j)
                        ),
                        "the same twice, for covariance is symmetric",
                    ));
                }
                if value.abs() > (1.0 + ROUNDING) * scale {
                    return Err(refused(
                        path,
                        format_args!(
                            "a covariance {} of {value:e} beside σ of {:e} and {:e}",
                            of_both(i, j),
                            sigma[i],
                            sigma[j]
                        ),
                        "a correlation from −1 to 1",
                    ));
                }
                let both = if scale > 0.0 { value / scale } else { 0.0 };
                correlation[(i, j)] = both;
                correlation[(j, i)] = both;
            }
        }
        let least = correlation
            .symmetric_eigenvalues()
            .iter()
            .copied()
            .fold(0.0, f64::min);
        if least < -ROUNDING * size as f64 {
            return Err(refused(
                path,
                format_args!(
                    "a covariance by which a combination of parameters has a negative variance \
                     (smallest eigenvalue of the correlations {least:.3})"
                ),
                "a positive semidefinite matrix",
            ));
        }
        Ok(())
    }
}

/// Values, or their 1σ, against what an instrument of this triad's scale factors can have.
fn check_triad(
    path: &Path,
    name: &str,
    values: &TriadRecord,
    of: &TriadRecord,
) -> Result<(), FileError> {
    for (axis, scale) in of.scale.iter().map(|scale| scale.abs()).enumerate() {
        let wrong = |field: &str, value: f64, largest: f64| {
            Err(refused(
                path,
                format_args!("{name}.{field} = {value:e}"),
                format_args!("at most {largest:e} in magnitude"),
            ))
        };
        let letter = AXES[axis];
        if !SCALES.contains(&scale) {
            return Err(refused(
                path,
                format_args!("{name}.scale.{letter} = {:e}", of.scale[axis]),
                format_args!("{:e} to {:e} in magnitude", SCALES.start(), SCALES.end()),
            ));
        }
        if values.scale[axis].abs() > *SCALES.end() {
            return wrong(
                &format!("scale.{letter}"),
                values.scale[axis],
                *SCALES.end(),
            );
        }
        for (column, &value) in values.installation[axis].iter().enumerate() {
            if value.abs() > INSTALLATION {
                let field = format!("installation.{letter}{}", AXES[column]);
                return wrong(&field, value, INSTALLATION);
            }
        }
        if values.bias[axis].abs() > BIAS * scale {
            return wrong(&format!("bias.{letter}"), values.bias[axis], BIAS * scale);
        }
    }
    Ok(())
}

fn refused(
    path: &Path,
    found: impl std::fmt::Display,
    expected: impl std::fmt::Display,
) -> FileError {
    FileError::new(path, Place::File, found, expected, ADVICE)
}
