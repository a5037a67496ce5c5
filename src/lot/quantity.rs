//! The quantities that are compared between units.

use crate::calibration::result::frame::free_parameters;
use crate::calibration::{parameter_name, sensor_and_parameter};
use crate::imu::{AXES, BodyFrame, InstallationForm, ParameterKind, Sensor, Triad};

/// Every axis of both triads.
pub fn axes() -> impl Iterator<Item = (Sensor, usize)> {
    let axes = |sensor| (0..AXES.len()).map(move |axis| (sensor, axis));
    Sensor::ALL.into_iter().flat_map(axes)
}

/// A quantity with one value per unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// A parameter of both triads by its index, in the general form.
    Parameter(usize),
    /// The natural logarithm of an axis' white-noise density at rest.
    Noise(Sensor, usize),
}

impl Quantity {
    /// All quantities of units in this body frame.
    pub fn all(body_frame: BodyFrame) -> Vec<Self> {
        let parameters = free_parameters(body_frame).into_iter();
        let noise = axes().map(|(sensor, axis)| Self::Noise(sensor, axis));
        parameters.map(Self::Parameter).chain(noise).collect()
    }

    /// Whether a relative error of gravity causes the same relative error.
    pub fn follows_gravity(self) -> bool {
        let Self::Parameter(index) = self else {
            return false;
        };
        let (sensor, of_triad) = sensor_and_parameter(index);
        sensor == Sensor::Accel && Triad::kind(of_triad) == ParameterKind::Scale
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
    /// Zero if no σ is stated.
    pub sigma: f64,
}
