//! Which streams of a log hold the instrument.

use std::fmt::Write;
use std::path::Path;

use super::columns::{Columns, by_stem};
use super::name::{self, Name};
use super::text::{line, quoted, word_or_number};
use super::{FEWEST_ROWS, time};
use crate::formats::clock::{Breaks, Clock, TimeUnit};
use crate::formats::csv_file::CsvFile;
use crate::formats::joined::{Joined, Part};
use crate::formats::rows::LogRows;
use crate::formats::source::Source;
use crate::formats::streams::{self, Column, Found, Stream};
use crate::formats::{FileError, Sheet};
use crate::imu::{Output, PerSensor, Sensor};

/// A log's streams, and those that hold gyros and accelerometers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Streams {
    pub found: Vec<(Found, Places)>,
    /// The stream of the gyros, and of the accelerometers if that is another.
    pub gyro: String,
    pub accel: Option<String>,
    /// The time of both where there are two, and its unit.
    pub time: PerSensor<(String, String)>,
    /// The body axes that programs of this kind have.
    pub axes: Option<&'static str>,
    /// Where and why the file is damaged.
    pub damage: Option<String>,
    /// The file of the accelerometers, where both triads were written as rows of text.
    pub written: Option<Written>,
}

/// What rows of text a log was written as.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Written {
    pub accel: Option<String>,
}

/// More columns of a stream are not listed.
const MOST_SHOWN: usize = 12;

/// A text of one line, whatever is in it.
fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ")
}

/// The place of each triad and of time in a stream.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Places {
    pub triads: PerSensor<Option<[usize; 3]>>,
    pub time: Option<usize>,
}

impl Streams {
    /// Looks at a log; none if it is a text whose rows are one stream.
    pub fn of_file(file: &Path, wanted: Option<&str>) -> Result<Option<(Self, Sheet)>, FileError> {
        let (found, damage) = match streams::open(file)? {
            Some(log) => {
                let (found, damage) = streams::survey(file, log);
                let with_places = |found: Found| {
                    let places = Places::of(&found);
                    (found, places)
                };
                (found.into_iter().map(with_places).collect(), damage)
            }
            None => (tagged(file)?, None),
        };
        match damage {
            Some(damage) if found.is_empty() => return Err(damage),
            None if found.is_empty() => return Ok(None),
            _ => {}
        }
        let Some((gyro, accel)) = chosen(&found, wanted) else {
            return Err(no_samples(file));
        };
        let salvage = damage.is_some();
        let source = |k: usize| Source {
            file: file.to_owned(),
            stream: Some(&found[k].0.stream.name),
            salvage,
        };
        let numbers = PerSensor {
            gyro,
            accel: accel.unwrap_or(gyro),
        };
        let mut time = PerSensor::from_fn(|sensor| {
            let k = *numbers.get(sensor);
            let (found, places) = &found[k];
            let column = &found.stream.columns[places.time.unwrap_or(0)];
            (column.name.clone(), column.unit.to_owned())
        });
        let sheet = if accel.is_some() {
            let sources = PerSensor::from_fn(|sensor| source(*numbers.get(sensor)));
            find_units(&mut time, &sources)?;
            joined(&PerSensor::from_fn(|sensor| {
                let k = *numbers.get(sensor);
                Member {
                    source: sources.get(sensor),
                    found: &found[k].0,
                    triad: found[k].1.triads.get(sensor).unwrap_or_default(),
                    time: time.get(sensor).clone(),
                }
            }))?
        } else {
            let mut sheet = Sheet::of(source(gyro).open()?, FEWEST_ROWS)?;
            sheet.names = names(&found[gyro].0);
            sheet
        };
        let name = |k: usize| found[k].0.stream.name.clone();
        let streams = Self {
            gyro: name(gyro),
            accel: accel.map(name),
            time,
            axes: found[gyro].0.stream.axes,
            damage: damage.map(|damage| damage.to_string()),
            written: None,
            found,
        };
        Ok(Some((streams, sheet)))
    }

