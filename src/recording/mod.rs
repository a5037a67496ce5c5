//! Recorded data: samples of the instrument, readings of the table, labelled sections, and notes of the reader. This
//! module contains only data. Prior knowledge of the instrument, the site and the table is in [`crate::run`];
//! estimation is in [`crate::calibration`].

pub mod faults;
mod log_facts;
mod magnetometer;
mod near;
mod samples;
mod segment;
mod series;
mod temperature;

pub use faults::{Bridge, Fault, FaultKind, Slower};
pub use log_facts::{ColumnFacts, LogFacts, NamedColumns, TemperatureFacts};
pub use magnetometer::{MAGNETIC_COUNT, MagneticMean, MagneticNoise, Magnetometer};
pub use near::Near;
pub use samples::{FEWEST_SAMPLES, stretches_between};
pub use samples::{ImuSamples, SampleError, Stretch};
pub use segment::{LabelledMotion, Segment};
pub use series::Series;
pub use series::{Packer, SeriesWriter, finest_step};
pub use temperature::{SPACING as TEMPERATURE_SPACING, Temperature};

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::UnitQuaternion;

use crate::imu::AxisOrder;
use crate::turntable::AxisAngles;
pub use turncal_input::FileColumn;
pub use turncal_input::units::nanoseconds;

/// One recording of one instrument.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// A short name for titles and file names.
    pub name: String,
    /// Instrument, serial number, operator and similar data, copied into calibration and report.
    pub meta: BTreeMap<String, String>,
    /// The instrument's samples.
    pub imu: ImuSamples,
    /// Magnetometer, if any.
    pub magnetometer: Option<Magnetometer>,
    /// Turntable readings, if any.
    pub table: Option<TableLog>,
    /// Labelled sections, if any.
    pub segments: Vec<Segment>,
    /// Source files; empty for a simulated recording.
    pub files: Vec<PathBuf>,
    /// Repaired file faults and statements without effect, one sentence each.
    pub notes: Vec<String>,
    /// Statements that contradict the recording, a few sentences each.
    pub doubts: Vec<String>,
}

impl Recording {
    /// Labels of the segments in the order of the recording, including repetitions.
    pub fn labels(&self) -> Vec<String> {
        self.segments.iter().map(|s| s.label.clone()).collect()
    }

    /// A recording of consecutive samples without a gap. The arguments are the start of the first sample, s; the length
    /// of each sample, s; and the integrals of the normalised output (see [`crate::imu::Nominal`]) over each sample,
    /// rad and m/s along the right, front and up axes.
    ///
    /// # Errors
    /// Returns [`SampleError`] if the triads differ in length, a number is not finite, or the period is not positive.
    pub fn from_samples(
        name: &str,
        start: f64,
        period: f64,
        gyro: impl Into<Series>,
        accel: impl Into<Series>,
    ) -> Result<Self, SampleError> {
        let imu = ImuSamples::new(start, period, gyro, accel)?;
        Ok(Self::of(name, imu))
    }

    /// Uses the name of the recording, such as `x_up`, as the label of its position.
    pub fn label_by_name(&mut self) {
        let (imu, label) = (&self.imu, self.name.to_lowercase());
        let axes = imu
            .log
            .as_ref()
            .map_or(AxisOrder::IDENTITY, |log| log.named.axes);
        let motion = LabelledMotion::of_label(&label, axes);
        if let Some(LabelledMotion::Stands { .. }) = motion {
            self.segments.push(Segment {
                start: imu.start(),
                end: imu.end(),
                samples: 0..imu.len(),
                label,
                motion,
            });
        }
    }

    /// A recording that contains only these samples.
    pub fn of(name: &str, imu: ImuSamples) -> Self {
        Self {
            name: name.to_owned(),
            meta: BTreeMap::new(),
            imu,
            magnetometer: None,
            table: None,
            segments: Vec::new(),
            files: Vec::new(),
            notes: Vec::new(),
            doubts: Vec::new(),
        }
    }
}

/// Readings of the turntable for the attitude of its mounting face, which is the body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TableLog {
    /// Time of each reading, s.
    pub time: Vec<f64>,
    /// Readings `C_b_n`, body to East-North-Up, as quaternions, because there may be a million of them.
    pub attitude: Vec<UnitQuaternion<f64>>,
    /// Angles of the axes at each reading; empty if the log does not give them.
    pub axes: Vec<AxisAngles>,
}
