//! Calibrations side by side: differences in one form and one frame, and whether the claimed σ
//! explain them.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::consistency::mean_square_interval;
use super::frame::{Canonical, free_parameters, own_nominal};
use super::scatter::{Scatter, scatter};
use super::states::{ParameterMatrix, ParameterVector};
use crate::imu::{Nominal, PerSensor, Sensor};
use crate::run::CalibrationRecord;
use crate::run::record::BodyFrame;

/// A correlation matrix has no information in directions whose eigenvalue is below this: they are
/// zero but for rounding, as where three angles stand for six.
const NO_DIRECTION: f64 = 1e-11;

/// A record with the name that tables and messages give it.
#[derive(Debug, Clone, Copy)]
pub struct Named<'a> {
    /// Its name.
    pub name: &'a str,
    /// The calibration, or the truth.
    pub record: &'a CalibrationRecord,
}

/// Why calibrations cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ComparisonError {
    /// Nothing to compare.
    #[error("a single calibration and no truth; give a second calibration, or a truth")]
    Single,
    /// Outputs of different quantities.
    #[error(
        "{other} has the {} unit `{found}`, {name} has `{expected}`: their numbers cannot be \
         compared; give calibrations of outputs in the same unit", .sensor.name()
    )]
    Unit {
        /// Which triad.
        sensor: Sensor,
        /// The first record that states a unit.
        name: String,
        /// Its unit.
        expected: String,
        /// The record that states another one.
        other: String,
        /// The other unit.
        found: String,
    },
    /// An axis that is not near the body axis of its name.
    #[error(
        "{name}: the {} {axis} axis is a right angle or more away from body {axis} (by the sign of \
         the reference's scale factor), or the matrix K·C is singular; bring the calibrations to \
         the same body axes and signs first", .sensor.name()
    )]
    Turned {
        /// The record.
        name: String,
        /// Which triad.
        sensor: Sensor,
        /// Which axis.
        axis: char,
    },
    /// `parameters` and `covariance` that do not fit.
    #[error(
        "{name}: covariance needs one row and one column for each name in parameters, and each must \
         be a parameter of the record's installation form; write the calibration again"
    )]
    Covariance {
        /// The record.
        name: String,
    },
}

/// Calibrations in the general form and a common body frame, held against a reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The common frame: of the accelerometers if any record is in theirs.
    pub body_frame: BodyFrame,
    /// The reference's scale factors in the file's quantity, by which all are normalised.
    pub nominal: PerSensor<Nominal>,
    /// The truth, or the first calibration.
    pub reference: Canonical,
    /// Whether the reference is a truth, taken as exact but for the σ that it may state.
    pub against_truth: bool,
    /// Indices of the parameters that the common frame leaves free.
    pub parameters: Vec<usize>,
    /// Every calibration but the reference, in the order given.
    pub sides: Vec<Side>,
    /// Scatter of all calibrations, from three on.
    pub scatter: Option<Scatter>,
}

/// A calibration less the reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Side {
    /// The calibration.
    pub calibration: Canonical,
    /// Calibration less reference, normalised: scale factors relative, angles pure numbers, biases in
    /// rad/s or m/s².
    pub difference: ParameterVector,
    /// 1σ of the difference, as if both came of different data; none where a side claims no σ.
    pub difference_sigma: Option<ParameterVector>,
    /// Consistency of the difference with its covariance; none without covariance.
    pub nees: Option<Nees>,
}

impl Side {
    /// Difference in units of its σ; none where there is no σ.
    pub fn z(&self, parameter: usize) -> Option<f64> {
        let sigma = self.difference_sigma?[parameter];
        (sigma > 0.0).then(|| self.difference[parameter] / sigma)
    }
}

/// Normalised estimation error squared, a mean of squares of independent numbers of σ 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nees {
    /// NEES/n.
    pub mean: f64,
    /// n: number of independent directions in which the covariance is not zero.
    pub count: usize,
    /// 95 % interval of NEES/n if the σ are true (χ²).
    pub interval: (f64, f64),
}

