//! What other programs read: calibrated samples, and calibrations in their own formats.
//!
//! Every format says in comments what `N` and `u` are, and names what it cannot hold.

mod along;
mod autopilot;
mod betaflight;
mod c;
mod gazebo;
mod ikalibr;
mod imu_calib;
mod kalibr;
mod kf_gins;
mod mat;
mod octave;
mod open_vins;
mod ros;
mod samples;
mod source;
mod text;
mod thermal;

pub use samples::{HEADER, sample_rows, write_samples};

use crate::calibration::CorrectionError;
use crate::calibration::result::Calibration;
use crate::run::Run;
use open_vins::Model;
use source::Source;

/// A format of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Kalibr's IMU intrinsics, model `scale-misalignment`.
    Kalibr,
    /// The part of a KF-GINS configuration that is about the IMU.
    KfGins,
    /// A C99 header with a function.
    C,
    /// An Octave or MATLAB function file.
    Octave,
    /// Every value with its name, σ and unit.
    Text,
    /// Parameters of PX4.
    Px4,
    /// Parameters of ArduPilot.
    ArduPilot,
    /// OpenVINS' IMU intrinsics, model `kalibr`.
    OpenVinsKalibr,
    /// The same, model `rpng`.
    OpenVinsRpng,
    /// iKalibr's IMU intrinsics.
    IKalibr,
    /// The accelerometers' calibration of the ROS package `imu_calib`.
    ImuCalib,
    /// The covariances of ROS' `sensor_msgs/Imu`.
    RosCovariance,
    /// The noise of an IMU in Gazebo.
    Gazebo,
    /// A structure for MATLAB.
    Mat,
    /// What Betaflight holds.
    Betaflight,
}

impl Exported {
    /// The file.
    pub fn bytes(&self) -> &[u8] {
        self.binary.as_deref().unwrap_or(self.text.as_bytes())
    }
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 15] = [
        Self::Kalibr,
        Self::KfGins,
        Self::C,
        Self::Octave,
        Self::Text,
        Self::Px4,
        Self::ArduPilot,
        Self::OpenVinsKalibr,
        Self::OpenVinsRpng,
        Self::IKalibr,
        Self::ImuCalib,
        Self::RosCovariance,
        Self::Gazebo,
        Self::Mat,
        Self::Betaflight,
    ];
}

/// A calibration in a format.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// The file, empty if it is no text.
    pub text: String,
    /// The file if it is no text.
    pub binary: Option<Vec<u8>>,
    /// What the format does not hold, a sentence each. The file says it, too.
    pub notes: Vec<String>,
}

/// Writes a calibration in a format. A run of the same instrument gives noise figures, sample rate and
/// the nominal scales that counts are to be divided by, for formats that want rad/s and m/s².
///
/// # Errors
/// If the calibration has no inverse or an unknown term, or is not one of the run's instrument.
pub fn write(
    record: &Calibration,
    format: Format,
    run: Option<&Run>,
) -> Result<Exported, CorrectionError> {
    let source = Source::new(record, run)?;
    let mut exported = match format {
        Format::Kalibr => kalibr::write(&source),
        Format::KfGins => kf_gins::write(&source),
        Format::C => c::write(&source),
        Format::Octave => octave::write(&source),
        Format::Text => text::write(&source),
        Format::Px4 => autopilot::px4(&source),
        Format::ArduPilot => autopilot::ardupilot(&source),
        Format::OpenVinsKalibr => open_vins::write(&source, Model::Kalibr),
        Format::OpenVinsRpng => open_vins::write(&source, Model::Rpng),
        Format::IKalibr => ikalibr::write(&source),
        Format::ImuCalib => imu_calib::write(&source),
        Format::RosCovariance => ros::write(&source),
        Format::Gazebo => gazebo::write(&source),
        Format::Mat => mat::write(&source),
        Format::Betaflight => betaflight::write(&source),
    };
    exported.notes.extend(match format {
        Format::C => None,
        Format::Px4 | Format::ArduPilot => thermal::autopilot_note(&source),
        _ => thermal::note(&source),
    });
    Ok(exported)
}
