//! Facts that a user states about a log in options.

mod kalibr;

use std::collections::BTreeSet;

pub use kalibr::KalibrImu;

use super::name::{self, Unit};
use crate::formats::DataFile;
use crate::formats::quantity::{OUTPUTS, Of, units};
use crate::imu::{Noise, PerSensor, Sensor};

/// User statements about a log without a `run.toml`; other fields are detected or have a wide prior.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stated {
    /// The accelerometer file, if the log contains only the gyros.
    pub accel_file: Option<DataFile>,
    /// Rows a second.
    pub rate_hz: Option<f64>,
    /// Geodetic latitude, north positive.
    pub latitude_deg: Option<f64>,
    /// Height above the ellipsoid.
    pub height_m: Option<f64>,
    /// Gravity at the place.
    pub gravity_m_s2: Option<f64>,
    /// Unit of the gyros.
    pub gyro_unit: Option<StatedUnit>,
    /// Unit of the accelerometers.
    pub accel_unit: Option<StatedUnit>,
    /// Noise figures.
    pub noise: Option<PerSensor<Noise>>,
    /// Tolerances of the instrument as delivered.
    pub tolerances: Option<Tolerances>,
}

/// 1σ tolerances of an instrument before calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Tolerances {
    /// Its kind.
    pub of: String,
    /// Scale factor, relative.
    pub scale: PerSensor<f64>,
    /// Bias, rad/s and m/s².
    pub bias: PerSensor<f64>,
}

/// A unit spelt as in `run.toml` or in log files, or a multiple of it: `deg/s`, `1/131 deg/s`, `0.061 mg`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatedUnit(pub(super) Unit);

impl StatedUnit {
    /// Parses the unit for the triad of this sensor.
    ///
    /// # Errors The accepted units, if this is none of them.
    pub fn parse(sensor: Sensor, text: &str) -> Result<Self, String> {
        let is_of_it = |unit: &Unit| match unit.of {
            Of::Rows(of, _) => of == sensor,
            Of::Count => unit.times == 1.0,
            Of::Time | Of::Other => false,
        };
        let unit = name::unit(text).filter(is_of_it);
        unit.map(Self).ok_or_else(|| {
            let all = OUTPUTS
                .into_iter()
                .flat_map(|(_, output)| units(sensor, output));
            let words: BTreeSet<&str> = all.map(|(word, _)| word).collect();
            let words: Vec<&str> = words.into_iter().collect();
            let example = sensor.pick("1/131 deg/s", "1/16384 g");
            let words = words.join(", ");
            format!("expected one of {words}, or the size of one count, such as '{example}'")
        })
    }
}
