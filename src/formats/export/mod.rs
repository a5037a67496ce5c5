//! What other programs read: calibrated samples, and calibrations in their own formats.
//!
//! Every format says in comments what `N` and `u` are, and names what it cannot hold.

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
use kalibr::Model;
use source::Source;

/// A format of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Format {
    /// IMU intrinsics of Kalibr, model scale-misalignment
    Kalibr,
    /// The part of a KF-GINS configuration that is about the IMU
    KfGins,
    /// A C99 header with constants and a function
    C,
    /// A function file of Octave or MATLAB
    Octave,
    /// Every value with its name, σ and unit
    Text,
    /// Parameters of PX4: CAL_GYRO0, CAL_ACC0
    Px4,
    /// Parameters of ArduPilot: INS_GYROFFS, INS_ACCOFFS, INS_ACCSCAL
    #[cfg_attr(feature = "cli", value(name = "ardupilot"))]
    ArduPilot,
    /// IMU intrinsics of OpenVINS, model kalibr
    OpenVinsKalibr,
    /// IMU intrinsics of OpenVINS, model rpng
    OpenVinsRpng,
    /// IMU intrinsics of iKalibr
    #[cfg_attr(feature = "cli", value(name = "ikalibr"))]
    IKalibr,
    /// The accelerometers' calibration of the ROS package imu_calib
    ImuCalib,
    /// Covariances of ROS sensor_msgs/Imu; needs --run
    RosCovariance,
    /// IMU intrinsics of DLIO (direct LiDAR-inertial odometry)
    Dlio,
    /// Noise of an IMU in Gazebo
    Gazebo,
    /// A structure for MATLAB, a MAT file
    Mat,
    /// Zeros of accelerometers for Betaflight
    Betaflight,
    /// Zeros and gains for INAV
    Inav,
    /// Memory of the IMU of a RealSense D400 camera, as rs-imu-calibration writes it
    #[cfg_attr(feature = "cli", value(name = "realsense"))]
    RealSense,
    /// IMU calibration of a DepthAI (OAK) camera, JSON
    #[cfg_attr(feature = "cli", value(name = "depthai"))]
    DepthAi,
    /// Calibration of a SlimeVR tracker
    #[cfg_attr(feature = "cli", value(name = "slimevr"))]
    SlimeVr,
}

impl Exported {
    /// The file.
    pub fn bytes(&self) -> &[u8] {
        self.binary.as_deref().unwrap_or(self.text.as_bytes())
    }
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 20] = [
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
        Self::Dlio,
        Self::Gazebo,
        Self::Mat,
        Self::Betaflight,
        Self::Inav,
        Self::RealSense,
        Self::DepthAi,
        Self::SlimeVr,
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
        Format::C => code::c(&source),
        Format::Octave => code::octave(&source),
        Format::Text => text::write(&source),
        Format::Px4 => autopilot::px4(&source),
        Format::ArduPilot => autopilot::ardupilot(&source),
        Format::OpenVinsKalibr => kalibr::open_vins(&source, Model::Kalibr),
        Format::OpenVinsRpng => kalibr::open_vins(&source, Model::Rpng),
        Format::IKalibr => ikalibr::write(&source),
        Format::ImuCalib => ros::imu_calib(&source),
        Format::RosCovariance => ros::covariance(&source),
        Format::Dlio => ros::dlio(&source),
        Format::Gazebo => gazebo::write(&source),
        Format::Mat => mat::write(&source),
        Format::Betaflight => autopilot::betaflight(&source),
        Format::Inav => autopilot::inav(&source),
        Format::RealSense => cameras::realsense(&source),
        Format::DepthAi => cameras::depthai(&source),
        Format::SlimeVr => slimevr::write(&source),
    };
    exported.notes.extend(match (format, &record.temperature) {
        (Format::C, _) | (_, None) => None,
        (Format::Px4 | Format::ArduPilot, _) => autopilot::thermal_note(&source),
        (_, Some(thermal)) => Some(format!(
            "change with temperature; this is the calibration at {} °C, another temperature is written with \
             --temperature-degc",
            thermal.range.gyro.reference
        )),
    });
    Ok(exported)
}
