//! The quantities that are compared between calibrations.

use crate::calibration::result::frame::free_parameters;
use crate::calibration::{AUXILIARY, auxiliary_name, parameter_name, sensor_and_parameter};
use crate::imu::{AXES, BodyFrame, InstallationForm, ParameterKind, Sensor, Triad};
use crate::magnetic::{MAGNETOMETER, MATRIX, MagneticTriad};

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
    /// An entry of the matrix or of the bias of the magnetometer, in the file's quantity.
    Magnetic(usize),
}

/// Relative 1σ of the errors that all calibrations of a site have in common.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shared {
    /// Of gravity; `None` if the calibrations are not from one site.
    pub gravity: Option<f64>,
    /// Of the magnitude of the magnetic field; `None` if the calibrations are not from one site.
    pub field: Option<f64>,
}

impl Shared {
    /// The 1σ that all calibrations share in a quantity of this value, with the sign of the change of the value.
    pub fn of(&self, quantity: Quantity, value: f64) -> f64 {
        let of = match quantity {
            Quantity::Parameter(index) if follows_gravity(index) => self.gravity,
            Quantity::Magnetic(k) if k < MATRIX => self.field.map(|of| of * value),
            _ => None,
        };
        of.unwrap_or(0.0)
    }
}

fn follows_gravity(index: usize) -> bool {
    let (sensor, of_triad) = sensor_and_parameter(index);
    sensor == Sensor::Accel && Triad::kind(of_triad) == ParameterKind::Scale
}

impl Quantity {
    /// All quantities in this body frame.
    pub fn all(body_frame: BodyFrame) -> impl Iterator<Item = Self> {
        let parameters = free_parameters(body_frame).into_iter().map(Self::Parameter);
        let noise = axes().map(|(sensor, axis)| Self::Noise(sensor, axis));
        parameters
            .chain((0..AUXILIARY).map(Self::Auxiliary))
            .chain(noise)
            .chain((0..MAGNETOMETER).map(Self::Magnetic))
    }

    /// Name in files, such as `gyro.scale.x` or `gyro.noise.x`.
    pub fn name(self) -> String {
        match self {
            Self::Parameter(index) => {
                parameter_name(InstallationForm::General, index).unwrap_or_default()
            }
            Self::Auxiliary(index) => auxiliary_name(index).unwrap_or_default(),
            Self::Noise(sensor, axis) => format!("{}.noise.{}", sensor.name(), AXES[axis]),
            Self::Magnetic(constant) => MagneticTriad::name(constant),
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
