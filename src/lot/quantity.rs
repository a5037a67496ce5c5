//! The quantities that are compared between calibrations.

use crate::calibration::result::frame::free_parameters;
use crate::calibration::{AUXILIARY, auxiliary_name, parameter_name, sensor_and_parameter};
use crate::imu::{AXES, BodyFrame, InstallationForm, ParameterKind, Sensor, Triad};

/// All axes of both triads.
pub fn axes() -> impl Iterator<Item = (Sensor, usize)> {
    let axes = |sensor| (0..AXES.len()).map(move |axis| (sensor, axis));
    Sensor::ALL.into_iter().flat_map(axes)
}

/// A quantity with one value per calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// A parameter of both triads by its index, in the general form.
    Parameter(usize),
    /// A parameter of an error term by its index.
    Auxiliary(usize),
    /// White-noise density of an axis at rest.
    Noise(Sensor, usize),
}

impl Quantity {
    /// All quantities in this body frame.
    pub fn all(body_frame: BodyFrame) -> impl Iterator<Item = Self> {
        let parameters = free_parameters(body_frame).into_iter().map(Self::Parameter);
        let noise = axes().map(|(sensor, axis)| Self::Noise(sensor, axis));
        parameters
            .chain((0..AUXILIARY).map(Self::Auxiliary))
            .chain(noise)
    }

    /// The 1σ that all calibrations share if they have this relative 1σ of gravity in common.
    pub fn shared(self, gravity: f64) -> f64 {
        let follows_gravity = |index| {
            let (sensor, of_triad) = sensor_and_parameter(index);
            sensor == Sensor::Accel && Triad::kind(of_triad) == ParameterKind::Scale
        };
        match self {
            Self::Parameter(index) if follows_gravity(index) => gravity,
            _ => 0.0,
        }
    }

    /// Name in files, such as `gyro.scale.x` or `gyro.noise.x`.
    pub fn name(self) -> String {
        match self {
            Self::Parameter(index) => {
                parameter_name(InstallationForm::General, index).unwrap_or_default()
            }
            Self::Auxiliary(index) => auxiliary_name(index).unwrap_or_default(),
            Self::Noise(sensor, axis) => format!("{}.noise.{}", sensor.name(), AXES[axis]),
        }
    }
}

/// A value with its 1σ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Normalised value, in SI units.
    pub value: f64,
    /// 1σ of the value; zero if none is stated.
    pub sigma: f64,
}

impl Sample {
    /// The value in units of its σ; `None` without σ.
    pub fn in_sigma(self) -> Option<f64> {
        (self.sigma > 0.0).then(|| self.value / self.sigma)
    }
}
