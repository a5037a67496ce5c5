//! Exports for other programs: calibrated samples and calibrations.
//!
//! Every format defines `N` and `u` in comments and names its omissions.

mod autopilot;
mod cameras;
mod code;
mod document;
mod gazebo;
mod ikalibr;
mod kalibr;
mod kf_gins;
mod mat;
mod ros;
mod samples;
mod slimevr;
mod source;
mod text;

pub use samples::{HEADER, sample_rows, write_samples};

use crate::calibration::CorrectionError;
use crate::calibration::result::Calibration;
use crate::run::Run;
use source::Source;

/// A format of a calibration.
#[derive(Debug, Clone, Copy)]
pub struct Format {
    /// Its name on the command line.
    pub name: &'static str,
    /// Extension of its files.
    pub extension: &'static str,
    /// Programs that read it.
    pub about: &'static str,
    write: fn(&Source) -> Exported,
    /// Whether it represents temperature dependence, or states its omission.
    holds_temperature: bool,
}

const fn row(
    name: &'static str,
    extension: &'static str,
    about: &'static str,
    write: fn(&Source) -> Exported,
) -> Format {
    Format {
        name,
        extension,
        about,
        write,
        holds_temperature: false,
    }
}

/// Every format.
#[rustfmt::skip]
static FORMATS: [Format; 20] = [
    row("kalibr", "yaml", "IMU intrinsics for Kalibr, model scale-misalignment", kalibr::write),
    row("kf-gins", "yaml", "IMU section of a KF-GINS configuration", kf_gins::write),
    row("c", "h", "A C99 header with constants and a function", code::c).with_temperature(),
    row("octave", "m", "An Octave or MATLAB function file", code::octave),
    row("text", "txt", "All values with name, σ and unit", text::write),
    row("px4", "params", "PX4 parameters: CAL_GYRO0, CAL_ACC0", autopilot::px4).with_temperature(),
    row("ardupilot", "param", "ArduPilot parameters: INS_GYROFFS, INS_ACCOFFS, INS_ACCSCAL", autopilot::ardupilot)
        .with_temperature(),
    row("open-vins-kalibr", "yaml", "IMU intrinsics for OpenVINS, model kalibr", kalibr::open_vins_kalibr),
    row("open-vins-rpng", "yaml", "IMU intrinsics for OpenVINS, model rpng", kalibr::open_vins_rpng),
    row("ikalibr", "yaml", "IMU intrinsics for iKalibr", ikalibr::write),
    row("imu-calib", "yaml", "Accelerometer calibration for the ROS package imu_calib", ros::imu_calib),
    row("ros-covariance", "yaml", "Covariances for ROS sensor_msgs/Imu, from the noise of a run", ros::covariance),
    row("dlio", "yaml", "IMU intrinsics for DLIO (direct LiDAR-inertial odometry)", ros::dlio),
    row("gazebo", "sdf", "IMU noise for Gazebo", gazebo::write),
    row("mat", "mat", "A MATLAB structure (MAT file)", mat::write),
    row("betaflight", "txt", "Accelerometer zeros for Betaflight", autopilot::betaflight),
    row("inav", "txt", "Zeros and gains for INAV", autopilot::inav),
    row("realsense", "bin", "IMU calibration table of a RealSense D400 camera, as written by rs-imu-calibration",
        cameras::realsense),
    row("depthai", "json", "IMU calibration for a DepthAI (OAK) camera, JSON", cameras::depthai),
    row("slimevr", "h", "Calibration for a SlimeVR tracker", slimevr::write),
];

impl Format {
    /// Every format.
    pub fn all() -> &'static [Self] {
        &FORMATS
    }

    /// The format with this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        FORMATS.iter().find(|format| format.name == name)
    }

    const fn with_temperature(self) -> Self {
        Self {
            holds_temperature: true,
            ..self
        }
    }
}

#[cfg(feature = "cli")]
impl clap::ValueEnum for Format {
    fn value_variants<'a>() -> &'a [Self] {
        &FORMATS
    }

    fn to_possible_value(&self) -> Option<clap::builder::PossibleValue> {
        Some(clap::builder::PossibleValue::new(self.name).help(self.about))
    }
}

/// A calibration in a format.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// The file.
    pub bytes: Vec<u8>,
    /// Omissions of the format, one sentence each, which are also in the file.
    pub notes: Vec<String>,
}

impl Exported {
    /// The same with further omissions.
    fn without(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }
}

/// Writes a calibration in a format. A run of the same instrument gives noise figures, sample rate and the nominal
/// scales by which counts are divided, for formats in rad/s and m/s².
///
/// # Errors
/// If the calibration has no inverse or an unknown term, or does not belong to the instrument of the run.
pub fn write(
    record: &Calibration,
    format: &Format,
    run: Option<&Run>,
) -> Result<Exported, CorrectionError> {
    let exported = (format.write)(&Source::new(record, run)?);
    Ok(match &record.temperature {
        Some(thermal) if !format.holds_temperature => exported.without(format!(
            "change with temperature; this is the calibration at {} °C (use --temperature-degc for another \
             temperature)",
            thermal.range.gyro.reference
        )),
        _ => exported,
    })
}
