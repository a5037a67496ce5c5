//! Conversion of calibrations to the general form, one body frame and one nominal scale, so that they can
//! be subtracted.
//!
//! The same instrument has a different `C` in every body frame: `K C u = K (C Rᵀ)(R u)`. In the accelerometer frame
//! (`x` along accelerometer x, `y` in the plane of accelerometers x and y) `R` is the orthogonal factor of the LQ
//! decomposition of the accelerometers' `K C` (Golub, Van Loan, *Matrix Computations*, 4th ed., §5.2). Biases and the
//! row norms of `K C` (and thus the scale factors of the general form) are the same in every frame.

mod magnetic;

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::{Calibration, TermRecord, triads_of};
use crate::calibration::parameters::derivatives;
use crate::calibration::{
    ComparisonError, Estimate, PARAMETERS, ParameterMatrix, ParameterVector, from_vector,
    in_general_form, parameter, to_vector,
};
use crate::imu::{AXES, BodyFrame, InstallationForm, Nominal, PerSensor, Sensor, Triad};

pub use magnetic::{MagneticValues, magnetic_in};

/// A calibration file, and the name that messages use for it.
#[derive(Debug, Clone, Copy)]
pub struct Named<'a> {
    /// Name.
    pub name: &'a str,
    /// The calibration, or the truth.
    pub record: &'a Calibration,
}

/// Converts two records to the general form, a common body frame and these nominal scales. A record without units is
/// assumed to have the units of the other record.
///
/// # Errors
/// Returns [`ComparisonError`] if the units differ or a record cannot be converted.
pub fn in_common_form(
    first: Named,
    second: Named,
    nominal: &PerSensor<Nominal>,
) -> Result<[Canonical; 2], ComparisonError> {
    let units = [first, second].map(|of| of.record.unit.as_ref());
    for sensor in Sensor::ALL {
        if let [Some(expected), Some(found)] = units.map(|unit| Some(unit?.get(sensor)))
            && expected != found
        {
            return Err(ComparisonError::Unit {
                sensor,
                name: first.name.to_owned(),
                expected: expected.clone(),
                other: second.name.to_owned(),
                found: found.clone(),
            });
        }
    }
    let frames = [first, second].map(|of| of.record.body_frame);
    let body_frame = BodyFrame::common(frames.into_iter());
    let canonical = |of: Named| Canonical::new(of.name, of.record, nominal, body_frame);
    Ok([canonical(first)?, canonical(second)?])
}

/// A calibration in the general form, in a given body frame, normalised by given nominal scales.
#[derive(Debug, Clone, PartialEq)]
pub struct Canonical {
    /// The body frame.
    pub body_frame: BodyFrame,
    /// Both triads in the general form.
    pub triads: PerSensor<Triad>,
    /// Covariance of the parameters, with zero rows and columns for parameters that were not estimated; `None` if the
    /// calibration states no σ.
    pub covariance: Option<ParameterMatrix>,
    /// Whether the calibration states correlations; if it does not, its errors are treated as independent.
    pub correlated: bool,
    /// Auxiliary constants by name; to first order, these do not depend on the body frame.
    pub constants: BTreeMap<String, TermRecord>,
}

impl Canonical {
    /// Converts a record to a body frame and nominal scales. A calibration in the accelerometer frame cannot be
    /// converted to the table frame, because the table was not observed.
    pub fn new(
        name: &str,
        record: &Calibration,
        nominal: &PerSensor<Nominal>,
        body_frame: BodyFrame,
    ) -> Result<Self, ComparisonError> {
        let triads = in_body_frame(
            &triads_of(record, nominal, InstallationForm::General),
            body_frame,
        );
        for sensor in Sensor::ALL {
            let along = triads.get(sensor).sensitivity().diagonal();
            if let Some(axis) = (0..3).find(|&axis| along[axis].is_nan() || along[axis] <= 0.0) {
                return Err(ComparisonError::Turned {
                    name: name.to_owned(),
                    sensor,
                    axis: AXES[axis],
                });
            }
        }
        let own = record.covariance_by(nominal);
        let own = own.ok_or_else(|| ComparisonError::Covariance {
            name: name.to_owned(),
        })?;
        let own = (own.diagonal().max() > 0.0).then_some(own);
        let covariance = own.map(|covariance| {
            let form = record.installation_form.unwrap_or_default();
            let triads = triads_of(record, nominal, form);
            let j = Estimate { triads, covariance }.to_general_form(body_frame);
            j * covariance * j.transpose()
        });
        Ok(Self {
            body_frame,
            triads,
            covariance,
            correlated: !record.covariance.is_empty(),
            constants: record.terms.clone(),
        })
    }

