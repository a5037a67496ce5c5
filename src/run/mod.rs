//! A run: one recording, and what is known beforehand of the instrument, the site and the table that
//! made it.
//!
//! All is in SI, on right-front-up body axes and in normalised outputs (see [`crate::imu::Nominal`]);
//! the files' units and axes end in [`crate::formats`].

mod doubts;
mod dwell;
mod dwells;
pub mod motion;
mod turning;

pub use dwell::{Dwell, MeanOutput, Position};
pub use dwells::imu::LONG_ENOUGH;

use serde::{Deserialize, Serialize};

use crate::earth::Site;
use crate::imu::{BodyFrame, Instrument, PerSensor};
use crate::recording::{Recording, TableLog};
use crate::turntable::TableAccuracy;
use crate::units::DEGREE;

/// 1σ per axis of a position that is set by hand, rad.
pub const SET_BY_HAND: f64 = DEGREE;

/// A recording with what is known beforehand.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// What was recorded.
    pub recording: Recording,
    /// The instrument that was recorded.
    pub instrument: Instrument,
    /// Where the turntable stands.
    pub site: Site,
    /// How well the table's readings tell its attitude; without effect where there are none.
    pub table: TableAccuracy,
    /// How still the IMU is while the table is at rest.
    pub standstill: Standstill,
    /// 1σ per axis of the attitude of a labelled position, and of where a labelled turn ends, rad.
    pub segment_sigma: f64,
}

impl Run {
    /// A run without a table's accuracy, standstill as usual.
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

    /// The default observation: the table's attitude if there is a table log, else zero velocity.
    pub fn aiding(&self) -> Aiding {
        match self.recording.table {
            Some(_) => Aiding::Table,
            None => Aiding::Velocity,
        }
    }

    /// The table's readings, where they are observed.
    pub fn observed_table(&self, aiding: Aiding) -> Option<&TableLog> {
        self.recording
            .table
            .as_ref()
            .filter(|_| aiding == Aiding::Table)
    }
}

/// What the filter observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Aiding {
    /// Standstill and the table's attitude.
    Table,
    /// Standstill only.
    Velocity,
}

impl Aiding {
    /// What fixes the body axes under it.
    pub fn body_frame(self) -> BodyFrame {
        match self {
            Self::Table => BodyFrame::Table,
            Self::Velocity => BodyFrame::Accelerometer,
        }
    }
}

/// How still the IMU is while the table is at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standstill {
    /// White 1σ of what each triad's output adds up to at standstill: attitude in rad, velocity in m/s;
    /// found from the dwells if not given.
    pub sigma: PerSensor<Option<f64>>,
    /// How the body turns where it should not, where no table is observed: 1σ density of a random walk,
    /// rad/√s.
    pub turning: f64,
    /// 1σ of the IMU's position while the table is at rest, m. Never below the IMU's distance from the
    /// table's centre, for that is how far it moves between positions.
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
