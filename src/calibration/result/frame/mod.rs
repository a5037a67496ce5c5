//! Calibrations brought to the general form, one body frame and one nominal scale, so that they can
//! be subtracted.
//!
//! The same instrument has another `C` in every body frame: `K C u = K (C Rᵀ)(R u)`. In the
//! accelerometer frame (`x` along accelerometer x, `y` in the plane of accelerometers x and y) `R`
//! is the orthogonal factor of the LQ decomposition of the accelerometers' `K C` (Golub, Van Loan,
//! *Matrix Computations*, 4th ed., §5.2). Row norms of `K C`, so the general form's scale factors,
//! and biases are the same in every frame.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::{Calibration, TermRecord, triads_of};
use crate::attitude::skew;
use crate::calibration::error::ComparisonError;
use crate::calibration::estimate::Estimate;
use crate::calibration::parameters::{
    PARAMETERS, ParameterMatrix, ParameterVector, factor, in_general_form, parameter,
    parameter_index, parameter_name, sensor_and_parameter, to_vector,
};
use crate::imu::{
    AXES, BodyFrame, InstallationForm, Nominal, PerSensor, Sensor, Triad, TriadVector,
};

/// A calibration in the general form, in a given body frame, normalised by given nominal scales.
#[derive(Debug, Clone, PartialEq)]
pub struct Canonical {
    /// What it is called in tables and messages.
    pub name: String,
    /// What fixes the body axes.
    pub body_frame: BodyFrame,
    /// Both triads, in the general form.
    pub triads: PerSensor<Triad>,
    /// Covariance of their parameters, zero rows and columns where not estimated; none if the record
    /// claims no σ at all.
    pub covariance: Option<ParameterMatrix>,
    /// Whether the record gives correlations; if not, the covariance takes its σ for independent.
    pub correlated: bool,
    /// Constants beside the parameters by name, which no body frame changes to first order.
    pub constants: BTreeMap<String, TermRecord>,
    /// False only if the record says that its method did not converge.
    pub converged: bool,
}

impl Canonical {
    /// Brings a record to a body frame and to nominal scales. A frame on the table cannot be had from
    /// a record in the accelerometer frame: there the table was not seen.
    pub(crate) fn new(
        name: &str,
        record: &Calibration,
        nominal: &PerSensor<Nominal>,
        body_frame: BodyFrame,
    ) -> Result<Self, ComparisonError> {
        let given =
            PerSensor::from_fn(|sensor| record.triad(sensor).normalised(nominal.get(sensor)));
        let rotation = match body_frame {
            BodyFrame::Table => Matrix3::identity(),
            BodyFrame::Accelerometer => accelerometer_frame(&given.accel),
        };
        let triad = |sensor: Sensor| {
            let mut a = given.get(sensor) * rotation.transpose();
            clear_fixed(&mut a, sensor, body_frame);
            let turned = (0..3).find(|&i| a[(i, i)].is_nan() || a[(i, i)] <= 0.0);
            if let Some(axis) = turned {
                return Err(ComparisonError::Turned {
                    name: name.to_owned(),
                    sensor,
                    axis: AXES[axis],
                });
            }
            let bias = Vector3::from(record.triad(sensor).bias);
            let bias = bias.component_div(&nominal.get(sensor).0);
            Ok(Triad::from_sensitivity(InstallationForm::General, &a, bias))
        };
        let triads = PerSensor {
            gyro: triad(Sensor::Gyro)?,
            accel: triad(Sensor::Accel)?,
        };
        let own = own_covariance(name, record, nominal)?;
        let covariance = own.map(|own| {
            let form = record.installation_form.unwrap_or_default();
            let own_triads = triads_of(record, nominal, form);
            let j = jacobian(&own_triads, &triads, body_frame, &rotation);
            j * own * j.transpose()
        });
        Ok(Self {
            name: name.to_owned(),
            body_frame,
            triads,
            covariance,
            correlated: !record.covariance.is_empty(),
            constants: record.terms.clone(),
            converged: record.converged != Some(false),
        })
    }