/// Holds calibrations against the truth, or, without one, against the first of them.
pub fn compare(
    calibrations: &[Named],
    truth: Option<Named>,
) -> Result<Comparison, ComparisonError> {
    let all: Vec<Named> = truth
        .into_iter()
        .chain(calibrations.iter().copied())
        .collect();
    let [first, _, ..] = all[..] else {
        return Err(ComparisonError::Single);
    };
    same_units(&all)?;
    let in_accelerometer_frame = |n: &Named| n.record.body_frame == BodyFrame::Accelerometer;
    let body_frame = if all.iter().any(in_accelerometer_frame) {
        BodyFrame::Accelerometer
    } else {
        BodyFrame::Table
    };
    let nominal = own_nominal(first.record);
    let all: Vec<Canonical> = all
        .iter()
        .map(|n| Canonical::new(n.name, n.record, &nominal, body_frame))
        .collect::<Result<_, _>>()?;
    let parameters = free_parameters(body_frame);
    let estimates = &all[usize::from(truth.is_some())..];
    let scatter = (estimates.len() >= 3).then(|| {
        let reference = all[0].vector();
        scatter(estimates, &reference, &parameters)
    });
    let mut all = all.into_iter();
    let Some(reference) = all.next() else {
        return Err(ComparisonError::Single);
    };
    let exact = truth.is_some().then(ParameterMatrix::zeros);
    let reference_covariance = reference.covariance.or(exact);
    let sides = all
        .map(|calibration| {
            let difference = calibration.vector() - reference.vector();
            let covariance = reference_covariance
                .zip(calibration.covariance)
                .map(|(a, b)| a + b);
            // A reference without σ, a truth, has no correlations to miss.
            let correlated =
                calibration.correlated && (reference.correlated || reference.covariance.is_none());
            Side {
                difference,
                difference_sigma: covariance.map(|p| p.diagonal().map(|v| v.max(0.0).sqrt())),
                nees: covariance
                    .filter(|_| correlated)
                    .and_then(|p| nees(&difference, &p, &parameters)),
                calibration,
            }
        })
        .collect();
    Ok(Comparison {
        body_frame,
        nominal,
        reference,
        against_truth: truth.is_some(),
        parameters,
        sides,
        scatter,
    })
}

/// Records that state no unit are taken to have that of the others.
fn same_units(all: &[Named]) -> Result<(), ComparisonError> {
    for sensor in Sensor::ALL {
        let mut stated = all.iter().filter_map(|n| {
            let unit = n.record.unit.as_ref()?.get(sensor);
            Some((n.name, unit))
        });
        let Some((name, expected)) = stated.next() else {
            continue;
        };
        if let Some((other, found)) = stated.find(|(_, unit)| *unit != expected) {
            return Err(ComparisonError::Unit {
                sensor,
                name: name.to_owned(),
                expected: expected.clone(),
                other: other.to_owned(),
                found: found.clone(),
            });
        }
    }
    Ok(())
}

fn nees(
    difference: &ParameterVector,
    covariance: &ParameterMatrix,
    parameters: &[usize],
) -> Option<Nees> {
    let with_sigma = parameters.iter().copied();
    let with_sigma: Vec<usize> = with_sigma.filter(|&i| covariance[(i, i)] > 0.0).collect();
    let directions = Directions::new(covariance, &with_sigma);
    let squares = directions.squares(difference);
    let count = squares.len();
    (count > 0).then(|| Nees {
        mean: squares.iter().sum::<f64>() / count as f64,
        count,
        interval: mean_square_interval(count, 0.05),
    })
}

/// The independent directions of a covariance, found on its correlation matrix so that units do not
/// matter.
pub(super) struct Directions {
    indices: Vec<usize>,
    sigma: DVector<f64>,
    eigen: SymmetricEigen<f64, nalgebra::Dyn>,
}

impl Directions {
    /// Of the covariance of some parameters, each of which has a σ.
    pub(super) fn new(covariance: &ParameterMatrix, indices: &[usize]) -> Self {
        let n = indices.len();
        let sigma = DVector::from_fn(n, |i, _| covariance[(indices[i], indices[i])].sqrt());
        let correlation = DMatrix::from_fn(n, n, |i, j| {
            let (a, b) = (indices[i], indices[j]);
            0.5 * (covariance[(a, b)] + covariance[(b, a)]) / (sigma[i] * sigma[j])
        });
        Self {
            indices: indices.to_vec(),
            sigma,
            eigen: correlation.symmetric_eigen(),
        }
    }

    /// Squares of a vector's components along the directions, each in units of its σ.
    fn squares(&self, v: &ParameterVector) -> Vec<f64> {
        let z = DVector::from_fn(self.sigma.len(), |i, _| v[self.indices[i]] / self.sigma[i]);
        let along = self.eigen.eigenvectors.tr_mul(&z);
        let squares = along.iter().zip(&self.eigen.eigenvalues);
        squares
            .filter(|(_, variance)| **variance > NO_DIRECTION)
            .map(|(x, variance)| x * x / variance)
            .collect()
    }

    /// The inverse of the covariance; `None` where it has no inverse.
    pub(super) fn information(&self) -> Option<DMatrix<f64>> {
        let eigen = &self.eigen;
        if eigen.eigenvalues.iter().any(|&v| v <= NO_DIRECTION) {
            return None;
        }
        let inverse = DMatrix::from_diagonal(&eigen.eigenvalues.map(f64::recip));
        let scale = DMatrix::from_diagonal(&self.sigma.map(f64::recip));
        let whitened = &scale * &eigen.eigenvectors;
        Some(&whitened * inverse * whitened.transpose())
    }
}
