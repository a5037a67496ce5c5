//! Rows of a mean output at rest in a field of unknown direction.

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Vector3};

use super::at_rest::AtRest;
use crate::magnetic::{MAGNETIC, MagneticTriad};

/// Whitened rows of one mean, without the unknown direction of the field.
pub struct Rows {
    pub columns: DMatrix<f64>,
    pub values: DVector<f64>,
    pub freedom: usize,
}

impl Rows {
    pub fn new(rest: &AtRest, triad: &MagneticTriad, commons: usize) -> Option<Self> {
        let MagneticTriad {
            matrix,
            bias,
            angles,
        } = triad;
        let output = &rest.mean.output;
        let seen = (matrix.try_inverse()? * (output - bias)).try_normalize(0.0)?;
        let (sin, cos) = angles.y.sin_cos();
        let mut covariance = Matrix3::from_diagonal(&rest.mean.sigma.map(|sigma| sigma * sigma));
        let mut by_common = DMatrix::zeros(3, commons);
        let mut by_inclination = Vector3::zeros();
        let (field, unknown) = match &rest.up {
            None => (seen, across(&seen).to_vec()),
            Some(up) => {
                let level = (seen - up.direction * seen.dot(&up.direction)).try_normalize(1e-9)?;
                let field = level * cos - up.direction * sin;
                by_inclination = -level * sin - up.direction * cos;
                for axis in across(&up.direction) {
                    let tilted = matrix * axis.cross(&field) * up.tilt;
                    covariance += tilted * tilted.transpose();
                }
                for (k, change) in up.by_common.column_iter().enumerate() {
                    let change = Vector3::new(change[0], change[1], change[2]);
                    let turned = up.direction.cross(&change).cross(&field);
                    by_common.set_column(k, &(matrix * turned));
                }
                (field, vec![up.direction.cross(&field)])
            }
        };
        let mut columns = DMatrix::zeros(3, MAGNETIC + commons);
        for row in 0..3 {
            (0..3).for_each(|k| columns[(row, 3 * row + k)] = field[k]);
            columns[(row, 9 + row)] = 1.0;
        }
        columns.set_column(MAGNETIC - 1, &(matrix * by_inclination));
        columns.columns_mut(MAGNETIC, commons).copy_from(&by_common);
        let root = Cholesky::new(covariance)?.l();
        let mut values = root.solve_lower_triangular(&(output - matrix * field - bias))?;
        let mut columns = root.solve_lower_triangular(&columns)?;
        let unknown =
            Matrix3::from_fn(|row, k| unknown.get(k).map_or(0.0, |of| (matrix * of)[row]));
        let count = if rest.up.is_some() { 1 } else { 2 };
        let directions = root.solve_lower_triangular(&unknown)?.svd(true, false).u?;
        for direction in directions.column_iter().take(count) {
            values -= direction * direction.dot(&values);
            let along = direction.tr_mul(&columns);
            columns -= direction * along;
        }
        Some(Self {
            columns,
            values: DVector::from_column_slice(values.as_slice()),
            freedom: 3 - count,
        })
    }
}

/// Two unit vectors perpendicular to a unit vector and to each other.
fn across(axis: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let other = Vector3::ith(axis.iamin(), 1.0);
    let first = axis.cross(&other).normalize();
    [first, axis.cross(&first)]
}
