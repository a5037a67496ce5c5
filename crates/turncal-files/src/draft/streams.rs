//! Selects the streams or files that contain the data of the instrument.

use super::columns::{self, Columns};
use super::name::{Name, by_stem};
use super::time;
use super::triads::MagnetometerColumns;
use super::triads::{Triad, uneven};
use crate::Sheet;
use crate::joined;
use crate::joined::Part;
use crate::schema::page::Remarks;
use crate::schema::{AccelFromFile, ImuFile, Names, TimeColumn, TimeUnitField};
use turncal::imu::{AXES, Output, PerSensor, Sensor};
use turncal_input::{FileError, choice, list, suggestion};
use turncal_logs::clock::{Breaks, Clock, TimeUnit};
use turncal_logs::csv_file::CsvFile;
use turncal_logs::rows::LogRows;
use turncal_logs::streams::{Column, Found, Stream};
use turncal_logs::{DataFile, Source, streams};

/// The gyro and accelerometer streams.
#[derive(Debug, Clone, PartialEq)]
pub struct Streams {
    /// Content of the log, one line per stream.
    listed: Vec<String>,
    /// The gyro stream and, if it is separate, the accelerometer stream.
    pub gyro: String,
    pub accel: Option<String>,
    /// Time columns and their units, if there are two streams.
    pub time: Option<PerSensor<(String, String)>>,
    /// Column names in the log.
    pub names: Vec<String>,
    /// A magnetometer in a stream of its own.
    pub magnetometer: Option<MagnetometerStream>,
    remarks: Vec<String>,
    /// Body axes used by the program that wrote the log.
    pub axes: Option<&'static str>,
    /// The first damage.
    pub damage: Option<FileError>,
    /// The accelerometer file, if both triads are in text files.
    pub written: Option<Written>,
}

/// A magnetometer in a stream of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct MagnetometerStream {
    stream: String,
    pub names: [String; 3],
    /// Time column and its unit.
    time: (String, String),
    pub found: MagnetometerColumns,
}

/// Text files written from a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    pub accel: Option<String>,
    /// Whether the gyros are in this file and the accelerometers are in the log.
    pub is_exchanged: bool,
}

/// Minimum number of rows of a run.
pub const FEWEST_ROWS: usize = 100;
/// Maximum number of columns listed per stream.
const MOST_SHOWN: usize = 12;

/// A text reduced to one line.
fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ")
}

/// A stream of a log, or a file of rows.
struct Member {
    file: DataFile,
    is_stream: bool,
    found: Found,
    triads: PerSensor<Option<[usize; 3]>>,
    /// The time column, with its unit if known.
    time: Option<(String, String)>,
    /// A triad without a name, with the scatter of the logarithm of its magnitude.
    unnamed: Option<(Triad, f64)>,
}

impl Streams {
    /// Examines a log; returns `None` for a text file with a single stream.
    pub fn of_file(
        file: &DataFile,
        wanted: Option<&str>,
    ) -> Result<Option<(Self, Sheet)>, FileError> {
        let log = streams::open(file)?;
        let is_text = log.is_none();
        let (members, mut damage) = match log {
            Some(log) => {
                let (found, damage) = streams::survey(file, log);
                let member = |found| Member::of_stream(file, found);
                (found.into_iter().map(member).collect(), damage)
            }
            None => (tagged(file)?, None),
        };
        let all = || members.iter().map(|member| &*member.found.stream.name);
        if let Some(damage) = damage.take_if(|_| members.is_empty()) {
            return Err(damage);
        }
        if let Some(wanted) = wanted.filter(|wanted| !all().any(|name| name == *wanted)) {
            let found = if members.is_empty() {
                "one stream without a name".to_owned()
            } else {
                format!("the streams {}", choice(wanted, all()))
            };
            let expected = format_args!("a stream `{wanted}`");
            let advice = suggestion(wanted, all(), "Correct or omit --stream.");
            return Err(FileError::of(file, found, expected, advice));
        }
        if members.is_empty() && is_text {
            return Ok(None);
        }
        let Some((gyro, accel)) = chosen(&members, wanted) else {
            let (expected, advice) = ("at least one stream of samples", "Record the file again.");
            return Err(FileError::of(file, "no samples", expected, advice));
        };
        let salvage = damage.is_some();
        let gyro = &members[gyro];
        let (mut streams, sheet) = match accel.map(|accel| &members[accel]) {
            Some(accel) => Self::of_pair(&PerSensor { gyro, accel }, salvage)?,
            None => {
                let mut sheet = Sheet::of(gyro.source(salvage).open()?, FEWEST_ROWS)?;
                sheet.names = names(&gyro.found);
                (Self::of(gyro, None), sheet)
            }
        };
        streams.listed = listed(&members);
        let others = members
            .iter()
            .filter(|of| of.found.stream.name != streams.gyro);
        streams.magnetometer = others.filter_map(|of| of.magnetometer(salvage)).next();
        streams.damage = damage;
        Ok(Some((streams, sheet)))
    }

