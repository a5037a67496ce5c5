//! What a user states about a log.

use std::error::Error;

use serde::Deserialize;
use turncal::imu::Sensor;
use turncal::models;
use turncal::models::{Instrument, ModelError, Place, Room};
use turncal_files::draft::{Stated, StatedUnit};

/// The fields of the form, with the names of the options of `turncal calibrate`; `None` for empty fields.
#[derive(Deserialize, Default, PartialEq)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct Statements {
    rate: Option<f64>,
    latitude: Option<f64>,
    height: Option<f64>,
    gravity: Option<f64>,
    gyro_unit: Option<String>,
    accel_unit: Option<String>,
    sensor: Option<String>,
    stream: Option<String>,
}

impl Statements {
    /// The stream of the instrument.
    pub fn stream(&self) -> Option<&str> {
        self.stream.as_deref()
    }

    pub fn stated(&self) -> Result<Stated, Box<dyn Error>> {
        let sensor = self.sensor.as_deref().map(instrument).transpose()?;
        let unit = |sensor: Sensor, text: &Option<String>| match text {
            Some(text) => StatedUnit::parse(sensor, text)
                .map(Some)
                .map_err(|expected| format!("{} unit `{text}`: {expected}", sensor.name())),
            None => Ok(None),
        };
        Ok(Stated {
            rate_hz: self.rate,
            latitude_deg: self.latitude,
            height_m: self.height,
            gravity_m_s2: self.gravity,
            gyro_unit: unit(Sensor::Gyro, &self.gyro_unit)?,
            accel_unit: unit(Sensor::Accel, &self.accel_unit)?,
            noise: sensor.as_ref().map(|sensor| sensor.noise),
            tolerances: sensor.as_ref().map(Instrument::tolerances),
            ..Stated::default()
        })
    }
}

/// The embedded instrument of this name, in which case, spaces and hyphens do not matter.
fn instrument(name: &str) -> Result<Instrument, Box<dyn Error>> {
    let letters = |name: &str| -> String {
        let letters = name.chars().filter(|letter| letter.is_alphanumeric());
        letters.flat_map(char::to_lowercase).collect()
    };
    let known = models::names(Room::Imu).find(|known| letters(known) == letters(name));
    match Instrument::load(known.unwrap_or(name), &Place::Embedded) {
        Err(ModelError::Unknown { nearest, .. }) => Err(match nearest {
            Some(nearest) => format!("Sensor: found no {name}. Did you mean {nearest}?"),
            None => format!(
                "Sensor: found no {name}. Choose one of the list, or leave the field empty."
            ),
        }
        .into()),
        loaded => Ok(loaded?),
    }
}
