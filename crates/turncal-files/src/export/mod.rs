//! Exports for other programs: calibrated samples and calibrations.
//!
//! Every format defines `N` and `u` in comments and lists its omissions.

mod affine;
mod autopilot;
mod code;
mod compass;
mod kalibr;
mod kf_gins;
mod mat;
mod notation;
mod realsense;
mod remarks;
mod ros;
mod samples;
mod text;
mod values;

pub use remarks::Exported;
pub use samples::{FieldSamples, HEADER, Samples};

use compass::{Reads, compass};
use turncal::calibration::CorrectionError;
use turncal::calibration::result::Calibration;
use turncal::run::Run;
use values::Axes::{self, FrontRightDown, Log, RightFrontUp};
use values::Values;

/// An export format for a calibration.
#[derive(Debug, Clone, Copy)]
pub struct Format {
    /// Name on the command line.
    pub name: &'static str,
    /// Extension of the files in this format.
    pub extension: &'static str,
    /// Programs that read this format.
    pub about: &'static str,
    axes: Axes,
    write: fn(&Values) -> Exported,
    /// Temperature dependence that the format omits; `None` for a calibration at one temperature.
    of_temperature: Option<&'static str>,
    /// Whether the format contains a magnetometer, beside the triads or alone.
    has_magnetometer: bool,
    /// What the program corrects of a magnetometer, if it limits it.
    compass: Option<Reads>,
}

const fn row(
    name: &'static str,
    extension: &'static str,
    about: &'static str,
    axes: Axes,
    write: fn(&Values) -> Exported,
) -> Format {
    Format {
        name,
        extension,
        about,
        axes,
        write,
        of_temperature: None,
        has_magnetometer: false,
        compass: None,
    }
}

/// Temperature dependence that autopilots cannot represent.
const IN_AUTOPILOTS: &str = "change of scale factors and misalignments with temperature, change of biases with the \
temperature rate, and polynomial orders above three; the biases are functions of the temperature of the sensor";

/// Every format.
#[rustfmt::skip]
pub static FORMATS: [Format; 15] = [
    row("kalibr", "yaml", "IMU configuration for Kalibr, with the intrinsics of its model \
    scale-misalignment", Log, kalibr::kalibr),
    row("kf-gins", "yaml", "IMU section of a KF-GINS configuration", FrontRightDown, kf_gins::write),
    row("c", "h", "A C99 header with constants and a function", RightFrontUp, code::write).with_temperature("").with_magnetometer(),
    row("text", "txt", "All values with name, σ and unit", RightFrontUp, text::write).with_magnetometer(),
    row("px4", "params", "PX4 parameters: CAL_GYRO0, CAL_ACC0, CAL_MAG0", FrontRightDown, autopilot::px4)
        .with_temperature(IN_AUTOPILOTS).with_compass(autopilot::PX4),
    row("ardupilot", "param", "ArduPilot parameters: INS_GYROFFS, INS_ACCOFFS, INS_ACCSCAL, COMPASS_", FrontRightDown,
        autopilot::ardupilot).with_temperature(IN_AUTOPILOTS).with_compass(autopilot::ARDUPILOT),
    row("open-vins-kalibr", "yaml", "IMU intrinsics for OpenVINS, with its model kalibr", Log, kalibr::open_vins_kalibr),
    row("open-vins-rpng", "yaml", "IMU intrinsics for OpenVINS, with its model rpng", Log, kalibr::open_vins_rpng),
    row("imu-calib", "yaml", "Accelerometer calibration for the ROS package imu_calib", Log, ros::imu_calib),
    row("ros-covariance", "yaml", "Covariances for ROS sensor_msgs/Imu, from the noise of a run", Log, ros::covariance),
    row("imu-filter-madgwick", "yaml", "Magnetometer bias for the ROS package imu_filter_madgwick", Log, ros::madgwick)
        .with_magnetometer(),
    row("mat", "mat", "A MATLAB structure (MAT file)", RightFrontUp, mat::write).with_magnetometer(),
    row("betaflight", "txt", "Accelerometer and magnetometer zeros for Betaflight", Log, autopilot::betaflight)
        .with_compass(autopilot::BETAFLIGHT),
    row("inav", "txt", "Zeros and gains for INAV", Log, autopilot::inav).with_compass(autopilot::INAV),
    row("realsense", "bin", "IMU calibration table of a RealSense D400 camera, as written by rs-imu-calibration", Log,
        realsense::write),
];

impl Format {
    /// The format with this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        FORMATS.iter().find(|format| format.name == name)
    }

    const fn with_temperature(self, omitted: &'static str) -> Self {
        Self {
            of_temperature: Some(omitted),
            ..self
        }
    }

    const fn with_magnetometer(self) -> Self {
        Self {
            has_magnetometer: true,
            ..self
        }
    }

    const fn with_compass(self, reads: Reads) -> Self {
        Self {
            compass: Some(reads),
            ..self.with_magnetometer()
        }
    }
}

/// Writes a calibration in a given format. A run of the same instrument gives noise figures, sample rate and the
/// nominal scales by which counts are divided, for formats in rad/s and m/s².
///
/// # Errors
/// Returns an error if the calibration has no inverse, contains an unknown term, or does not belong to the instrument
/// of the run.
pub fn write(
    record: &Calibration,
    format: &Format,
    run: Option<&Run>,
) -> Result<Exported, CorrectionError> {
    if record.is_of_magnetometer() && !format.has_magnetometer {
        return Err(CorrectionError::MagnetometerAlone);
    }
    let values = Values::new(record, run, format.axes)?;
    let found = format.compass.and_then(|reads| compass(&values, reads));
    if let Some(Err(why)) = found
        && record.is_of_magnetometer()
    {
        return Err(CorrectionError::MagnetometerUnsuitable(why));
    }
    let mut exported = (format.write)(&values);
    if let Some(thermal) = &record.temperature {
        let reference = thermal.range.gyro.reference;
        let omitted = match format.of_temperature {
            Some(omitted) => omitted.to_owned(),
            None => format!(
                "change with temperature; the values apply at {reference} °C (use --temperature-degc for another \
                 temperature)"
            ),
        };
        let omitted = Some(omitted).filter(|note| !note.is_empty());
        exported.notes.extend(omitted);
    }
    if record.mag.is_some() && !format.has_magnetometer {
        let note = "magnetometer; its values are in calibration.json";
        exported.notes.push(note.to_owned());
    }
    Ok(exported)
}