    /// The columns of a stream as the log names them.
    pub fn columns(&self, sensor: Sensor) -> Vec<String> {
        let name = match sensor {
            Sensor::Gyro => &self.gyro,
            Sensor::Accel => self.accel.as_ref().unwrap_or(&self.gyro),
        };
        let found = self
            .found
            .iter()
            .find(|(found, _)| found.stream.name == *name);
        let columns = found.iter().flat_map(|(found, _)| &found.stream.columns);
        columns.map(|column| column.name.clone()).collect()
    }

    /// What the log holds, and the keys that name what is taken of it.
    pub fn write(&self, text: &mut String) {
        // Writing to a string cannot fail.
        if self.written.is_none() {
            self.list(text);
            let _ = writeln!(text, "stream = {}", quoted(&self.gyro));
        }
        if let Some(accel) = &self.accel {
            let (time, unit) = &self.time.accel;
            let place = match &self.written {
                None => format!("stream = {}, ", quoted(accel)),
                Some(Written { accel: Some(file) }) => format!("file = {}, ", quoted(file)),
                Some(Written { accel: None }) => String::new(),
            };
            let mut keys = format!("{place}time = {}", quoted(time));
            if !unit.is_empty() {
                let _ = write!(keys, ", time_unit = {}", word_or_number(unit));
            }
            let why = "accelerometers have a clock of their own; --with time-offset finds how far they are apart";
            line(text, "accel_from", &format!("{{ {keys} }}"), why);
        }
        for (found, _) in &self.found {
            let is_taken =
                found.stream.name == self.gyro || self.accel.as_ref() == Some(&found.stream.name);
            for remark in found.stream.remarks.iter().filter(|_| is_taken) {
                let _ = writeln!(text, "# {}", one_line(remark));
            }
        }
        if let Some(damage) = self.damage.as_ref().filter(|_| self.written.is_none()) {
            let damage = one_line(damage);
            let _ = writeln!(
                text,
                "# salvage = true  # TODO: take the # away to use what is whole. {damage}"
            );
        }
    }

    /// What the log holds, a comment a stream.
    fn list(&self, text: &mut String) {
        let mut others = Vec::new();
        for (Found { stream, samples }, Places { triads, .. }) in &self.found {
            if triads.gyro.is_none() && triads.accel.is_none() {
                others.push(format!("{} ({samples})", one_line(&stream.name)));
                continue;
            }
            let columns: Vec<&str> = stream.columns.iter().map(|column| &*column.name).collect();
            let shown = &columns[..columns.len().min(MOST_SHOWN)];
            let more = if columns.len() > MOST_SHOWN {
                ", …"
            } else {
                ""
            };
            let (name, shown) = (one_line(&stream.name), one_line(&shown.join(", ")));
            let _ = writeln!(text, "# {name}: {samples} samples of {shown}{more}");
        }
        if !others.is_empty() {
            let _ = writeln!(text, "# and samples of other kinds: {}", others.join(", "));
        }
    }

    /// The columns of both streams.
    pub fn write_columns(&self, text: &mut String) {
        let mut fields = vec![format!("time = {}", quoted(&self.time.gyro.0))];
        for sensor in Sensor::ALL {
            if let Some(triad) = self.triad(sensor) {
                let names = triad.map(|name| quoted(&name));
                fields.push(format!("{} = [{}]", sensor.name(), names.join(", ")));
            }
        }
        let _ = writeln!(text, "columns = {{ {} }}", fields.join(", "));
    }

    /// The three columns of a triad in its stream.
    pub fn triad(&self, sensor: Sensor) -> Option<[String; 3]> {
        let name = match sensor {
            Sensor::Gyro => &self.gyro,
            Sensor::Accel => self.accel.as_ref()?,
        };
        let (found, places) = self
            .found
            .iter()
            .find(|(found, _)| found.stream.name == *name)?;
        let triad = (*places.triads.get(sensor))?;
        Some(triad.map(|k| found.stream.columns[k].name.clone()))
    }
}

