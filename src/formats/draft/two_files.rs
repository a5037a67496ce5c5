//! Gyros and accelerometers in two files of rows, as phones and `ulog2csv` write them.

use std::path::Path;

use super::FEWEST_ROWS;
use super::columns::{self, Columns};
use super::streams::{Member, Places, Streams, Written, joined, of_rows};
use super::time::Clock;
use crate::formats::source::Source;
use crate::formats::streams::Found;
use crate::formats::{FileError, Place, Sheet};
use crate::imu::{PerSensor, Sensor};

impl Streams {
    /// Looks at the files of both triads, which may be one with rows of either; the accelerometers' is called so in
    /// the draft if it is another.
    pub fn of_two_files(
        gyro: &Path,
        accel: &Path,
        accel_name: Option<&str>,
    ) -> Result<(Self, Sheet), FileError> {
        let files = PerSensor { gyro, accel };
        let looked = PerSensor {
            gyro: look(gyro, Sensor::Gyro)?,
            accel: look(accel, Sensor::Accel)?,
        };
        let sources = PerSensor::from_fn(|sensor| Source::of_file(files.get(sensor)));
        let member = |sensor: Sensor| -> Result<Member, FileError> {
            let ((found, places), time) = looked.get(sensor);
            let triad = *places.triads.get(sensor);
            let names = || {
                found
                    .stream
                    .columns
                    .iter()
                    .map(|column| column.name.as_str())
            };
            let missing = |expected: String| {
                let columns = crate::formats::error::list(names());
                let advice = "Rename the columns or the file, or complete the fields by hand.";
                FileError::new(
                    files.get(sensor),
                    Place::File,
                    format_args!("the columns {columns}"),
                    expected,
                    advice,
                )
            };
            Ok(Member {
                source: sources.get(sensor),
                found,
                triad: triad
                    .ok_or_else(|| missing(format!("three columns of the {}", words(sensor))))?,
                time: time
                    .clone()
                    .ok_or_else(|| missing("a column of time".to_owned()))?,
            })
        };
        let members = PerSensor {
            gyro: member(Sensor::Gyro)?,
            accel: member(Sensor::Accel)?,
        };
        let sheet = joined(&members)?;
        let time = PerSensor::from_fn(|sensor| members.get(sensor).time.clone());
        let streams = Self {
            gyro: looked.gyro.0.0.stream.name.clone(),
            accel: Some(looked.accel.0.0.stream.name.clone()),
            time,
            axes: looked.gyro.0.0.stream.axes,
            damage: None,
            written: Some(Written {
                accel: accel_name.map(str::to_owned),
            }),
            found: vec![looked.gyro.0, looked.accel.0],
        };
        Ok((streams, sheet))
    }
}

/// A file as a stream of its own, and its column of time with the unit.
type Looked = ((Found, Places), Option<(String, String)>);

fn look(file: &Path, sensor: Sensor) -> Result<Looked, FileError> {
    let mut sheet = Sheet::read(file, FEWEST_ROWS)?;
    let of_sensor = columns::named(&sheet, sensor);
    if !of_sensor.is_empty() {
        sheet.retain(|columns, row| of_sensor.iter().any(|&k| columns[k][row].is_finite()));
    }
    let mut columns = Columns::find(&sheet);
    let clock = Clock::find(&sheet, &mut columns);
    let time = columns
        .time
        .map(|place| (sheet.names[place].clone(), clock.unit));
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    // As PX4's ulog2csv calls its files.
    let is_of_px4 = ["sensor_gyro_", "sensor_accel_"]
        .iter()
        .any(|topic| stem.contains(topic));
    let mut found = of_rows(stem.into_owned(), &sheet);
    found.stream.axes = is_of_px4.then_some("frd");
    let places = Places::of(&found);
    Ok(((found, places), time))
}

fn words(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Gyro => "gyros",
        Sensor::Accel => "accelerometers",
    }
}
