//! `turncal navigate`

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::ValueEnum;

use crate::arguments::{Delivery, hours, latitude, number, of_triads, usable};
use crate::terminal::{Activity, short_names};
use turncal::calibration::{Calibration, Named};
use turncal::imu::Sensor;
use turncal::study::navigation::{INTERVAL, MethodOutlook, Mission, Motion, Pair};
use turncal::units::DEGREE;
use turncal_report::navigation::Navigation;

const HOUR: f64 = 3600.0;
/// Largest pitch at which roll and heading are distinguishable, degrees.
const LARGEST_PITCH: f64 = 89.0;

/// Shows the navigation error caused by the errors of a calibration
///
/// Simulates an instrument with the true parameters in --truth, at rest or along a trajectory. Corrects its output with
/// the calibration, and navigates with the corrected data. Navigation starts with perfect alignment, and the height is
/// fixed to its true value. Shows the errors of attitude, velocity and position, and the σ of these errors predicted
/// from the covariance of the calibration. Without --force, turncal refuses a calibration whose verdict is FAILED.
#[derive(Debug, clap::Args)]
#[command(mut_arg("output", |output| output.help("Directory for navigation.csv, figures and a page")))]
#[command(after_help = "Examples:
  turncal navigate calibration.json --truth truth.json \\
      --latitude-deg 45
  turncal navigate calibration.json --truth truth.json \\
      --trajectory flight --hours 3 -o flight
  turncal navigate monday.json --truth friday.json \\
      --latitude-deg -33.9 --errors gyro --json")]
pub struct Navigate {
    /// Calibration with which the sensor data are corrected
    #[arg(value_name = "CALIBRATION.json")]
    calibration: PathBuf,
    /// True parameters of the instrument: a truth.json or another calibration
    #[arg(long, value_name = "FILE")]
    truth: PathBuf,
    /// Latitude in degrees, north positive [default: latitude of the trajectory or, at rest, of the calibration]
    #[arg(
        long,
        alias = "latitude",
        value_name = "L",
        allow_negative_numbers = true,
        value_parser = latitude
    )]
    latitude_deg: Option<f64>,
    /// Height above the ellipsoid in metres [default: 0, or the height of the trajectory; if given, the whole
    /// trajectory is shifted to this height]
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = height)]
    height_m: Option<f64>,
    /// Attitude at rest, in degrees
    #[arg(
        long,
        value_name = "PITCH,ROLL,HEADING",
        allow_hyphen_values = true,
        conflicts_with = "trajectory",
        default_value = "0,0,0",
        value_parser = attitude
    )]
    attitude_deg: Attitude,
    /// Sensors whose errors are included: gyros, accelerometers or both
    #[arg(long, value_enum, default_value_t = Errors::Both)]
    errors: Errors,
    /// Duration in hours (whole minutes, up to 1000)
    #[arg(long, default_value_t = 40.0, allow_negative_numbers = true, value_parser = hours)]
    hours: f64,
    /// Trajectory to follow, instead of being at rest: a TOML file or an embedded name (flight, vehicle)
    #[arg(long, value_name = "FILE.toml")]
    trajectory: Option<String>,
    /// Temperature at which to evaluate the calibrations, °C [default: reference temperature of each calibration]
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    temperature_degc: Option<f64>,
    #[command(flatten)]
    delivery: Delivery,
}

/// Pitch, roll and heading in degrees.
#[derive(Debug, Clone, Copy)]
struct Attitude([f64; 3]);

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Errors {
    /// Both triads
    Both,
    /// Only gyro errors; the accelerometers are exact
    Gyro,
    /// Only accelerometer errors; the gyros are exact
    Accel,
}

impl Errors {
    fn only(self) -> Option<Sensor> {
        match self {
            Self::Both => None,
            Self::Gyro => Some(Sensor::Gyro),
            Self::Accel => Some(Sensor::Accel),
        }
    }
}

impl Navigate {
    pub fn run(&self) -> anyhow::Result<()> {
        let paths = [self.calibration.as_path(), self.truth.as_path()];
        let names = short_names(&paths);
        let read = |path| {
            let force = self.delivery.force();
            of_triads(usable(path, self.temperature_degc, force)?, path)
        };
        let [calibration, truth] = [read(&self.calibration)?, read(&self.truth)?];
        let [of_calibration, of_truth] = [(&names[0], &calibration), (&names[1], &truth)]
            .map(|(name, record)| Named { name, record });
        let (mut pair, body_frame) = Pair::of_records(of_calibration, of_truth)?;
        let only = self.errors.only();
        if let Some(sensor) = only {
            pair = pair.with_errors_of(sensor);
        }
        let (motion, trajectory) = self.motion(&calibration)?;
        let mission = Mission {
            motion,
            intervals: (self.hours * HOUR / INTERVAL).round() as u32,
            interval: INTERVAL,
        };
        let inputs: Vec<&Path> = paths
            .into_iter()
            .chain(self.trajectory.as_deref().map(Path::new))
            .collect();
        let begun = self.delivery.begin(&inputs)?;

        let activity = Activity::new(format!("navigating {} h", self.hours));
        let moments = mission.navigate(&pair);
        let moments = moments.with_context(|| self.calibration.display().to_string())?;
        drop(activity);
        let navigated = MethodOutlook {
            method: "error",
            outlook: moments,
        };
        let navigation = Navigation {
            calibration: &names[0],
            truth: &names[1],
            verdict: calibration.word(),
            terms: !calibration.terms.is_empty() || !truth.terms.is_empty(),
            body_frame,
            only,
            mission: &mission,
            trajectory: trajectory.as_deref(),
            navigated: &navigated,
        };
        begun.deliver(&navigation.document())
    }

    /// The motion of the body, and the name of its trajectory.
    fn motion(&self, calibration: &Calibration) -> anyhow::Result<(Motion, Option<String>)> {
        let latitude = self.latitude_deg.map(|latitude| latitude * DEGREE);
        if let Some(name) = &self.trajectory {
            let (motion, name) = Motion::along(name, latitude, self.height_m)?;
            return Ok((motion, Some(name)));
        }
        let of_run = calibration.provenance.as_ref();
        let of_run = of_run.and_then(|of| Some(of.latitude_deg? * DEGREE));
        let Some(latitude) = latitude.or(of_run) else {
            bail!("the latitude is unknown: give --latitude-deg, or --trajectory");
        };
        let attitude = self.attitude_deg.0.map(|angle| angle * DEGREE);
        let height = self.height_m.unwrap_or(0.0);
        Ok((Motion::at_rest(latitude, height, attitude), None))
    }
}

fn height(text: &str) -> Result<f64, String> {
    number(text, -12e3, 1e5)
}

fn attitude(text: &str) -> Result<Attitude, String> {
    let angles: Vec<&str> = text.split(',').collect();
    let [pitch, roll, heading] = angles[..] else {
        return Err(format!(
            "found {}, expected pitch, roll and heading, separated by commas",
            turncal_input::counted(angles.len(), "number")
        ));
    };
    Ok(Attitude([
        number(pitch, -LARGEST_PITCH, LARGEST_PITCH).map_err(|e| format!("pitch: {e}"))?,
        number(roll, -360.0, 360.0).map_err(|e| format!("roll: {e}"))?,
        number(heading, -360.0, 360.0).map_err(|e| format!("heading: {e}"))?,
    ]))
}
