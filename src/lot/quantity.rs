//! What is compared between units.

use crate::calibration::parameter_name;
use crate::imu::{AXES, InstallationForm, Sensor};

/// A number that every unit has one of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// A parameter of both triads by its index, in the general form.
    Parameter(usize),
    /// The natural logarithm of an axis' white-noise density at rest.
    Noise(Sensor, usize),
}

impl Quantity {
    /// Noise of all six axes.
    pub(super) fn noise() -> impl Iterator<Item = Self> {
        let axes = |sensor| (0..AXES.len()).map(move |axis| Self::Noise(sensor, axis));
        Sensor::ALL.into_iter().flat_map(axes)
    }

    /// Its name in files, such as `gyro.scale.x` or `gyro.noise.x`.
    pub fn name(self) -> String {
        match self {
            Self::Parameter(index) => {
                parameter_name(InstallationForm::General, index).unwrap_or_default()
            }
            Self::Noise(sensor, axis) => format!("{}.noise.{}", sensor.name(), AXES[axis]),
        }
    }
}

/// A unit's value with its 1σ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Normalised, in SI.
    pub value: f64,
    /// Zero where none is claimed.
    pub sigma: f64,
}
