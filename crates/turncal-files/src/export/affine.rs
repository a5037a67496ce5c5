//! Calibrations in the form in which other programs apply them: one matrix and one offset per triad, and the residual
//! errors.

use nalgebra::{Matrix3, Vector3};

use super::values::{Normalised, Values};
use turncal::imu::{PerSensor, Sensor};
use turncal::units::{ARCSEC, DEGREE, PPM, STANDARD_GRAVITY};

/// The calibrated value computed by a program, `matrix (n − offset)`.
pub struct Affine {
    pub matrix: Matrix3<f64>,
    pub offset: Vector3<f64>,
}

impl Affine {
    /// A program that only subtracts an offset.
    pub fn offset(offset: Vector3<f64>) -> Self {
        Self::diagonal(Vector3::repeat(1.0), offset)
    }

    /// A program that applies a factor and an offset to each axis.
    pub fn diagonal(factor: Vector3<f64>, offset: Vector3<f64>) -> Self {
        let matrix = Matrix3::from_diagonal(&factor);
        Self { matrix, offset }
    }

    /// The complete correction for a triad.
    pub fn complete(triad: &Normalised) -> Self {
        Self {
            matrix: triad.inverse,
            offset: triad.bias,
        }
    }

    /// The bias in corrected units: `matrix n − bias`.
    pub fn corrected_bias(&self) -> Vector3<f64> {
        self.matrix * self.offset
    }
}

/// Residual error of a program, as a function of the input u: `errors u + constant`.
pub struct Residual {
    sensor: Sensor,
    errors: Matrix3<f64>,
    constant: Vector3<f64>,
}

impl Residual {
    /// Residual errors of both triads that exceed rounding.
    pub fn all(values: &Values, program: &PerSensor<Affine>) -> Vec<Self> {
        let of = |sensor| {
            let (triad, program) = (values.triads.get(sensor), program.get(sensor));
            Self {
                sensor,
                errors: program.matrix * triad.sensitivity - Matrix3::identity(),
                constant: program.matrix * (triad.bias - program.offset),
            }
        };
        let exceeds = |of: &Self| of.errors.amax().max(of.constant.amax()) >= 1e-12;
        Sensor::ALL.into_iter().map(of).filter(exceeds).collect()
    }

    /// A sentence with the size of the residual error.
    pub fn words(&self) -> String {
        let scale = self.errors.diagonal().amax();
        let mut across = self.errors;
        across.fill_diagonal(0.0);
        // The largest length of `errors u` for u of length one.
        let worst = self.errors.singular_values().max();
        let constant = self.constant.amax();
        let (name, example, bias) = match self.sensor {
            Sensor::Gyro => (
                "gyros",
                format!("{:.3} deg/s at 100 deg/s", 100.0 * worst),
                format!("{:.3} deg/h", constant / DEGREE * 3600.0),
            ),
            Sensor::Accel => (
                "accelerometers",
                format!("{:.3} mg at 1 g", 1e3 * worst),
                format!("{:.3} mg", 1e3 * constant / STANDARD_GRAVITY),
            ),
        };
        format!(
            "{name}: the remaining error is up to {:.1} ppm in scale, {:.1} arcsec in misalignment ({example} if both \
             are combined in any direction), and {bias} in bias",
            scale / PPM,
            across.amax() / ARCSEC
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_residual_is_as_long_as_the_longest_error_vector_of_any_input() {
        // Each row is 1e-3 long, yet along (1, 1, 1)/√3 all three err by it at once.
        let errors = Matrix3::repeat(1e-3 / 3f64.sqrt());
        let residual = Residual {
            sensor: Sensor::Accel,
            errors,
            constant: Vector3::zeros(),
        };
        let input = Vector3::repeat(1.0 / 3f64.sqrt());
        assert!(((errors * input).norm() - 1.732e-3).abs() < 1e-6);
        let words = residual.words();
        assert!(
            words.contains("1.732 mg at 1 g in any direction"),
            "{words}"
        );
    }
}
