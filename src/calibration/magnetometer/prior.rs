//! Prior of a magnetometer and of the field at its site.

use crate::magnetic::{LocalField, MagneticTriad, MagneticVector};
use crate::recording::Magnetometer;
use crate::run::Run;
use nalgebra::{Matrix3, Vector2, Vector3};

/// 1σ of each entry of the matrix over the magnitude of the field: wide enough for any axes, and for counts of any chip.
const MATRIX: f64 = 30.0;
/// 1σ of the bias, T: a part near a magnet.
const BIAS: f64 = 0.01;

/// Prior of a magnetometer; all σ are zero without one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MagneticPrior {
    /// Mean of each constant.
    pub mean: MagneticVector,
    /// 1σ of each constant.
    pub sigma: MagneticVector,
    /// Magnitude of the field and its 1σ, T; zero for a magnitude by convention.
    pub magnitude: [f64; 2],
    /// 1σ of the disturbance of the field in a dwell per axis, T; zero if not stated.
    pub disturbance: f64,
}

impl MagneticPrior {
    /// The prior of a run.
    pub fn new(run: &Run) -> Self {
        let log = run.recording.magnetometer.as_ref();
        log.map(Self::of_log).unwrap_or_default()
    }

    /// The prior of a magnetometer.
    pub fn of_log(magnetometer: &Magnetometer) -> Self {
        let field = magnetometer.field.unwrap_or_else(LocalField::unknown);
        let vector = |matrix, bias, of: &Vector3<f64>| {
            let (bias, angles) = (Vector3::repeat(bias), Vector2::new(of.y, of.z));
            MagneticTriad {
                matrix,
                bias,
                angles,
            }
            .vector()
        };
        let matrix = Matrix3::repeat(MATRIX * field.mean.x);
        Self {
            mean: vector(Matrix3::zeros(), 0.0, &field.mean),
            sigma: vector(matrix, BIAS, &field.sigma),
            magnitude: [field.mean.x, field.sigma.x],
            disturbance: magnetometer.disturbance,
        }
    }

    /// Declination and inclination.
    pub fn angles(&self) -> Vector2<f64> {
        MagneticTriad::from_vector(&self.mean).angles
    }

    /// Whether the magnitude of the field is known; otherwise it is a convention.
    pub fn knows_magnitude(&self) -> bool {
        self.magnitude[1] > 0.0
    }

    /// Whether there is a magnetometer.
    pub fn is_on(&self) -> bool {
        self.magnitude[0] > 0.0
    }
}
