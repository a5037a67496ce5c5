//! Runs: what a laboratory recorded, read from files and written to files.
//!
//! A [`Run`] is in SI, on right-front-up body axes and in normalised outputs (see
//! [`crate::imu::Nominal`]); the files' units and axes end at this door.

mod axes;
mod clock;
mod csv_file;
mod dwells;
mod error;
mod faults;
mod fields;
mod imu_log;
mod instrument;
mod log_facts;
mod median;
mod quantity;
mod read;
pub mod record;
mod segments;
mod sheet;
pub(crate) mod state_block;
mod table_geometry;
mod table_log;
mod uniform;
mod whole;
mod write;

pub use dwells::{Dwell, MeanOutput, Position};
pub use error::{Place, RunError};
pub use faults::{Bridge, Fault, FaultKind};
pub use log_facts::{ColumnFacts, LogFacts, TemperatureFacts};
pub(crate) use median::{SIGMA_OF_MEDIAN, median};
pub(crate) use quantity::unit_scale;
pub use read::SET_BY_HAND;
pub use record::CalibrationRecord;
pub use segments::{LabelledMotion, Segment};
pub(crate) use sheet::Sheet;
pub use state_block::StateBlock;
pub use table_geometry::{
    AXIS_TILTS, TABLE_GEOMETRY, TableGeometry, Tilts, across, table_geometry_name, tilts,
};
pub(crate) use whole::write_whole_with;
pub use whole::{WholeDirectory, abandon_unfinished, write_whole};
pub(crate) use write::write_rows;
pub use write::write_run;

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::{Matrix3, Vector3};

use crate::earth::Site;
use crate::imu::{
    FurtherVector, InstallationForm, Noise, Nominal, PerSensor, Prior, Triad, TriadVector,
};
use record::BodyFrame;

/// Everything that a calibration needs to know of one record.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// A short name for titles and file names.
    pub name: String,
    /// Where the turntable stands.
    pub site: Site,
    /// Instrument, serial, operator and the like, carried into calibration and report.
    pub meta: BTreeMap<String, String>,
    /// The instrument's samples.
    pub imu: ImuRecord,
    /// Noise of each triad.
    pub noise: PerSensor<Noise>,
    /// Knowledge of each triad before calibration.
    pub prior: PerSensor<Prior>,
    /// 1σ of each parameter of further terms before calibration, around zero; zero where a term is off.
    pub further_sigma: FurtherVector,
    /// Nominal scale of each triad: the file's quantity per second for one rad/s or m/s².
    pub nominal: PerSensor<Nominal>,
    /// The file's quantity, such as `count`.
    pub unit: PerSensor<String>,
    /// How still the IMU is while the table stands.
    pub standstill: Standstill,
    /// The turntable's log, if there is one.
    pub table: Option<TableRecord>,
    /// Labelled sections, if there are any.
    pub segments: Vec<Segment>,
    /// 1σ per axis of the attitude of a labelled position, and of where a labelled turn ends, rad.
    pub segment_sigma: f64,
    /// The files that it was read from; none if it was made.
    pub files: Vec<PathBuf>,
    /// What is wrong with the files and was mended, and what they say without effect, a sentence each.
    pub notes: Vec<String>,
}

impl Run {
    /// What fixes the body axes.
    pub fn body_frame(&self) -> BodyFrame {
        match self.table {
            Some(_) => BodyFrame::Table,
            None => BodyFrame::Accelerometer,
        }
    }

    /// Both triads as the prior has them.
    pub fn prior_mean(&self, form: InstallationForm) -> PerSensor<Triad> {
        PerSensor::from_fn(|sensor| self.prior.get(sensor).mean(form))
    }

    /// 1σ of each parameter of both triads before calibration; zero for those that the form does not
    /// have or the body frame fixes.
    pub fn prior_sigma(&self, form: InstallationForm) -> PerSensor<TriadVector> {
        let mut sigma = PerSensor::from_fn(|sensor| self.prior.get(sensor).sigma(form));
        if self.body_frame() == BodyFrame::Accelerometer {
            for fixed in Triad::above_the_diagonal(form) {
                sigma.accel[fixed] = 0.0;
            }
        }
        sigma
    }
}

/// The samples of both triads.
#[derive(Debug, Clone, PartialEq)]
pub struct ImuRecord {
    /// Time at which the first sample begins, s.
    pub start: f64,
    /// Length of every sample, s.
    pub period: f64,
    /// Whether each sample begins where the one before ended, and none is lost beyond interpolation.
    pub continuous: bool,
    /// Integrals of the normalised gyro output over each sample, rad.
    pub gyro: Vec<Vector3<f64>>,
    /// Integrals of the normalised accelerometer output over each sample, m/s.
    pub accel: Vec<Vector3<f64>>,
    /// Size of one pulse, rad and m/s, where samples are whole pulses; zero otherwise.
    pub pulse: PerSensor<f64>,
    /// What was wrong with the file's samples, in order of kind, axis and time.
    pub faults: Vec<Fault>,
    /// Interpolated samples, in order of triad, axis and time; those of one axis do not overlap.
    pub bridges: Vec<Bridge>,
    /// The file that the samples are from; none if they were made.
    pub log: Option<LogFacts>,
}

impl ImuRecord {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.gyro.len()
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.gyro.is_empty()
    }

    /// Time in s at which sample `k` begins (and sample `k − 1` ends).
    pub fn time(&self, k: usize) -> f64 {
        self.start + k as f64 * self.period
    }

    /// Length of the record, s.
    pub fn duration(&self) -> f64 {
        self.len() as f64 * self.period
    }
}

/// What the turntable says of the attitude of its mounting face, which is the body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TableRecord {
    /// Time of each reading, s.
    pub time: Vec<f64>,
    /// Reading `C_b_n`, body to East-North-Up.
    pub attitude: Vec<Matrix3<f64>>,
    /// 1σ per axis of the position error, constant while the table stands and new at every position,
    /// rad.
    pub position_sigma: f64,
    /// 1σ per axis of the white error of each reading, rad.
    pub reading_sigma: f64,
    /// 1σ of what it does not read.
    pub geometry: TableGeometry,
    /// How the attitude turns with tilts of the axes at each reading; empty where it does not tell the
    /// axes apart.
    pub tilts: Vec<Tilts>,
}

/// How still the IMU is while the table stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standstill {
    /// White 1σ of the velocity at standstill, m/s; found from the dwells if not given.
    pub velocity_sigma: Option<f64>,
    /// 1σ of the IMU's position while the table stands, m. Never below the IMU's distance from the
    /// table's centre, for that is how far it moves between positions.
    pub position_sigma: f64,
}

impl Default for Standstill {
    fn default() -> Self {
        Self {
            velocity_sigma: None,
            position_sigma: 1.0,
        }
    }
}

/// A time rounded to 1 ns, so that it prints short.
pub(crate) fn nanoseconds(time: f64) -> f64 {
    (time * 1e9).round() / 1e9
}