    /// The parameters of both triads.
    pub fn vector(&self) -> ParameterVector {
        to_vector(&self.triads)
    }

    /// 1σ of each parameter, zero if not estimated; `None` if no σ is stated.
    pub fn sigma(&self) -> Option<ParameterVector> {
        let covariance = self.covariance.as_ref()?;
        Some(covariance.diagonal().map(|v| v.max(0.0).sqrt()))
    }
}

impl Estimate {
    /// The estimate in the general form; parameters that the form fixed get the covariance that follows from the
    /// parameters of the form.
    pub fn in_general_form(&self) -> Self {
        let j = self.to_general_form(BodyFrame::Table);
        Self {
            triads: in_general_form(&self.triads),
            covariance: j * self.covariance * j.transpose(),
        }
    }

    /// Derivatives of the parameters in the general form and a body frame with respect to the parameters of this form.
    pub fn to_general_form(&self, body_frame: BodyFrame) -> ParameterMatrix {
        if (self.form(), body_frame) == (InstallationForm::General, BodyFrame::Table) {
            return ParameterMatrix::identity();
        }
        derivatives(&self.vector(), |v| {
            let general = in_general_form(&from_vector(self.form(), v));
            to_vector(&in_body_frame(&general, body_frame))
        })
    }
}

/// Triads in any body axes, converted to the axes of a body frame; unchanged for the table frame, because the triads do
/// not determine this frame.
pub fn in_body_frame(triads: &PerSensor<Triad>, body_frame: BodyFrame) -> PerSensor<Triad> {
    if body_frame == BodyFrame::Table {
        return *triads;
    }
    let rotation = accelerometer_frame(&triads.accel.sensitivity());
    PerSensor::from_fn(|sensor| {
        let triad = triads.get(sensor);
        let mut a = triad.sensitivity() * rotation.transpose();
        // Entries that the accelerometer frame fixes at zero are exactly zero.
        if sensor == Sensor::Accel {
            a.fill_upper_triangle(0.0, 1);
        }
        Triad::from_sensitivity(triad.form, &a, triad.bias)
    })
}

/// Indices of the parameters that a body frame leaves free, in the general form.
pub fn free_parameters(body_frame: BodyFrame) -> Vec<usize> {
    let mut free: Vec<usize> = (0..PARAMETERS).collect();
    if body_frame == BodyFrame::Accelerometer {
        let fixed: Vec<usize> = Triad::above_the_diagonal(InstallationForm::General)
            .map(|angle| parameter(Sensor::Accel, angle))
            .collect();
        free.retain(|index| !fixed.contains(index));
    }
    free
}

/// The nominal scales for which the scale factors of the record in the general form are one: the norms of the rows of
/// `K C`, with the sign of the scale factor.
pub fn own_nominal(record: &Calibration) -> PerSensor<Nominal> {
    PerSensor::from_fn(|sensor| {
        let triad = record.triad(sensor);
        Nominal(Vector3::from_fn(|i, _| {
            triad.scale[i] * Vector3::from(triad.installation[i]).norm()
        }))
    })
}

/// `R` from the given body frame to the accelerometer frame: `a Rᵀ` is lower triangular. The rows of `R` are the rows
/// of `a`, orthonormalised one after the other; NaN if `a` does not span the space.
pub fn accelerometer_frame(a: &Matrix3<f64>) -> Matrix3<f64> {
    let rows: [Vector3<f64>; 2] = [0, 1].map(|i| a.row(i).transpose());
    let x = rows[0].normalize();
    let z = x.cross(&rows[1]).normalize();
    Matrix3::from_columns(&[x, z.cross(&x), z]).transpose()
}

#[cfg(test)]
pub(crate) mod tests;
