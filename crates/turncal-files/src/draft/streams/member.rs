//! A stream of a log, or a file of rows: its triads, its time and its magnetometer.

use crate::Sheet;
use crate::draft::columns::{self, Columns};
use crate::draft::name::{Name, by_stem};
use crate::draft::time;
use crate::draft::triads::{MagnetometerColumns, Triad, uneven};
use turncal::imu::{PerSensor, Sensor};
use turncal_input::{FileError, list};
use turncal_logs::csv_file::CsvFile;
use turncal_logs::streams::{Column, Found, Stream};
use turncal_logs::{DataFile, Source};

/// Minimum number of rows of a run.
pub const FEWEST_ROWS: usize = 100;

/// A magnetometer in a stream of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct MagnetometerStream {
    pub stream: String,
    pub names: [String; 3],
    /// Time column and its unit.
    pub time: (String, String),
    pub found: MagnetometerColumns,
}

/// A stream of a log, or a file of rows.
pub struct Member {
    pub file: DataFile,
    pub is_stream: bool,
    pub found: Found,
    pub triads: PerSensor<Option<[usize; 3]>>,
    /// The time column, with its unit if known.
    pub time: Option<(String, String)>,
    /// A triad without a name, with the scatter of the logarithm of its magnitude.
    pub unnamed: Option<(Triad, f64)>,
}

impl Member {
    pub fn of_stream(file: &DataFile, found: Found) -> Self {
        let all: Vec<Name> = names(&found).iter().map(|name| Name::of(name)).collect();
        let triads = PerSensor::from_fn(|sensor| {
            let of = |k: &usize| all[*k].sensor() == Some(sensor);
            let candidates: Vec<usize> = (0..all.len()).filter(of).collect();
            by_stem(&all, &candidates).into_iter().next()
        });
        let best = (0..all.len()).rev().max_by_key(|&k| all[k].is_time());
        let columns = &found.stream.columns;
        // `t_gyro`, `imu.t`
        let has_word = |column: &&Column| {
            let mut words = column.name.split(|c: char| !c.is_alphanumeric());
            words.any(|word| ["t", "ts"].contains(&word))
        };
        let named = best.filter(|&k| all[k].is_time() > 1).map(|k| &columns[k]);
        let time = named.or_else(|| columns.iter().find(has_word));
        Self {
            file: file.clone(),
            is_stream: true,
            triads,
            time: time.map(|column| (column.name.clone(), column.unit.to_owned())),
            unnamed: None,
            found,
        }
    }

    /// The rows of a file with values of a sensor.
    pub fn of_rows(file: &DataFile, sensor: Sensor) -> Result<Self, FileError> {
        let mut sheet = Sheet::read(file, FEWEST_ROWS)?;
        let of_sensor = columns::named(&sheet, sensor);
        if !of_sensor.is_empty() {
            sheet.retain(|of, row| of.has(&of_sensor, row));
        }
        let mut columns = Columns::find(&sheet);
        let unit = time::Clock::find(&sheet, &mut columns).unit;
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        let mut found = rows_as_stream(&stem, &sheet);
        // File names as written by PX4's ulog2csv.
        let topics = ["sensor_gyro_", "sensor_accel_"];
        let is_of_px4 = topics.iter().any(|topic| stem.contains(topic));
        found.stream.axes = is_of_px4.then_some("frd");
        let triad = columns.triads.gyro.or(columns.triads.accel);
        let of_stream = Self::of_stream(file, found);
        let is_named = of_stream.triads != PerSensor::default();
        let unnamed = triad.filter(|_| columns.by_size && !is_named);
        Ok(Self {
            is_stream: false,
            time: columns.time.map(|k| (sheet.names[k].clone(), unit)),
            unnamed: unnamed.map(|triad| (triad, uneven(&sheet.columns, &triad))),
            ..of_stream
        })
    }

    pub fn source(&self, salvage: bool) -> Source<'_> {
        Source {
            stream: self.is_stream.then_some(&*self.found.stream.name),
            salvage,
            ..Source::of_file(self.file.clone())
        }
    }

    pub fn is_of_both(&self) -> bool {
        self.triads.gyro.is_some() && self.triads.accel.is_some()
    }

    pub fn missing(&self, expected: &str) -> FileError {
        let columns = self.found.stream.columns.iter();
        let columns = list(columns.map(|column| &*column.name));
        let found = format_args!("the columns {columns}");
        let advice = "Rename the columns or the file, or complete the fields by hand.";
        FileError::of(&self.file, found, expected, advice)
    }

    /// The magnetometer, if the stream has one and can be read.
    pub fn magnetometer(&self, salvage: bool) -> Option<MagnetometerStream> {
        let names: Vec<Name> = names(&self.found)
            .iter()
            .map(|name| Name::of(name))
            .collect();
        let is_named = Name::of(&self.found.stream.name).is_magnetic();
        if !is_named && !names.iter().any(Name::is_magnetic) {
            return None;
        }
        let source = self.source(salvage);
        let sheet = Sheet::of(source.open().ok()?, FEWEST_ROWS).ok()?;
        let (time, _) = self.time.as_ref()?;
        let alone = || MagnetometerColumns::alone(&sheet, time).filter(|_| is_named);
        let found = MagnetometerColumns::find(&sheet, &names).or_else(alone)?;
        let name = |k: usize| self.found.stream.columns[k].name.clone();
        Some(MagnetometerStream {
            stream: self.found.stream.name.clone(),
            names: found.columns.map(name),
            time: self.time_by(&source).ok()?,
            found,
        })
    }

    /// The names of a triad's columns.
    pub fn triad(&self, sensor: Sensor) -> Result<[&str; 3], FileError> {
        let expected = sensor.pick("three gyro columns", "three accelerometer columns");
        let triad = self.triads.get(sensor);
        let triad = triad.ok_or_else(|| self.missing(expected))?;
        Ok(triad.map(|k| &*self.found.stream.columns[k].name))
    }

    /// The time column and its unit, from its steps if not stated.
    pub fn time_by(&self, source: &Source) -> Result<(String, String), FileError> {
        let missing = || self.missing("a time column");
        let (name, mut unit) = self.time.clone().ok_or_else(missing)?;
        if unit.is_empty() {
            let sheet = Sheet::of(source.open()?, FEWEST_ROWS)?;
            let mut columns = Columns::find(&sheet);
            columns.time = sheet.names.iter().position(|known| *known == name);
            unit = time::Clock::find(&sheet, &mut columns).unit;
        }
        Ok((name, unit))
    }
}

