//! A run: one recording, with prior knowledge of the instrument, the site and the table.
//!
//! All quantities are in SI units, along right-front-up body axes and in normalised outputs (see
//! [`crate::imu::Nominal`]); `turncal-files` converts the units and axes of files.

mod doubts;
mod dwell;
mod dwells;
pub mod motion;
mod table_clock;
mod turning;

pub use dwell::{Dwell, MeanOutput, Position};
pub use dwells::imu::LONG_ENOUGH;

use serde::{Deserialize, Serialize};

use crate::earth::Site;
use crate::imu::{BodyFrame, Instrument, PerSensor, Sensor};
use crate::recording::{Recording, TableLog};
use crate::turntable::TableAccuracy;
use crate::units::DEGREE;

/// 1σ per axis of a position set by hand, rad.
pub const SET_BY_HAND: f64 = DEGREE;

/// A recording with the prior knowledge about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The recorded data.
    pub recording: Recording,
    /// The instrument that was recorded.
    pub instrument: Instrument,
    /// Site of the turntable.
    pub site: Site,
    /// Accuracy of the table readings; it has no effect if there are no readings.
    pub table: TableAccuracy,
    /// Motion of the IMU while the table is at rest.
    pub standstill: Standstill,
    /// 1σ per axis of the attitude of a labelled position, and of the end of a labelled turn, rad.
    pub segment_sigma: f64,
}

impl Run {
    /// A run with the default table accuracy and the default standstill.
    pub fn new(recording: Recording, instrument: Instrument, site: Site) -> Self {
        Self {
            recording,
            instrument,
            site,
            table: TableAccuracy::default(),
            standstill: Standstill::default(),
            segment_sigma: SET_BY_HAND,
        }
    }

    /// The default observation: table attitude if there is a table log, zero velocity if there is none.
    pub fn aiding(&self) -> Aiding {
        match self.recording.table {
            Some(_) => Aiding::Table,
            None => Aiding::Velocity,
        }
    }

    /// Whether the recording has a magnetometer, but neither gyros nor accelerometers.
    pub fn is_of_magnetometer(&self) -> bool {
        let recording = &self.recording;
        let has = |&sensor: &Sensor| recording.imu.has(sensor);
        recording.magnetometer.is_some() && !Sensor::ALL.iter().any(has)
    }

    /// The table's readings, if they are observed.
    pub fn observed_table(&self, aiding: Aiding) -> Option<&TableLog> {
        self.recording
            .table
            .as_ref()
            .filter(|_| aiding == Aiding::Table)
    }
}

/// The observations that the filter uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Aiding {
    /// Zero velocity in every dwell, and the attitude of the table
    Table,
    /// Zero velocity only; the accelerometers define the body axes
    Velocity,
}

impl Aiding {
    /// The body frame that these observations define.
    pub fn body_frame(self) -> BodyFrame {
        match self {
            Self::Table => BodyFrame::Table,
            Self::Velocity => BodyFrame::Accelerometer,
        }
    }
}

/// Motion of the IMU while the table is at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standstill {
    /// White 1σ of the integral of each triad's output at standstill: attitude in rad, velocity in m/s;
    /// estimated from the dwells if not given.
    pub sigma: PerSensor<Option<f64>>,
    /// Unwanted rotation of the body at rest, used without a table: 1σ density of a random walk, rad/√s.
    pub turning: f64,
    /// 1σ of the position of the IMU while the table is at rest, m. This σ must be at least the distance of the IMU
    /// from the table centre, because the IMU moves that far between positions.
    pub position_sigma: f64,
}

impl Default for Standstill {
    fn default() -> Self {
        Self {
            sigma: PerSensor::default(),
            turning: 0.0,
            position_sigma: 1.0,
        }
    }
}
