//! Where a pass linearises.

use nalgebra::Matrix3;

use super::error::CalibrationError;
use super::outcome::{from_vector, to_vector};
use crate::attitude::{exp, log};
use crate::imu::{FurtherVector, PerSensor, Sensor, Triad};

/// The point at which a pass linearises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linearisation {
    /// The instrument.
    pub triads: PerSensor<Triad>,
    /// Parameters of its further terms.
    pub further: FurtherVector,
    /// `C_b_n` at the first sample.
    pub initial_attitude: Matrix3<f64>,
}

impl Linearisation {
    /// The point a fraction of the way to another.
    pub(super) fn towards(&self, other: &Self, fraction: f64) -> Self {
        let from = to_vector(&self.triads);
        let turn = log(&(other.initial_attitude * self.initial_attitude.transpose()));
        Self {
            triads: from_vector(
                self.triads.gyro.form,
                &(from + (to_vector(&other.triads) - from) * fraction),
            ),
            further: self.further + (other.further - self.further) * fraction,
            initial_attitude: exp(turn * fraction) * self.initial_attitude,
        }
    }
}

/// The error that names the triad whose sensitivity is singular.
pub(super) fn singular(triads: &PerSensor<Triad>) -> CalibrationError {
    let sensor = Sensor::ALL
        .into_iter()
        .find(|&sensor| triads.get(sensor).correction().is_none())
        .unwrap_or(Sensor::Gyro);
    CalibrationError::Singular { sensor }
}