    /// The parameters of both triads.
    pub fn vector(&self) -> ParameterVector {
        to_vector(&self.triads)
    }

    /// 1σ of each parameter, zero where not estimated; none if no σ is claimed.
    pub fn sigma(&self) -> Option<ParameterVector> {
        let covariance = self.covariance.as_ref()?;
        Some(covariance.diagonal().map(|v| v.max(0.0).sqrt()))
    }
}

impl Estimate {
    /// The same calibration in the general form; what the form held fixed gets the covariance that
    /// follows from its own parameters.
    pub fn in_general_form(&self) -> Self {
        let j = self.to_general_form();
        Self {
            triads: in_general_form(&self.triads),
            covariance: j * self.covariance * j.transpose(),
        }
    }

    /// `∂general/∂own` parameters.
    pub fn to_general_form(&self) -> ParameterMatrix {
        jacobian(
            &self.triads,
            &in_general_form(&self.triads),
            BodyFrame::Table,
            &Matrix3::identity(),
        )
    }
}

/// The same triads, given on any body axes, on those of a body frame; as they are on the table's,
/// which they do not tell.
pub fn in_body_frame(triads: &PerSensor<Triad>, body_frame: BodyFrame) -> PerSensor<Triad> {
    if body_frame == BodyFrame::Table {
        return *triads;
    }
    let rotation = accelerometer_frame(&triads.accel.sensitivity());
    PerSensor::from_fn(|sensor| {
        let triad = triads.get(sensor);
        let mut a = triad.sensitivity() * rotation.transpose();
        clear_fixed(&mut a, sensor, body_frame);
        Triad::from_sensitivity(triad.form, &a, triad.bias)
    })
}

/// Indices of the parameters that a body frame leaves free, in the general form.
pub(crate) fn free_parameters(body_frame: BodyFrame) -> Vec<usize> {
    let mut free: Vec<usize> = (0..PARAMETERS).collect();
    if body_frame == BodyFrame::Accelerometer {
        let fixed: Vec<usize> = Triad::above_the_diagonal(InstallationForm::General)
            .map(|angle| parameter(Sensor::Accel, angle))
            .collect();
        free.retain(|index| !fixed.contains(index));
    }
    free
}

/// The nominal scales by which a record's own scale factors in the general form are one: the norms
/// of the rows of `K C`, with the sign of the scale factor.
pub fn own_nominal(record: &Calibration) -> PerSensor<Nominal> {
    PerSensor::from_fn(|sensor| {
        let triad = record.triad(sensor);
        Nominal(Vector3::from_fn(|i, _| {
            triad.scale[i] * Vector3::from(triad.installation[i]).norm()
        }))
    })
}

/// `R` from the given body frame to the accelerometer frame: `a Rᵀ` is lower triangular. Its rows are
/// those of `a`, made orthonormal one after the other; NaN where `a` does not span the space.
pub(crate) fn accelerometer_frame(a: &Matrix3<f64>) -> Matrix3<f64> {
    let rows: [Vector3<f64>; 2] = [0, 1].map(|i| a.row(i).transpose());
    let x = rows[0].normalize();
    let z = x.cross(&rows[1]).normalize();
    Matrix3::from_columns(&[x, z.cross(&x), z]).transpose()
}

/// What the accelerometer frame fixes at zero is zero, without rounding.
fn clear_fixed(a: &mut Matrix3<f64>, sensor: Sensor, body_frame: BodyFrame) {
    if sensor == Sensor::Accel && body_frame == BodyFrame::Accelerometer {
        a.fill_upper_triangle(0.0, 1);
    }
}