    /// Examines the files of both triads, as written by phones and `ulog2csv`, or one file with separate rows; `name`
    /// is the name of a separate accelerometer file in the draft.
    pub fn of_two_files(
        gyro: &DataFile,
        accel: &DataFile,
        accel_name: Option<&str>,
    ) -> Result<(Self, Sheet), FileError> {
        let first = Member::of_rows(gyro, Sensor::Gyro)?;
        let mut pair = [first, Member::of_rows(accel, Sensor::Accel)?];
        tell_apart(&mut pair);
        let is_accel = |of: &Member| of.triads.accel.is_some() && of.triads.gyro.is_none();
        let is_exchanged = is_accel(&pair[0]) && pair[1].triads.gyro.is_some();
        if is_exchanged {
            pair.reverse();
        }
        let [gyro, accel] = &pair;
        let (mut streams, sheet) = Self::of_pair(&PerSensor { gyro, accel }, false)?;
        streams.written = Some(Written {
            accel: accel_name.map(str::to_owned),
            is_exchanged,
        });
        Ok((streams, sheet))
    }

    /// Both triads on one clock, as columns with descriptive names.
    fn of_pair(pair: &PerSensor<&Member>, salvage: bool) -> Result<(Self, Sheet), FileError> {
        let sources = PerSensor::from_fn(|sensor| pair.get(sensor).source(salvage));
        let triads = PerSensor::try_from_fn(|sensor| pair.get(sensor).triad(sensor))?;
        let time = PerSensor::try_from_fn(|sensor| pair.get(sensor).time_by(sources.get(sensor)))?;
        let part = |sensor: Sensor| {
            let (name, unit) = time.get(sensor);
            Part {
                source: sources.get(sensor),
                clock: Clock {
                    column: Some(name),
                    nanoseconds: None,
                    unit: (TimeUnitField::of_text(unit).unit()).unwrap_or(TimeUnit::PerSecond(1.0)),
                    period: None,
                    breaks: Breaks::None,
                },
                columns: *triads.get(sensor),
                further: &[],
            }
        };
        let joined = joined::read(&PerSensor::from_fn(part), Output::Rate, 1.0)?;
        let mut sheet = Sheet::of(LogRows::new(joined), FEWEST_ROWS)?;
        let plain = |sensor: Sensor| AXES.map(|axis| format!("{}_{axis}", sensor.name()));
        let plain = Sensor::ALL.into_iter().flat_map(plain);
        sheet.names = std::iter::once("time".to_owned()).chain(plain).collect();
        let mut streams = Self::of(pair.gyro, Some(pair.accel));
        let own = [triads.gyro, triads.accel].into_iter().flatten();
        let own = std::iter::once(&*time.gyro.0).chain(own);
        streams.names = own.map(str::to_owned).collect();
        streams.time = Some(time);
        Ok((streams, sheet))
    }

    fn of(gyro: &Member, accel: Option<&Member>) -> Self {
        let columns = gyro.found.stream.columns.iter();
        let taken = std::iter::once(gyro).chain(accel);
        let remarks = taken.flat_map(|member| &member.found.stream.remarks);
        Self {
            listed: Vec::new(),
            gyro: gyro.found.stream.name.clone(),
            accel: accel.map(|accel| accel.found.stream.name.clone()),
            time: None,
            names: columns.map(|column| column.name.clone()).collect(),
            magnetometer: None,
            remarks: remarks.map(|remark| one_line(remark)).collect(),
            axes: gyro.found.stream.axes,
            damage: None,
            written: None,
        }
    }

    /// Writes the selected streams into `[imu]`, below comments that describe the content of the log.
    pub fn describe(&self, imu: &mut ImuFile, remarks: &mut Remarks) {
        if self.written.is_none() {
            for line in &self.listed {
                remarks.before("imu.stream", line);
            }
            imu.stream = Some(self.gyro.clone());
        }
        if let Some((accel, time)) = self.accel.as_ref().zip(self.time.as_ref()) {
            let (time, unit) = &time.accel;
            let is_stream = self.written.is_none();
            imu.accel_from = Some(AccelFromFile {
                file: self.written.as_ref().and_then(|of| of.accel.clone()),
                stream: is_stream.then(|| accel.clone()),
                time: Some(TimeColumn::One(time.clone())),
                time_unit: Some(TimeUnitField::of_text(unit)),
                ..AccelFromFile::default()
            });
            let other = imu.accel_from.as_mut().and_then(|of| of.file.as_mut());
            if let Some(other) =
                other.filter(|_| self.written.as_ref().is_some_and(|of| of.is_exchanged))
            {
                std::mem::swap(&mut imu.file, other);
            }
            let why = "the accelerometers have their own clock; --with time-offset estimates the difference";
            remarks.reason("imu.accel_from", why);
        }
        if let Some(of) = &self.magnetometer {
            let (time, unit) = &of.time;
            imu.columns.mag = Some(Names(of.names.clone()));
            imu.mag_unit = Some(of.found.unit.to_owned());
            imu.mag_from = Some(AccelFromFile {
                stream: Some(of.stream.clone()),
                time: Some(TimeColumn::One(time.clone())),
                time_unit: Some(TimeUnitField::of_text(unit)),
                ..AccelFromFile::default()
            });
            remarks.reason("imu.mag_unit", of.found.why());
        }
        for remark in &self.remarks {
            remarks.before("imu.salvage", remark);
        }
        if let Some(damage) = self.damage.as_ref().filter(|_| self.written.is_none()) {
            let damage = one_line(&damage.to_string());
            imu.salvage = Some(true);
            let why =
                format_args!("uncomment this line to use the intact part of the file. {damage}");
            remarks.open("imu.salvage", why);
        }
    }
}

