//! The magnetometer in a calibration file.

use nalgebra::{DMatrix, Matrix3, SMatrix, SVector, Vector3};
use serde::{Deserialize, Serialize};

use crate::calibration::magnetometer::PARTS;
use crate::calibration::{Ellipsoid, MagneticEstimate};
use crate::magnetic::{MAGNETIC, MAGNETOMETER, MagneticTriad};
use crate::recording::Magnetometer;
use crate::units::DEGREE;

/// The equation of a magnetometer.
const EQUATION: &str = "N = matrix * field + bias; field = correction * (N - bias)";
/// One microtesla, T.
const MICRO_TESLA: f64 = 1e-6;

/// A magnetometer in the body frame of the triads, in the quantity of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MagRecord {
    /// Row by row: the file's quantity for a field of one `field.unit` along each body axis.
    pub matrix: [[f64; 3]; 3],
    /// Output without a field.
    pub bias: [f64; 3],
    /// Quantity of the file.
    pub unit: String,
    /// 1σ of matrix and bias; `None` for a truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<MagSigma>,
    /// Matrix of `field = correction (N − bias)`.
    pub correction: [[f64; 3]; 3],
    /// The field at the site.
    pub field: FieldRecord,
    /// Names of the estimated constants, such as `mag.matrix.xy`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parameters: Vec<String>,
    /// Covariance of these constants.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub covariance: Vec<Vec<f64>>,
    /// How well the values lie about the ellipsoid, for a magnetometer calibrated without gyros and accelerometers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ellipsoid: Option<EllipsoidRecord>,
    /// The model in words.
    pub equation: String,
}

/// Values about an ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EllipsoidRecord {
    /// Number of values.
    pub values: usize,
    /// RMS residual of the magnitude, as a fraction of the field.
    pub residual: f64,
    /// Parts of the sphere that contain a value, out of `parts` equal parts.
    pub seen: usize,
    /// Number of equal parts.
    pub parts: usize,
}

/// 1σ of a magnetometer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MagSigma {
    /// 1σ of each entry of the matrix.
    pub matrix: [[f64; 3]; 3],
    /// 1σ of the bias.
    pub bias: [f64; 3],
}

/// The field at the site of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FieldRecord {
    /// `T`, or `local field` if the magnitude is not known.
    pub unit: String,
    /// Magnitude, in `unit`.
    pub magnitude: f64,
    /// From North towards East. Without place and date, North is that of the field.
    pub declination_deg: f64,
    /// Below the horizon.
    pub inclination_deg: f64,
    /// 1σ of magnitude, declination and inclination; `None` for a truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<[f64; 3]>,
}

impl MagRecord {
    /// The record of a magnetometer in a field of this magnitude, T; `None` for a magnitude by convention.
    pub fn new(triad: &MagneticTriad, magnitude: Option<f64>, log: &Magnetometer) -> Option<Self> {
        let factor = log.nominal / magnitude.unwrap_or(1.0);
        let matrix = triad.matrix * factor;
        Some(Self {
            matrix: rows(&matrix),
            bias: (triad.bias * log.nominal).into(),
            unit: log.unit.clone(),
            sigma: None,
            correction: rows(&matrix.try_inverse()?),
            field: FieldRecord {
                unit: magnitude.map_or("local field", |_| "T").to_owned(),
                magnitude: magnitude.unwrap_or(1.0),
                declination_deg: triad.angles.x / DEGREE,
                inclination_deg: triad.angles.y / DEGREE,
                sigma: None,
            },
            parameters: Vec::new(),
            covariance: Vec::new(),
            ellipsoid: None,
            equation: EQUATION.to_owned(),
        })
    }

    /// The record of an ellipsoid.
    pub fn of_ellipsoid(found: &Ellipsoid, log: &Magnetometer) -> Option<Self> {
        Some(Self {
            ellipsoid: Some(EllipsoidRecord {
                values: found.count,
                residual: found.residual,
                seen: PARTS - found.unseen.len(),
                parts: PARTS,
            }),
            ..Self::of_estimate(&found.estimate, log)?
        })
    }

