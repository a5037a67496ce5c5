//! A run.toml or a log as the argument of a command.

use std::path::{Path, PathBuf};

use anyhow::bail;

use super::{gravity, height, latitude, positive};
use turncal::imu::Sensor;
use turncal_files::Opened;
use turncal_files::draft::{Found, Stated, StatedUnit};
use turncal_logs::DataFile;
use turncal_report::terminal::printable;

/// Information about a log that has no run.toml.
#[derive(Debug, Clone, PartialEq, Default, clap::Args)]
#[command(next_help_heading = "For a log without run.toml")]
pub struct OfLog {
    /// File that contains the accelerometer rows, if the log contains only gyro data
    #[arg(long, value_name = "ACCEL.csv", conflicts_with = "stream")]
    accel_file: Option<PathBuf>,
    /// Rows per second
    #[arg(long, value_name = "HZ", value_parser = positive)]
    rate: Option<f64>,
    /// Latitude of the site, degrees, north positive
    #[arg(long, value_name = "DEG", value_parser = latitude, allow_negative_numbers = true)]
    latitude: Option<f64>,
    /// Height of the site above the ellipsoid, m
    #[arg(long, value_name = "M", value_parser = height, allow_negative_numbers = true)]
    height: Option<f64>,
    /// Gravity at the site, m/s²
    #[arg(long, value_name = "M/S2", value_parser = gravity)]
    gravity: Option<f64>,
    /// Unit of the gyros: rad/s, deg/s, deg/h, or the size of one count, such as '1/131 deg/s'; for increments rad,
    /// deg, arcsec
    #[arg(long, value_name = "UNIT", value_parser = |text: &str| StatedUnit::parse(Sensor::Gyro, text))]
    gyro_unit: Option<StatedUnit>,
    /// Unit of the accelerometers: m/s^2, g or the size of one count, such as '1/16384 g'; for increments m/s, g*s
    #[arg(long, value_name = "UNIT", value_parser = |text: &str| StatedUnit::parse(Sensor::Accel, text))]
    accel_unit: Option<StatedUnit>,
    /// Sensor whose data sheet supplies the noise and tolerances: a name from turncal list, such as bmi088, or a TOML
    /// file
    #[arg(long, value_name = "NAME")]
    sensor: Option<String>,
    /// Kalibr imu.yaml that supplies the noise figures and, unless --rate is given, the sample rate
    #[arg(long, value_name = "YAML")]
    noise_file: Option<PathBuf>,
    /// Stream that contains the instrument's data [default: the stream with the most samples]
    #[arg(long, value_name = "NAME")]
    stream: Option<String>,
}

impl OfLog {
    /// The stream name, and the information about the log that the user gave.
    pub fn stated(&self) -> anyhow::Result<(Option<&str>, Stated)> {
        let stated = Stated {
            accel_file: self.accel_file.as_deref().map(DataFile::from),
            rate_hz: self.rate,
            latitude_deg: self.latitude,
            height_m: self.height,
            gravity_m_s2: self.gravity,
            gyro_unit: self.gyro_unit,
            accel_unit: self.accel_unit,
            ..Stated::default()
        };
        let stated = stated.with_data_sheets(self.sensor.as_deref(), self.noise_file.as_deref())?;
        Ok((self.stream.as_deref(), stated))
    }

    /// Reads a run, or a log with the information given in options; for a log, shows the detected fields.
    pub fn open(&self, path: &Path) -> anyhow::Result<Opened> {
        let opened = self.open_any(path)?;
        if opened.run.is_of_magnetometer() {
            bail!(
                "{}: the log has a magnetometer, but neither gyros nor accelerometers. Only check, calibrate and apply \
                 use such a log",
                path.display()
            );
        }
        Ok(opened)
    }

    /// Does the same as [`Self::open`], also for a magnetometer alone.
    pub fn open_any(&self, path: &Path) -> anyhow::Result<Opened> {
        self.open_with(path, |found| show_found(path, found))
    }

    /// Reads several logs of one sensor, each recorded in one position; `None` if the sensor was turned in any of them.
    pub fn open_positions(&self, paths: &[PathBuf]) -> anyhow::Result<Option<Vec<Opened>>> {
        let (stream, stated) = self.stated()?;
        let stated = (stream, &stated);
        Ok(Opened::of_positions(paths, stated, |path, draft| {
            show_found(path, &draft.found());
        })?)
    }

    /// Does the same as [`Self::open`], but passes the detected fields to `show`.
    pub fn open_with(&self, path: &Path, show: impl FnOnce(&[Found])) -> anyhow::Result<Opened> {
        let (stream, stated) = self.stated()?;
        Ok(Opened::new(path, stream, &stated, |draft| {
            show(&draft.found());
        })?)
    }
}

/// Shows the fields detected in a log on standard error.
pub fn show_found(path: &Path, found: &[Found]) {
    tell!("Found in {}:", printable(&path.display().to_string()));
    for of in found {
        let value = printable(&of.value).to_string();
        let (why, word) = (printable(&of.why), of.certainty.word());
        tell!("  {:<7} {value:<34} {word}: {why}", of.what);
    }
}

/// Path of a run.toml, for commands that do not accept a log.
pub fn run_file(text: &str) -> Result<PathBuf, String> {
    let path = run_or_log(text)?;
    if path.is_file() && path.extension().is_none_or(|end| end != "toml") {
        Err(format!(
            "found a log, expected the run.toml that describes the log. Draft a run.toml with turncal init {text}"
        ))
    } else {
        Ok(path)
    }
}

/// Path of a run.toml or a log, or `-`; if the path is a run directory, the error message names the file in it.
pub fn run_or_log(text: &str) -> Result<PathBuf, String> {
    let path = Path::new(text);
    let inside = path.join("run.toml");
    if inside.is_file() {
        Err(format!("this is a directory; give {}", inside.display()))
    } else {
        Ok(path.into())
    }
}