/// Covariance of the record's own parameters, normalised; none if it claims no σ.
fn own_covariance(
    name: &str,
    record: &Calibration,
    nominal: &PerSensor<Nominal>,
) -> Result<Option<ParameterMatrix>, ComparisonError> {
    let form = record.installation_form.unwrap_or_default();
    let factor = |index| factor(nominal, index);
    let mut covariance = ParameterMatrix::zeros();
    if record.covariance.is_empty() {
        for index in 0..PARAMETERS {
            let name = parameter_name(form, index);
            let sigma = name.and_then(|name| record.sigma_of(&name).copied());
            covariance[(index, index)] = (sigma.unwrap_or(0.0) / factor(index)).powi(2);
        }
    }
    let malformed = || ComparisonError::Covariance {
        name: name.to_owned(),
    };
    let names = record.parameters.iter();
    let indices: Option<Vec<usize>> = names.map(|name| parameter_index(form, name)).collect();
    let indices = indices.ok_or_else(malformed)?;
    let square = record
        .covariance
        .iter()
        .all(|row| row.len() == indices.len());
    if !square || record.covariance.len() != indices.len() {
        return Err(malformed());
    }
    for (&i, row) in indices.iter().zip(&record.covariance) {
        for (&j, value) in indices.iter().zip(row) {
            covariance[(i, j)] = value / (factor(i) * factor(j));
        }
    }
    Ok((covariance.diagonal().max() > 0.0).then_some(covariance))
}

/// `∂canonical/∂own`: a column for each of the record's own parameters.
fn jacobian(
    own: &PerSensor<Triad>,
    canonical: &PerSensor<Triad>,
    body_frame: BodyFrame,
    rotation: &Matrix3<f64>,
) -> ParameterMatrix {
    let responses = PerSensor::from_fn(|sensor| own.get(sensor).response());
    let mut jacobian = ParameterMatrix::zeros();
    for index in 0..PARAMETERS {
        let (sensor, of_triad) = sensor_and_parameter(index);
        let response = responses.get(sensor)[of_triad];
        let tangent = response.fixed_view::<3, 3>(0, 0) * rotation.transpose();
        let turn = match (body_frame, sensor) {
            (BodyFrame::Accelerometer, Sensor::Accel) => {
                frame_turn(&canonical.accel.sensitivity(), &tangent)
            }
            _ => Vector3::zeros(),
        };
        let column = PerSensor::from_fn(|of| {
            let triad = canonical.get(of);
            // The frame turns with the accelerometers, and the other triad with it.
            let mut da = -triad.sensitivity() * skew(turn);
            let mut bias = Vector3::zeros();
            if of == sensor {
                da += tangent;
                bias = response.column(3).into_owned();
            }
            clear_fixed(&mut da, of, body_frame);
            general_tangent(triad, &da, bias)
        });
        for of in Sensor::ALL {
            let rows = parameter(of, 0);
            jacobian
                .fixed_view_mut::<{ crate::imu::PARAMETERS }, 1>(rows, index)
                .copy_from(column.get(of));
        }
    }
    jacobian
}

/// The rotation `ρ` of the accelerometer frame, `R ← (I + [ρ×]) R`, that keeps
/// `l + tangent − l [ρ×]` lower triangular.
fn frame_turn(l: &Matrix3<f64>, tangent: &Matrix3<f64>) -> Vector3<f64> {
    let z = -tangent[(0, 1)] / l[(0, 0)];
    let y = tangent[(0, 2)] / l[(0, 0)];
    let x = (l[(1, 0)] * y - tangent[(1, 2)]) / l[(1, 1)];
    Vector3::new(x, y, z)
}

/// How the general form's parameters move with `K C` and the bias.
fn general_tangent(triad: &Triad, da: &Matrix3<f64>, bias: Vector3<f64>) -> TriadVector {
    let c = triad.installation();
    // Rows of C have unit norm, so along them only the scale factor changes.
    let scale = Vector3::from_fn(|i, _| c.row(i).dot(&da.row(i)));
    let mut moved = Triad {
        scale,
        bias,
        ..*triad
    };
    for (angle, &(i, j)) in moved.angles.iter_mut().zip(triad.form.angle_names()) {
        *angle = (da[(i, j)] - c[(i, j)] * scale[i]) / triad.scale[i];
    }
    moved.to_vector()
}

#[cfg(test)]
pub(crate) mod tests;
