//! Selects the streams or files that contain the data of the instrument.

mod member;

use crate::Sheet;
use crate::joined;
use crate::joined::Part;
use crate::schema::page::Remarks;
use crate::schema::{AccelFromFile, ImuFile, Names, TimeColumn, TimeUnitField};
use turncal::imu::{AXES, Output, PerSensor, Sensor};
use turncal_input::{FileError, choice, suggestion};
use turncal_logs::clock::{Breaks, Clock, TimeUnit};
use turncal_logs::rows::LogRows;
use turncal_logs::{DataFile, streams};

pub use member::{FEWEST_ROWS, MagnetometerStream};
use member::{Member, names, tagged, tell_apart};

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

/// Text files written from a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    pub accel: Option<String>,
    /// Whether the gyros are in this file and the accelerometers are in the log.
    pub is_exchanged: bool,
}

/// Maximum number of columns listed per stream.
const MOST_SHOWN: usize = 12;

/// A text reduced to one line.
fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ")
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