/// The stream of the gyros, and of the accelerometers if that is another; where no stream that is meant has them,
/// the longest.
fn chosen(found: &[(Found, Places)], wanted: Option<&str>) -> Option<(usize, Option<usize>)> {
    let samples = |k: Option<usize>| k.map_or(0, |k| found[k].0.samples);
    let is_meant = |k: &usize| match wanted {
        Some(name) => found[*k].0.stream.name == name,
        None => found[*k].0.stream.is_inertial && samples(Some(*k)) >= FEWEST_ROWS as u64,
    };
    let with = |sensor: Sensor, other: bool| {
        let of = (0..found.len()).filter(is_meant).filter(|&k| {
            // Streams are put together by their times.
            let Places { triads, time } = &found[k].1;
            if !other && time.is_none() {
                return false;
            }
            let has_both = triads.gyro.is_some() && triads.accel.is_some();
            triads.get(sensor).is_some() && (!other || has_both)
        });
        // Of equal ones the first.
        of.rev().max_by_key(|&k| samples(Some(k)))
    };
    let (both, gyro, accel) = (
        with(Sensor::Gyro, true),
        with(Sensor::Gyro, false),
        with(Sensor::Accel, false),
    );
    let apart = samples(gyro).min(samples(accel));
    match (both, gyro, accel) {
        (Some(both), ..) if samples(Some(both)) >= apart => Some((both, None)),
        (_, Some(gyro), Some(accel)) => Some((gyro, Some(accel))),
        _ => {
            let most = (0..found.len())
                .filter(is_meant)
                .max_by_key(|&k| samples(Some(k)));
            let any = most.or((0..found.len()).max_by_key(|&k| samples(Some(k))))?;
            Some((any, None))
        }
    }
}

fn no_samples(file: &Path) -> FileError {
    FileError::new(
        file,
        crate::formats::Place::File,
        "no samples",
        "streams of samples",
        "Record the file again.",
    )
}

/// Finds the units of times by their steps where the log does not say them.
fn find_units(
    time: &mut PerSensor<(String, String)>,
    sources: &PerSensor<Source>,
) -> Result<(), FileError> {
    for sensor in Sensor::ALL {
        let (name, unit) = time.get_mut(sensor);
        if unit.is_empty() {
            *unit = unit_of(sources.get(sensor), name)?;
        }
    }
    Ok(())
}

/// The word for the unit of a column of time, by its steps.
fn unit_of(source: &Source, name: &str) -> Result<String, FileError> {
    let sheet = Sheet::of(source.open()?, FEWEST_ROWS)?;
    let mut columns = Columns::find(&sheet);
    columns.time = sheet.names.iter().position(|known| known == name);
    Ok(time::Clock::find(&sheet, &mut columns).unit)
}

/// One of two streams that are one record.
pub(super) struct Member<'a> {
    pub source: &'a Source<'a>,
    pub found: &'a Found,
    pub triad: [usize; 3],
    /// The column of its time and the word for its unit.
    pub time: (String, String),
}

/// Both triads on one clock, as columns whose names say what they are.
pub(super) fn joined(members: &PerSensor<Member>) -> Result<Sheet, FileError> {
    let part = |sensor: Sensor| {
        let Member {
            source,
            found,
            triad,
            time: (name, unit),
        } = members.get(sensor);
        let word = TimeUnit::WORDS.iter().find(|(word, _)| word == unit);
        let ticks = || {
            unit.parse()
                .ok()
                .map(|tick: f64| TimeUnit::PerSecond(tick.recip()))
        };
        Part {
            source,
            clock: Clock {
                column: Some(name),
                nanoseconds: None,
                unit: word
                    .map(|&(_, unit)| unit)
                    .or_else(ticks)
                    .unwrap_or(TimeUnit::PerSecond(1.0)),
                period: None,
                breaks: Breaks::None,
            },
            columns: triad.map(|column| &*found.stream.columns[column].name),
            further: &[],
        }
    };
    let joined = Joined::read(&PerSensor::from_fn(part), Output::Rate, 1.0)?;
    let mut sheet = Sheet::of(LogRows::new(joined), FEWEST_ROWS)?;
    let of = |sensor: Sensor| ["x", "y", "z"].map(|axis| format!("{}_{axis}", sensor.name()));
    let triads = Sensor::ALL.map(of);
    sheet.names = std::iter::once("time".to_owned())
        .chain(triads.as_flattened().iter().cloned())
        .collect();
    Ok(sheet)
}

