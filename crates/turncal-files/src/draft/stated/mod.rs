//! Facts about a log that the user states in options.

mod kalibr;

use std::collections::BTreeSet;
use std::path::Path;

pub use kalibr::KalibrImu;

use super::name::{self, Unit};
use crate::quantity::{OUTPUTS, Of, units};
use turncal::earth::Site;
use turncal::imu::{Noise, PerSensor, Sensor};
use turncal::models::{Instrument, ModelError, Place, Tolerances};
use turncal::units::DEGREE;
use turncal_input::{FileError, choice, stated_gravity_sigma, suggestion};
use turncal_logs::{DataFile, Table};

/// User information about a log without a `run.toml`; other fields are detected or have a wide prior.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stated {
    /// The accelerometer file, if the log contains only gyro data.
    pub accel_file: Option<DataFile>,
    /// Columns, by name.
    pub columns: StatedColumns,
    /// Rows per second.
    pub rate_hz: Option<f64>,
    /// Geodetic latitude, north positive.
    pub latitude_deg: Option<f64>,
    /// Height above the ellipsoid.
    pub height_m: Option<f64>,
    /// Gravity at the site.
    pub gravity_m_s2: Option<f64>,
    /// Unit of the gyros.
    pub gyro_unit: Option<StatedUnit>,
    /// Unit of the accelerometers.
    pub accel_unit: Option<StatedUnit>,
    /// Noise figures.
    pub noise: Option<PerSensor<Noise>>,
    /// Tolerances of the instrument as it was delivered.
    pub tolerances: Option<Tolerances>,
}

/// Errors in reading a data sheet.
#[derive(Debug, thiserror::Error)]
pub enum DataSheetError {
    /// The sensor could not be read.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The file of noise figures could not be read.
    #[error(transparent)]
    File(#[from] FileError),
}

impl Stated {
    /// The stated units.
    pub fn units(&self) -> impl Iterator<Item = (Sensor, StatedUnit)> {
        let of = |sensor: Sensor| Some((sensor, sensor.pick(self.gyro_unit, self.accel_unit)?));
        Sensor::ALL.into_iter().filter_map(of)
    }

    /// The site; every value that is not stated has a wide σ.
    pub fn site(&self) -> Site {
        let latitude = self.latitude_deg.map(|degrees| degrees * DEGREE);
        let site = Site::of_knowledge(latitude, 0.0, self.height_m);
        match self.gravity_m_s2 {
            Some(gravity) => {
                site.with_gravity(gravity, stated_gravity_sigma(&format!("{gravity:?}")))
            }
            None => site,
        }
    }

    /// Adds noise and tolerances of a sensor, by its name or file, and the figures of a Kalibr `imu.yaml`, which
    /// override those of the sensor. If a rate was already stated, it is kept.
    ///
    /// # Errors
    /// Returns [`DataSheetError`] if the sensor or the file cannot be read.
    pub fn with_data_sheets(
        self,
        sensor: Option<&str>,
        noise_file: Option<&Path>,
    ) -> Result<Self, DataSheetError> {
        let kalibr = noise_file.map(KalibrImu::read).transpose()?;
        let sensor = sensor.map(|name| Instrument::load(name, &Place::CommandLine));
        let sensor = sensor.transpose()?;
        let of_sensor = sensor.as_ref().map(|of| of.noise);
        Ok(Self {
            rate_hz: self.rate_hz.or(kalibr.and_then(|imu| imu.rate_hz)),
            noise: kalibr.map(|imu| imu.noise).or(of_sensor),
            tolerances: sensor.as_ref().map(Instrument::tolerances),
            ..self
        })
    }
}

/// Columns of a table that the user stated; the other columns are detected.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StatedColumns {
    /// Columns of each triad along the right, front and up axes.
    pub triads: PerSensor<Option<[String; 3]>>,
    /// Time.
    pub time: Option<String>,
    /// Temperature of the instrument.
    pub temperature: Option<String>,
}

impl StatedColumns {
    /// Refuses a column that the table does not have.
    pub fn check(&self, table: &Table) -> Result<(), FileError> {
        let triad = |of: Sensor| self.triads.get(of).iter().flatten();
        let triads = Sensor::ALL.into_iter().flat_map(triad);
        let mut all = triads.chain(&self.time).chain(&self.temperature);
        let Some(missing) = all.find(|name| !table.names().contains(name)) else {
            return Ok(());
        };
        let names = || table.names().iter().map(String::as_str);
        let found = format_args!("the columns {}", choice(missing, names()));
        let advice = suggestion(missing, names(), "Correct the name.");
        let expected = format_args!("a column `{missing}`");
        Err(FileError::of(table.name(), found, expected, advice))
    }
}

/// A unit spelt as in `run.toml` or in log files, or a multiple of it: `deg/s`, `1/131 deg/s`, `0.061 mg`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatedUnit(pub Unit);

impl StatedUnit {
    /// Parses the unit for the triad of a sensor.
    ///
    /// # Errors
    /// Returns the list of accepted units if the string is not one of them.
    pub fn parse(sensor: Sensor, text: &str) -> Result<Self, String> {
        let is_of_it = |unit: &Unit| match unit.of {
            Of::Rows(of, _) => of == sensor,
            Of::Count => unit.times == 1.0,
            Of::Time | Of::Field | Of::Other => false,
        };
        let unit = name::unit(text).filter(is_of_it);
        unit.map(Self).ok_or_else(|| {
            let all = OUTPUTS.into_iter().flat_map(|output| units(sensor, output));
            let words: BTreeSet<&str> = all.map(|(word, _)| word).collect();
            let words: Vec<&str> = words.into_iter().collect();
            let example = sensor.pick("1/131 deg/s", "1/16384 g");
            let words = words.join(", ");
            format!("expected one of {words}, or the size of one count, such as '{example}'")
        })
    }
}
