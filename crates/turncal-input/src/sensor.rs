//! The two triads of an inertial measurement unit.

use serde::{Deserialize, Serialize};

/// One of the two triads of an IMU.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Sensor {
    /// Angular rate in rad/s.
    Gyro,
    /// Specific force in m/s².
    Accel,
}

impl Sensor {
    /// Both triads, in the order of all files and state vectors.
    pub const ALL: [Self; 2] = [Self::Gyro, Self::Accel];

    /// The name used in files and in parameter names.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gyro => "gyro",
            Self::Accel => "accel",
        }
    }

    /// The first value for the gyros, the second for the accelerometers.
    pub fn pick<T>(self, gyro: T, accel: T) -> T {
        match self {
            Self::Gyro => gyro,
            Self::Accel => accel,
        }
    }
}

/// One value for the gyros and one for the accelerometers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct PerSensor<T> {
    /// The gyros' value.
    pub gyro: T,
    /// The accelerometers' value.
    pub accel: T,
}

impl<T> PerSensor<T> {
    /// The value of one triad.
    pub fn get(&self, sensor: Sensor) -> &T {
        sensor.pick(&self.gyro, &self.accel)
    }

    /// A mutable reference to the value of one triad.
    pub fn get_mut(&mut self, sensor: Sensor) -> &mut T {
        sensor.pick(&mut self.gyro, &mut self.accel)
    }

    /// Computes both values with a function of the triad.
    pub fn from_fn(mut f: impl FnMut(Sensor) -> T) -> Self {
        Self {
            gyro: f(Sensor::Gyro),
            accel: f(Sensor::Accel),
        }
    }

    /// The value for each sensor, or the first error.
    pub fn try_from_fn<E>(mut f: impl FnMut(Sensor) -> Result<T, E>) -> Result<Self, E> {
        Ok(Self {
            gyro: f(Sensor::Gyro)?,
            accel: f(Sensor::Accel)?,
        })
    }
}
