//! A magnetometer as autopilots apply it: `matrix (n − offset)` with a symmetric matrix, along the axes of the chip or of
//! the vehicle. Between the two, the driver turns by right angles.

use nalgebra::{Matrix3, Vector3};

use super::values::Values;
use crate::quantity::units_of_field;
use turncal::units::DEGREE;

/// Offset and matrix in the quantity that a program reads.
pub struct Compass {
    pub matrix: Matrix3<f64>,
    pub offset: Vector3<f64>,
    /// Output per field, along the same axes.
    sensitivity: Matrix3<f64>,
}

/// What a program corrects.
#[derive(Debug, Clone, Copy)]
pub struct Reads {
    /// Its quantity per tesla; `None` for counts, whose scale it does not use.
    pub per_tesla: Option<f64>,
    /// Whether it corrects the output along the axes of the chip, before it turns them to those of the vehicle.
    pub of_chip: bool,
}

/// The magnetometer of a calibration; the reason if the program cannot apply it, and `None` if there is none.
pub fn compass(values: &Values, reads: Reads) -> Option<Result<Compass, String>> {
    let mag = values.record.mag.as_ref()?;
    let is_count = mag.unit == "count";
    let per_tesla = units_of_field().find(|(name, _)| *name == mag.unit)?.1;
    let ratio = match reads.per_tesla {
        Some(_) if is_count => {
            let why = "the log contains counts, but the program reads a field; set mag_unit to the unit of the driver";
            return Some(Err(why.to_owned()));
        }
        None if !is_count => {
            let why = "the program reads counts; calibrate a log of the raw counts";
            return Some(Err(why.to_owned()));
        }
        of_program => of_program.map_or(1.0, |of_program| of_program / per_tesla),
    };
    let of_file = Matrix3::from_fn(|i, j| mag.matrix[i][j]);
    let mut sensitivity = of_file * values.order.matrix() / per_tesla;
    if is_count || mag.field.unit != "T" {
        sensitivity /= sensitivity.determinant().abs().cbrt();
    }
    let svd = sensitivity.svd(true, true);
    let axes = (svd.u? * svd.v_t?).map(f64::round);
    if !(axes.transpose() * axes).is_identity(0.0) {
        let why = "its axes are not near those of the gyros, and the parameters cannot describe a rotation";
        return Some(Err(why.to_owned()));
    }
    let to_vehicle = axes.transpose();
    let bias = Vector3::from(mag.bias) * ratio;
    let (sensitivity, offset) = if reads.of_chip {
        (sensitivity * to_vehicle, bias)
    } else {
        (to_vehicle * sensitivity, to_vehicle * bias)
    };
    let inverse = sensitivity.try_inverse()?;
    Some(Ok(Compass {
        matrix: (inverse + inverse.transpose()) / 2.0,
        offset,
        sensitivity,
    }))
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