impl Member {
    fn of_stream(file: &DataFile, found: Found) -> Self {
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
    fn of_rows(file: &DataFile, sensor: Sensor) -> Result<Self, FileError> {
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

    fn source(&self, salvage: bool) -> Source<'_> {
        Source {
            stream: self.is_stream.then_some(&*self.found.stream.name),
            salvage,
            ..Source::of_file(self.file.clone())
        }
    }

    fn is_of_both(&self) -> bool {
        self.triads.gyro.is_some() && self.triads.accel.is_some()
    }

    fn missing(&self, expected: &str) -> FileError {
        let columns = self.found.stream.columns.iter();
        let columns = list(columns.map(|column| &*column.name));
        let found = format_args!("the columns {columns}");
        let advice = "Rename the columns or the file, or complete the fields by hand.";
        FileError::of(&self.file, found, expected, advice)
    }

    /// The magnetometer, if the stream has one and can be read.
    fn magnetometer(&self, salvage: bool) -> Option<MagnetometerStream> {
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
    fn triad(&self, sensor: Sensor) -> Result<[&str; 3], FileError> {
        let expected = sensor.pick("three gyro columns", "three accelerometer columns");
        let triad = self.triads.get(sensor);
        let triad = triad.ok_or_else(|| self.missing(expected))?;
        Ok(triad.map(|k| &*self.found.stream.columns[k].name))
    }

    /// The time column and its unit, from its steps if not stated.
    fn time_by(&self, source: &Source) -> Result<(String, String), FileError> {
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
fn tell_apart(pair: &mut [Member; 2]) {
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

/// Content of a log, one line per stream.
fn listed(members: &[Member]) -> Vec<String> {
    let mut others = Vec::new();
    let mut lines = Vec::new();
    for Member { found, triads, .. } in members {
        let (name, samples) = (one_line(&found.stream.name), found.samples);
        if triads.gyro.is_none() && triads.accel.is_none() {
            others.push(format!("{name} ({samples})"));
            continue;
        }
        let columns = &found.stream.columns;
        let shown = columns.iter().take(MOST_SHOWN).map(|of| &*of.name);
        let more = (columns.len() > MOST_SHOWN).then_some("…");
        let shown = one_line(&shown.chain(more).collect::<Vec<_>>().join(", "));
        lines.push(format!("{name}: {samples} samples of {shown}"));
    }
    if !others.is_empty() {
        lines.push(format!("other streams: {}", others.join(", ")));
    }
    lines
}

/// The gyro stream, and the accelerometer stream if separate; otherwise the longest stream.
fn chosen(members: &[Member], wanted: Option<&str>) -> Option<(usize, Option<usize>)> {
    let samples = |k: Option<usize>| k.map_or(0, |k| members[k].found.samples);
    let is_meant = |k: usize| match wanted {
        Some(name) => members[k].found.stream.name == name,
        None => members[k].found.stream.is_inertial && samples(Some(k)) >= FEWEST_ROWS as u64,
    };
    // If there are equal ones, the first.
    let longest = |is: &dyn Fn(usize) -> bool| {
        let all = (0..members.len()).rev().filter(|&k| is(k));
        all.max_by_key(|&k| samples(Some(k)))
    };
    // Streams are combined by their times.
    let has = |of: &Member, sensor| of.time.is_some() && of.triads.get(sensor).is_some();
    let with = |sensor| longest(&|k| is_meant(k) && has(&members[k], sensor));
    let both = longest(&|k| is_meant(k) && members[k].is_of_both());
    let (gyro, accel) = (with(Sensor::Gyro), with(Sensor::Accel));
    match (both, gyro, accel) {
        (Some(_), ..) if samples(both) >= samples(gyro).min(samples(accel)) => {
            both.map(|both| (both, None))
        }
        (_, Some(gyro), Some(accel)) => Some((gyro, Some(accel))),
        _ => {
            let any = longest(&is_meant).or_else(|| longest(&|_| true))?;
            Some((any, None))
        }
    }
}

/// Column names of a stream, prefixed with the stream name if not descriptive.
fn names(found: &Found) -> Vec<String> {
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
fn tagged(file: &DataFile) -> Result<Vec<Member>, FileError> {
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