    /// The record of an estimate, with its covariance.
    pub fn of_estimate(estimate: &MagneticEstimate, log: &Magnetometer) -> Option<Self> {
        let [magnitude, magnitude_sigma] = estimate.magnitude;
        let known = (magnitude_sigma > 0.0).then_some(magnitude);
        let mut record = Self::new(&estimate.triad, known, log)?;
        let relative = known.map_or(0.0, |magnitude| magnitude_sigma / magnitude);
        let unit = |k: usize| match k {
            MAGNETOMETER.. => 1.0 / DEGREE,
            9.. => log.nominal,
            _ => log.nominal / known.unwrap_or(1.0),
        };
        let unit = SVector::<f64, MAGNETIC>::from_fn(|k, _| unit(k));
        let mut of_matrix = estimate.triad.vector().component_mul(&unit);
        of_matrix.rows_range_mut(9..).fill(0.0);
        // An error of the magnitude of the field scales the matrix.
        let scaled = of_matrix * of_matrix.transpose() * relative.powi(2);
        let covariance = DMatrix::from_fn(MAGNETIC, MAGNETIC, |i, j| {
            estimate.covariance[(i, j)] * unit[i] * unit[j] + scaled[(i, j)]
        });
        let sigma = covariance.diagonal().map(|v| v.max(0.0).sqrt());
        record.sigma = Some(MagSigma {
            matrix: rows(&Matrix3::from_fn(|i, j| sigma[3 * i + j])),
            bias: [sigma[9], sigma[10], sigma[11]],
        });
        record.field.sigma = Some([
            magnitude_sigma,
            sigma[MAGNETOMETER],
            sigma[MAGNETOMETER + 1],
        ]);
        record.parameters = (0..MAGNETOMETER).map(MagneticTriad::name).collect();
        let row = |i: usize| (0..MAGNETOMETER).map(|j| covariance[(i, j)]).collect();
        record.covariance = (0..MAGNETOMETER).map(row).collect();
        Some(record)
    }

    /// Times, s, and fields along the body axes in `field.unit` of a magnetometer in the same unit.
    pub fn corrected(&self, log: &Magnetometer) -> impl Iterator<Item = (f64, Vector3<f64>)> {
        let correction = Matrix3::from_fn(|i, j| self.correction[i][j]);
        let bias = Vector3::from(self.bias);
        log.values()
            .map(move |(time, value)| (time, correction * (value - bias)))
    }

    /// Matrix row by row and bias.
    pub fn vector(&self) -> SVector<f64, MAGNETOMETER> {
        SVector::from_iterator(self.matrix.as_flattened().iter().chain(&self.bias).copied())
    }

    /// Covariance of matrix and bias; without correlations if none are stated, zero without σ.
    pub fn covariance_matrix(&self) -> SMatrix<f64, MAGNETOMETER, MAGNETOMETER> {
        let sigma = |k: usize| self.sigma_of(&MagneticTriad::name(k)).copied();
        SMatrix::from_fn(
            |i, j| match self.covariance.get(i).and_then(|row| row.get(j)) {
                Some(of) => *of,
                None if i == j => sigma(i).unwrap_or(0.0).powi(2),
                None => 0.0,
            },
        )
    }

    /// Unit of the field in tables, and its size in `field.unit`.
    pub fn shown_field(&self) -> (&str, f64) {
        match &*self.field.unit {
            "T" => ("µT", MICRO_TESLA),
            other => (other, 1.0),
        }
    }

    /// Units of matrix and bias in tables.
    pub fn shown_units(&self) -> [String; 2] {
        let (field, _) = self.shown_field();
        [format!("{} per {field}", self.unit), self.unit.clone()]
    }

    /// RMS 1σ of matrix and bias, each with its unit in tables.
    pub fn shown_sigma(&self) -> Option<[(f64, String); 2]> {
        let sigma = self.sigma.as_ref()?;
        let rms = |of: &[f64]| (of.iter().map(|of| of * of).sum::<f64>() / of.len() as f64).sqrt();
        let (_, size) = self.shown_field();
        let [of_matrix, of_bias] = self.shown_units();
        Some([
            (rms(sigma.matrix.as_flattened()) * size, of_matrix),
            (rms(&sigma.bias), of_bias),
        ])
    }

    /// A value by name, such as `mag.matrix.xy`.
    pub fn get(&self, name: &str) -> Option<&f64> {
        named(name, &self.matrix, &self.bias)
    }

    /// 1σ of a value by name.
    pub fn sigma_of(&self, name: &str) -> Option<&f64> {
        let sigma = self.sigma.as_ref()?;
        named(name, &sigma.matrix, &sigma.bias)
    }
}

fn named<'a>(name: &str, matrix: &'a [[f64; 3]; 3], bias: &'a [f64; 3]) -> Option<&'a f64> {
    let place = (0..MAGNETOMETER).find(|&k| MagneticTriad::name(k) == name)?;
    matrix.as_flattened().iter().chain(bias).nth(place)
}

/// A matrix row by row.
fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    matrix.transpose().data.0
}
