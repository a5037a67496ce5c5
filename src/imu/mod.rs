//! The instrument: output of a triad of gyros or accelerometers as a function of its input.
//!
//! `N = K C u + D` (Zhao, Jiang, Li 2016, Eq. 6; the second line of the printed Eq. 6 says `N_g` where the
//! accelerometer is meant). `u` is the angular rate in rad/s or the specific force in m/s² along the body axes, `K`
//! diagonal, `C` the installation matrix, `N` the output per second. Inside the crate `N` is divided by the nominal
//! scale of its axis, so that `K ≈ 1` and `D` is in rad/s or m/s²; [`Nominal`] converts back on input and output.

use serde::{Deserialize, Serialize};

mod axis_order;
mod body_frame;
mod installation;
mod instrument;
mod noise_keys;
mod signal;
mod terms;
mod thermal;
mod triad;

pub use axis_order::AxisOrder;
pub use body_frame::BodyFrame;
pub use installation::{ANGLES, InstallationForm};
pub use instrument::Instrument;
pub use noise_keys::NoiseKeys;
pub use signal::{GaussMarkov, MotionNoise, Noise, NoiseSource, Output, Pulses};
pub use terms::{
    REFERENCE_RATE, Sensed, TERM_PARAMETERS, Term, TermEntry, TermResponse, TermVector,
};
pub use thermal::{
    HIGHEST_ORDER, RATE, THERMAL_FUNCTIONS, ThermalCoefficients, ThermalModel, ThermalRange,
    ThermalState, ThermalValues, powers,
};
pub use triad::{Nominal, PARAMETERS, ParameterKind, Prior, Triad, TriadVector};

/// Names of the body axes, in order.
pub const AXES: [char; 3] = ['x', 'y', 'z'];

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

    /// The name that files and parameter names use.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gyro => "gyro",
            Self::Accel => "accel",
        }
    }

    /// The first for the gyros, the second for the accelerometers.
    pub(crate) fn pick<T>(self, gyro: T, accel: T) -> T {
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

    /// Builds both values from a function of the triad.
    pub fn from_fn(mut f: impl FnMut(Sensor) -> T) -> Self {
        Self {
            gyro: f(Sensor::Gyro),
            accel: f(Sensor::Accel),
        }
    }

    /// The value of each sensor, or the first error.
    pub fn try_from_fn<E>(mut f: impl FnMut(Sensor) -> Result<T, E>) -> Result<Self, E> {
        Ok(Self {
            gyro: f(Sensor::Gyro)?,
            accel: f(Sensor::Accel)?,
        })
    }
}
