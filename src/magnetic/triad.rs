//! Output of a magnetometer as a function of attitude and field.

use nalgebra::{Matrix3, Matrix3x2, SMatrix, SVector, Vector2, Vector3};

use crate::attitude::skew;
use crate::imu::AXES;

/// Number of constants: matrix row by row, bias, then declination and inclination of the field.
pub const MAGNETIC: usize = 14;
/// The constants of a magnetometer and its field, in order.
pub type MagneticVector = SVector<f64, MAGNETIC>;

/// Number of constants of the magnetometer alone: matrix and bias.
pub const MAGNETOMETER: usize = 12;
/// Number of entries of the matrix, which are the first constants.
pub const MATRIX: usize = 9;

const BIAS: usize = MATRIX;
const FIELD: usize = MAGNETOMETER;

/// A magnetometer in a constant field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MagneticTriad {
    /// Output for a field of the local magnitude along each body axis, T.
    pub matrix: Matrix3<f64>,
    /// Output without a field, T.
    pub bias: Vector3<f64>,
    /// Declination from North towards East and inclination below the horizon, rad.
    pub angles: Vector2<f64>,
}

/// Change of the output in one attitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MagneticResponse {
    /// The output.
    pub output: Vector3<f64>,
    /// Per attitude error φ about East, North and Up.
    pub by_attitude: Matrix3<f64>,
    /// Per change of the field along East, North and Up, relative to its magnitude.
    pub by_field: Matrix3<f64>,
    /// Per constant.
    pub by_constants: SMatrix<f64, 3, MAGNETIC>,
}

impl MagneticTriad {
    /// The magnetometer with these constants.
    pub fn from_vector(values: &MagneticVector) -> Self {
        Self {
            matrix: Matrix3::from_fn(|row, column| values[3 * row + column]),
            bias: values.fixed_rows::<3>(BIAS).into(),
            angles: values.fixed_rows::<2>(FIELD).into(),
        }
    }

    /// The constants.
    pub fn vector(&self) -> MagneticVector {
        MagneticVector::from_fn(|k, _| match k {
            FIELD.. => self.angles[k - FIELD],
            BIAS.. => self.bias[k - BIAS],
            _ => self.matrix[(k / 3, k % 3)],
        })
    }

    /// The output in an attitude `C_b_n`, with its derivatives.
    pub fn response(&self, attitude: &Matrix3<f64>) -> MagneticResponse {
        let (field, by_angles) = direction(&self.angles);
        let by_field = self.matrix * attitude.transpose();
        let along_body = attitude.tr_mul(&field);
        let by_constants = SMatrix::from_fn(|row, k| match k {
            FIELD.. => (by_field * by_angles)[(row, k - FIELD)],
            BIAS.. => f64::from(u8::from(k - BIAS == row)),
            _ if k / 3 == row => along_body[k % 3],
            _ => 0.0,
        });
        MagneticResponse {
            output: by_field * field + self.bias,
            // C_true = (I + [φ×]) C_computed, so the field turns by −φ.
            by_attitude: by_field * skew(field),
            by_field,
            by_constants,
        }
    }

    /// The change of N constants, of which the matrix is the first, to axes to which this rotation turns the field.
    pub fn to_axes<const N: usize>(rotation: &Matrix3<f64>) -> SMatrix<f64, N, N> {
        let mut all = SMatrix::<f64, N, N>::identity();
        for row in (0..MATRIX).step_by(3) {
            let mut block = all.view_mut((row, row), (3, 3));
            block.copy_from(rotation);
        }
        all
    }

    /// Name of a constant, such as `mag.matrix.xy`.
    pub fn name(constant: usize) -> String {
        match constant {
            FIELD.. => format!(
                "mag.field.{}",
                ["declination", "inclination"][(constant - FIELD).min(1)]
            ),
            BIAS.. => format!("mag.bias.{}", AXES[constant - BIAS]),
            _ => format!("mag.matrix.{}{}", AXES[constant / 3], AXES[constant % 3]),
        }
    }
}

/// The direction of the field along East, North and Up, and its derivatives with respect to declination and inclination.
fn direction(angles: &Vector2<f64>) -> (Vector3<f64>, Matrix3x2<f64>) {
    let ((sin_d, cos_d), (sin_i, cos_i)) = (angles.x.sin_cos(), angles.y.sin_cos());
    let east = Vector3::new(cos_d * cos_i, -sin_d * cos_i, 0.0);
    let down = Vector3::new(-sin_d * sin_i, -cos_d * sin_i, -cos_i);
    let direction = Vector3::new(sin_d * cos_i, cos_d * cos_i, -sin_i);
    (direction, Matrix3x2::from_columns(&[east, down]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::exp;
    use approx::assert_relative_eq;

    #[test]
    fn the_output_changes_as_its_derivatives_say() {
        let values = MagneticVector::from_fn(|k, _| 0.1 * k as f64 - 0.3);
        let attitude = exp(Vector3::new(0.3, -1.1, 2.0));
        let at = MagneticTriad::from_vector(&values);
        assert_relative_eq!(at.vector(), values);
        let response = at.response(&attitude);
        let step = 1e-6;
        for k in 0..MAGNETIC {
            let mut moved = values;
            moved[k] += step;
            let moved = MagneticTriad::from_vector(&moved).response(&attitude);
            let slope = (moved.output - response.output) / step;
            assert_relative_eq!(
                slope,
                response.by_constants.column(k).into_owned(),
                epsilon = 1e-5
            );
        }
        for axis in 0..3 {
            // The true attitude is exp([φ×]) times the computed one.
            let truth = exp(Vector3::ith(axis, step)) * attitude;
            let slope = (at.response(&truth).output - response.output) / step;
            assert_relative_eq!(
                slope,
                response.by_attitude.column(axis).into_owned(),
                epsilon = 1e-5
            );
        }
    }
}