/// The names of a stream's columns, with the stream's before them where they do not say what they are.
fn names(found: &Found) -> Vec<String> {
    let bare = || {
        found
            .stream
            .columns
            .iter()
            .map(|column| column.name.clone())
    };
    if bare().any(|name| Name::of(&name).sensor().is_some()) {
        return bare().collect();
    }
    let stream = &found.stream.name;
    let stream = stream.split_once('[').map_or(&**stream, |(name, _)| name);
    bare().map(|name| format!("{stream}.{name}")).collect()
}

/// The streams of a text whose rows tags tell apart; none of another.
fn tagged(file: &Path) -> Result<Vec<(Found, Places)>, FileError> {
    let tags = CsvFile::tags(file)?;
    let of_tag = |tag: String| {
        let source = Source {
            file: file.to_owned(),
            stream: Some(&tag),
            salvage: false,
        };
        let sheet = Sheet::of(source.open()?, 1)?;
        let found = of_rows(tag, &sheet);
        let sheet = Sheet {
            names: names(&found),
            ..sheet
        };
        let Columns {
            mut triads,
            time,
            by_size,
            ..
        } = Columns::find(&sheet);
        // The tag may say what names do not.
        if by_size
            && let Some(sensor) = Name::of(&found.stream.name).sensor()
            && let (Some(triad), None) | (None, Some(triad)) = (triads.gyro, triads.accel)
        {
            triads = PerSensor::default();
            *triads.get_mut(sensor) = Some(triad);
        }
        Ok((found, Places { triads, time }))
    };
    tags.into_iter().map(of_tag).collect()
}

/// Rows of a text as a stream.
pub(super) fn of_rows(name: String, sheet: &Sheet) -> Found {
    let column = |(name, unit): (&String, &String)| {
        let unit = Name::of(name).unit.or_else(|| name::unit(unit));
        Column {
            name: name.clone(),
            unit: unit
                .filter(|unit| unit.times == 1.0)
                .map_or("", |unit| unit.word),
        }
    };
    Found {
        stream: Stream {
            name,
            columns: sheet.names.iter().zip(&sheet.units).map(column).collect(),
            remarks: Vec::new(),
            is_inertial: true,
            axes: None,
        },
        samples: sheet.columns.first().map_or(0, Vec::len) as u64,
    }
}

impl Places {
    pub fn of(found: &Found) -> Self {
        let all: Vec<Name> = names(found).iter().map(|name| Name::of(name)).collect();
        let triads = PerSensor::from_fn(|sensor| {
            let of = |k: &usize| all[*k].sensor() == Some(sensor);
            let candidates: Vec<usize> = (0..all.len()).filter(of).collect();
            by_stem(&all, &candidates).into_iter().next()
        });
        let best = (0..all.len()).rev().max_by_key(|&k| all[k].is_time());
        let named = best.filter(|&k| all[k].is_time() > 1);
        // `t_gyro`, `imu.t`
        let has_word = |column: &Column| {
            let mut words = column.name.split(|c: char| !c.is_alphanumeric());
            words.any(|word| ["t", "ts"].contains(&word))
        };
        Self {
            triads,
            time: named.or_else(|| found.stream.columns.iter().position(has_word)),
        }
    }
}
