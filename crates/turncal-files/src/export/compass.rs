//! A magnetometer as autopilots apply it: `matrix (n − offset)` with a symmetric matrix, along the axes of the vehicle to
//! which the driver turns the output.

use nalgebra::{Matrix3, Vector3};

use super::values::Values;
use crate::quantity::units_of_field;
use turncal::units::DEGREE;

/// Smallest cosine between an axis of the magnetometer and the nearest axis of the vehicle.
const ALONG: f64 = 0.8;

/// Offset and matrix in the quantity that a program reads.
pub struct Compass {
    pub matrix: Matrix3<f64>,
    pub offset: Vector3<f64>,
    /// Output along the axes of the vehicle per field.
    sensitivity: Matrix3<f64>,
}

/// What a program reads.
#[derive(Debug, Clone, Copy)]
pub enum Reads {
    /// A quantity, by its number per tesla.
    Field(f64),
    /// Counts, whose scale the program does not use.
    Counts,
}

/// The magnetometer of a calibration; the reason if the program cannot apply it, and `None` if there is none.
pub fn compass(values: &Values, reads: Reads) -> Option<Result<Compass, String>> {
    let mag = values.record.mag.as_ref()?;
    let is_count = mag.unit == "count";
    let per_tesla = units_of_field().find(|(name, _)| *name == mag.unit)?.1;
    let ratio = match reads {
        Reads::Field(_) if is_count => {
            let why = "the log contains counts, and the program reads a field; set mag_unit to the unit of the driver";
            return Some(Err(why.to_owned()));
        }
        Reads::Counts if !is_count => {
            let why = "the program reads counts; calibrate a log of the raw counts";
            return Some(Err(why.to_owned()));
        }
        Reads::Field(of_program) => of_program / per_tesla,
        Reads::Counts => 1.0,
    };
    let of_file = Matrix3::from_fn(|i, j| mag.matrix[i][j]);
    let mut sensitivity = of_file * values.order.matrix() / per_tesla;
    if is_count || mag.field.unit != "T" {
        sensitivity /= sensitivity.determinant().abs().cbrt();
    }
    let svd = sensitivity.svd(true, true);
    let Some(axes) = nearest(&(svd.u? * svd.v_t?)) else {
        let why = "no axis of the magnetometer is along an axis of the gyros, and the parameters contain no rotation";
        return Some(Err(why.to_owned()));
    };
    let to_vehicle = axes.transpose();
    let (sensitivity, offset) = match reads {
        Reads::Field(_) => (
            to_vehicle * sensitivity,
            to_vehicle * Vector3::from(mag.bias) * ratio,
        ),
        // These programs correct the axes of the chip, and then turn them.
        Reads::Counts => (sensitivity * to_vehicle, mag.bias.into()),
    };
    let inverse = sensitivity.try_inverse()?;
    Some(Ok(Compass {
        matrix: (inverse + inverse.transpose()) / 2.0,
        offset,
        sensitivity,
    }))
}

/// The order and signs of the axes that are nearest to a rotation or reflection.
fn nearest(axes: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let rounded = axes.map(f64::round);
    let is_order = axes.component_mul(&rounded).column_sum().min() > ALONG;
    (is_order && (rounded.transpose() * rounded).is_identity(0.1)).then_some(rounded)
}

impl Compass {
    /// Entries xy, xz and yz of the matrix.
    pub fn off_diagonal(&self) -> Vector3<f64> {
        let m = &self.matrix;
        Vector3::new(m[(0, 1)], m[(0, 2)], m[(1, 2)])
    }

    /// A sentence with the size of the error that a program with this matrix leaves.
    pub fn residual(&self, matrix: &Matrix3<f64>) -> String {
        let errors = matrix * self.sensitivity - Matrix3::identity();
        let worst = errors.singular_values().max();
        format!(
            "magnetometer: the remaining error is up to {:.3} % of the field, or {:.2} deg of its direction",
            100.0 * worst,
            worst.min(1.0).asin() / DEGREE
        )
    }
}
