//! What a user states of a log beside it.

use crate::imu::{Noise, PerSensor};

/// What a user states of a log that has no `run.toml`; what is not stated is found, or wide.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stated {
    /// Rows a second.
    pub rate_hz: Option<f64>,
    /// Geodetic latitude, north positive.
    pub latitude_deg: Option<f64>,
    /// Height above the ellipsoid.
    pub height_m: Option<f64>,
    /// Gravity at the place.
    pub gravity_m_s2: Option<f64>,
    /// Units in the words of `run.toml`.
    pub gyro_unit: Option<String>,
    /// The same of the accelerometers.
    pub accel_unit: Option<String>,
    /// Noise in SI, such as that of [`KalibrImu`](super::KalibrImu).
    pub noise: Option<PerSensor<Noise>>,
}