/// Assigns triads without names in two files: gravity keeps the magnitude of accelerometers constant.
pub fn tell_apart(pair: &mut [Member; 2]) {
    let accel = match [&pair[0], &pair[1]].map(|of| of.unnamed) {
        [Some((_, first)), Some((_, second))] => usize::from(second <= first),
        [Some(_), None] => usize::from(pair[1].triads.gyro.is_none()),
        [None, _] => usize::from(pair[0].triads.gyro.is_some()),
    };
    for (place, of) in pair.iter_mut().enumerate() {
        let sensor = if place == accel {
            Sensor::Accel
        } else {
            Sensor::Gyro
        };
        if let Some((triad, _)) = of.unnamed {
            *of.triads.get_mut(sensor) = Some(triad);
        }
    }
}

/// Column names of a stream, prefixed with the stream name if not descriptive.
pub fn names(found: &Found) -> Vec<String> {
    let columns = found.stream.columns.iter();
    let bare: Vec<String> = columns.map(|column| column.name.clone()).collect();
    // Column numbers after the name of a stream would look like axis numbers.
    let is_number = |name: &String| name.bytes().all(|of| of.is_ascii_digit());
    if bare.iter().any(|name| Name::of(name).sensor().is_some()) || bare.iter().all(is_number) {
        return bare;
    }
    let stream = &found.stream.name;
    let stream = stream.split_once('[').map_or(&**stream, |(name, _)| name);
    bare.iter().map(|name| format!("{stream}.{name}")).collect()
}

/// The streams of a text file with tagged rows; empty for other text files.
pub fn tagged(file: &DataFile) -> Result<Vec<Member>, FileError> {
    let of_tag = |tag: String| {
        let source = Source {
            stream: Some(&tag),
            ..Source::of_file(file.clone())
        };
        let mut sheet = Sheet::of(source.open()?, 1)?;
        if let Some((column, number)) = columns::instance(&sheet) {
            let name = &sheet.names[column];
            return Err(FileError::of(
                file,
                format_args!(
                    "several instruments in the rows `{tag}`, distinguished by the column `{name}`"
                ),
                "the rows of one instrument",
                format!(
                    "Keep only the rows of one instrument, such as those with {name} = {number}."
                ),
            ));
        }
        let mut member = Member::of_stream(file, rows_as_stream(&tag, &sheet));
        sheet.names = names(&member.found);
        let columns = Columns::find(&sheet);
        let time = columns.time.map(|k| &member.found.stream.columns[k]);
        member.time = time.map(|column| (column.name.clone(), column.unit.to_owned()));
        member.triads = columns.triads;
        // The tag may identify a triad if the names do not.
        if columns.by_size
            && !member.is_of_both()
            && let Some(sensor) = Name::of(&tag).sensor()
        {
            let triad = columns.triads.gyro.or(columns.triads.accel);
            member.triads = PerSensor::default();
            *member.triads.get_mut(sensor) = triad;
        }
        Ok(member)
    };
    // Rows that only comment on others need not be regular.
    let members = CsvFile::tags(file)?.into_iter().map(of_tag);
    let (read, refused): (Vec<_>, Vec<_>) = members.partition(Result::is_ok);
    let is_inertial = |of: &Member| of.triads != PerSensor::default();
    let is_enough = read.iter().flatten().any(is_inertial) || refused.is_empty();
    let members = if is_enough { read } else { refused };
    members.into_iter().collect()
}

/// Rows of a text file as a stream.
fn rows_as_stream(name: &str, sheet: &Sheet) -> Found {
    let column = |(name, unit): (&String, &String)| {
        let unit = Name::of_column(name, unit).unit;
        let unit = unit.filter(|unit| unit.times == 1.0);
        let (name, unit) = (name.clone(), unit.map_or("", |unit| unit.word));
        Column { name, unit }
    };
    Found {
        stream: Stream {
            name: name.to_owned(),
            columns: sheet.names.iter().zip(&sheet.units).map(column).collect(),
            is_inertial: true,
            ..Stream::default()
        },
        samples: sheet.rows() as u64,
    }
}
