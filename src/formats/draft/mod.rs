//! A draft of `run.toml` for a log that has none: what its names and numbers show, each with the reason, and
//! what only a person knows left open.

mod axes;
mod columns;
mod data_sheet;
mod found;
mod gravity;
mod least_squares;
pub(super) mod motion;
mod name;
mod priors;
mod registers;
mod rests;
mod stated;
mod streams;
mod text;
mod time;
mod turns;
mod two_files;
mod units;

use std::cell::RefCell;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

use nalgebra::Vector3;

use crate::formats::instrument::USUAL_PERIOD;
use crate::formats::source::Source;
use crate::formats::{FileError, Place, Sheet, write_rows};
use crate::imu::{PerSensor, Sensor};
use crate::noise::{Clusters, TriadNoise};
use columns::Columns;
pub use found::{Certainty, Found};
use motion::Motion;
use registers::Registers;
pub use stated::Stated;
use streams::{Streams, Written};
use time::Clock;
use units::Quantities;

/// Fewer rows than a run may have show nothing.
const FEWEST_ROWS: usize = 100;
/// Fewer samples at rest show no noise.
const FEWEST_AT_REST: usize = 64;

/// What a log shows of the instrument and its record.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    /// Of a log of streams, and what they hold.
    streams: Option<Streams>,
    /// The column that tells several instruments apart, with the number of the one that is taken.
    instance: Option<(usize, f64)>,
    columns: Columns,
    clock: Clock,
    quantities: Quantities,
    /// What a register is made to say at zero, a row …
    offset: PerSensor<f64>,
    /// … and what the record shows of it, of counts.
    registers: Option<Registers>,
    /// Why the columns cannot be taken as they are.
    blocked: Vec<String>,
    /// White noise in the file's quantity per second and root of one, where something is at rest.
    random_walk: PerSensor<Option<f64>>,
    /// Output of the gyros at rest above that, the file's quantity a row.
    rest: Option<Vector3<f64>>,
    /// The column of the accelerometers that shows gravity with a minus at first.
    down: Option<usize>,
    /// Sections laid end to end, as far as gravity shows.
    cuts: usize,
    /// The rows that were looked at where the log has more.
    only: Option<usize>,
    /// What its user states.
    stated: Stated,
}

impl Draft {
    /// Looks at a file of rows.
    ///
    /// # Errors
    /// [`FileError`] if it cannot be read or has hardly any rows.
    pub fn of_file(path: &Path) -> Result<Self, FileError> {
        Self::of_stream(path, None, &Stated::default())
    }

    /// The same of one stream of a log of several, and with what is stated of it.
    ///
    /// # Errors
    /// [`FileError`] if it cannot be read or has hardly any rows.
    pub fn of_stream(
        path: &Path,
        stream: Option<&str>,
        stated: &Stated,
    ) -> Result<Self, FileError> {
        let (streams, sheet) = match Streams::of_file(path, stream)? {
            Some((streams, sheet)) => (Some(streams), sheet),
            None => {
                let sheet = Sheet::read(path, FEWEST_ROWS)?;
                match columns::have_rows_of_their_own(&sheet) {
                    true => {
                        let (streams, sheet) = Streams::of_two_files(path, path, None)?;
                        (Some(streams), sheet)
                    }
                    false => (None, sheet),
                }
            }
        };
        Ok(Self::of_sheet(sheet, streams, stated))
    }

    /// Looks at two files of rows, of gyros and of accelerometers; how the latter is to be called in the draft.
    ///
    /// # Errors
    /// [`FileError`] if one cannot be read, has hardly any rows or lacks its triad or its time.
    pub fn of_two_files(gyro: &Path, accel: &Path, accel_name: &str) -> Result<Self, FileError> {
        let (streams, sheet) = Streams::of_two_files(gyro, accel, Some(accel_name))?;
        Ok(Self::of_sheet(sheet, Some(streams), &Stated::default()))
    }

    /// Writes the streams that hold the instrument as rows of text, with this draft for them, into a directory
    /// that is there; a damaged log only if what is whole of it is to be used.
    ///
    /// # Errors
    /// [`FileError`] if the log is text already, is damaged, or cannot be read or written.
    pub fn convert(mut self, log: &Path, directory: &Path, salvage: bool) -> Result<(), FileError> {
        let of_text = |streams: &Streams| streams.written.is_some();
        let streams = self.streams.as_mut().filter(|streams| !of_text(streams));
        let Some(streams) = streams else {
            return Err(FileError::new(
                log,
                Place::File,
                "rows of text",
                "a log of another program",
                "`turncal init` drafts a run.toml for it as it is.",
            ));
        };
        let source = |stream| Source {
            file: log.to_owned(),
            stream: Some(stream),
            salvage,
        };
        rows_as_text(&source(&streams.gyro), &directory.join(GYRO_FILE))?;
        if let Some(accel) = &streams.accel {
            rows_as_text(&source(accel), &directory.join(ACCEL_FILE))?;
        }
        let accel = streams.accel.is_some().then(|| ACCEL_FILE.to_owned());
        streams.written = Some(Written { accel });
        let path = directory.join("run.toml");
        std::fs::write(&path, self.to_toml(GYRO_FILE)).map_err(|error| unwritten(&path, &error))
    }

    fn of_sheet(mut sheet: Sheet, streams: Option<Streams>, stated: &Stated) -> Self {
        sheet.rate = stated.rate_hz.or(sheet.rate);
        let rows = sheet.columns.first().map_or(0, Vec::len);
        let only = sheet.goes_on.then_some(rows);
        let instance = match streams {
            Some(_) => None,
            None => retain_instance(&mut sheet),
        };
        let mut columns = Columns::find(&sheet);
        retain_samples(&mut sheet, &columns);
        let clock = Clock::find(&sheet, &mut columns);
        let (rows, mut triads) = columns.samples(&sheet).unzip();
        let wrapped = triads.as_mut().map(registers::unwrap).unwrap_or_default();
        let whole = triads
            .as_ref()
            .map(|triads| PerSensor::from_fn(|sensor| rests::is_whole(triads.get(sensor))));
        let whole = whole.unwrap_or_default();
        let offset = triads.as_mut().map(units::centre).unwrap_or_default();
        let period = clock.period.unwrap_or(USUAL_PERIOD);
        let breaks = clock.breaks(rows.as_deref().unwrap_or_default(), period, turns::STEP);
        let mut motion = triads
            .as_ref()
            .map(|triads| Motion::find(triads, &breaks, period));
        let mut quantities = Quantities::find(&sheet, &columns, &clock, whole, motion.as_ref());
        let mut blocked = Vec::new();
        let mut registers = None;
        let cuts = motion.as_ref().map_or(0, |motion| motion.cuts);
        let down = triads
            .as_ref()
            .and_then(|triads| points_down(&triads.accel, period));
        let down = down.and_then(|axis| Some(columns.triads.accel?[axis]));
        let is_asked = quantities.has_counts() || cuts > 0;
        if let Some(triads) = triads.as_mut().filter(|_| is_asked) {
            let found = Registers::find(triads, period);
            let is_count = PerSensor::from_fn(|sensor| quantities.is_count(sensor));
            found.apply(triads, &mut columns, &is_count);
            let again = motion.insert(Motion::find(triads, &breaks, period));
            if let Some(axes) = &found.axes {
                // Where gyros carry gravity from rest to rest no sections were laid end to end.
                again.cuts = 0;
                again.angle = again.angle.or(axes.angle());
            }
            quantities = Quantities::find(&sheet, &columns, &clock, whole, Some(again));
            quantities.of_registers(&found, clock.period);
            if quantities.has_counts() {
                blocked = registers::unfit(&columns, &sheet, &wrapped, &found);
                registers = Some(found);
            }
        }
        quantities.state(stated);
        let at_rest = triads.as_ref().zip(motion.as_ref());
        let random_walk = at_rest
            .and_then(|(triads, motion)| white_noise(triads, motion, &quantities, clock.period))
            .unwrap_or_default();
        if let Some(streams) = streams.as_ref().filter(|streams| streams.accel.is_none()) {
            columns.names = streams.columns(Sensor::Gyro);
        }
        Self {
            streams,
            registers,
            blocked,
            rest: motion.as_ref().map(|motion| motion.rest),
            down,
            cuts: motion.as_ref().map_or(0, |motion| motion.cuts),
            instance,
            columns,
            clock,
            quantities,
            offset,
            random_walk,
            only,
            stated: stated.clone(),
        }
    }
}

impl Draft {
    /// The triads that the log has; both where nothing shows any.
    fn present(&self) -> impl Iterator<Item = Sensor> {
        let triads = &self.columns.triads;
        let joined = self
            .streams
            .as_ref()
            .is_some_and(|streams| streams.accel.is_some());
        let none = joined || triads.gyro.is_none() && triads.accel.is_none();
        let is_present = move |sensor: &Sensor| none || triads.get(*sensor).is_some();
        Sensor::ALL.into_iter().filter(is_present)
    }
}

/// Keeps the rows of one of several instruments, and says by which column and number.
fn retain_instance(sheet: &mut Sheet) -> Option<(usize, f64)> {
    let (column, number) = columns::instance(sheet)?;
    sheet.retain(|columns, row| columns[column][row] == number);
    Some((column, number))
}

/// Keeps the rows in which a triad has a value.
fn retain_samples(sheet: &mut Sheet, columns: &Columns) {
    // Rows of another sensor have nothing in them.
    let of_triads: Vec<usize> = [columns.triads.gyro, columns.triads.accel]
        .into_iter()
        .flatten()
        .flatten()
        .collect();
    let Some(time) = columns.time.filter(|_| !of_triads.is_empty()) else {
        return;
    };
    sheet.retain(|columns, row| of_triads.iter().any(|&k| columns[k][row].is_finite()));
    // A row that is there twice is one sample.
    let of_samples: Vec<usize> = of_triads.into_iter().chain([time]).collect();
    sheet.retain(|columns, row| {
        row == 0
            || of_samples
                .iter()
                .any(|&k| columns[k][row] != columns[k][row - 1])
    });
}

/// The axis along which specific force points backwards, and hardly any other way, in the first rows.
fn points_down(accel: &[Vector3<f64>], period: f64) -> Option<usize> {
    let rows = ((motion::WINDOW / period).round() as usize).clamp(1, accel.len().max(1));
    let force = motion::mean(accel.get(..rows)?);
    (0..3).find(|&axis| force[axis] < -0.9 * force.norm())
}

/// White noise of both triads in the longest rest, as `turncal allan` finds it.
fn white_noise(
    triads: &PerSensor<Vec<Vector3<f64>>>,
    motion: &Motion,
    quantities: &Quantities,
    period: Option<f64>,
) -> Option<PerSensor<Option<f64>>> {
    let (period, rest) = (period?, motion.longest_rest.clone());
    let clusters = Clusters::new(rest.len(), period);
    let seconds = period * quantities.per_second(period);
    let of = |sensor: Sensor| {
        let rows = triads.get(sensor)[rest.clone()].iter();
        let increments: Vec<Vector3<f64>> = rows.map(|row| row * seconds).collect();
        let figures = TriadNoise::new(&increments, period, &clusters).figures();
        figures.map(|figures| figures.noise.random_walk)
    };
    (rest.len() >= FEWEST_AT_REST).then(|| PerSensor::from_fn(of))
}

/// Of the gyros, and of accelerometers in the same stream.
const GYRO_FILE: &str = "imu.csv.gz";
const ACCEL_FILE: &str = "accelerometers.csv.gz";

fn unwritten(path: &Path, error: &io::Error) -> FileError {
    FileError::io(
        path,
        "write the file",
        error,
        "Make room or choose another place.",
    )
}

/// Every column of a stream, with all digits.
fn rows_as_text(source: &Source, path: &Path) -> Result<(), FileError> {
    let rows = RefCell::new(source.open()?);
    let stopped = RefCell::new(None);
    let content = |file: &mut dyn Write| -> io::Result<()> {
        let mut rows = rows.borrow_mut();
        let mut csv = csv::Writer::from_writer(file);
        csv.write_record(rows.header())?;
        let columns = rows.header().len();
        loop {
            match rows.advance() {
                Ok(true) => {}
                Ok(false) => break,
                Err(error) => {
                    *stopped.borrow_mut() = Some(error);
                    break;
                }
            }
            let field = |k| match rows.number(k) {
                Ok(_) => rows.shown(k).into_owned(),
                Err(_) => String::new(),
            };
            csv.write_record((0..columns).map(field))?;
        }
        csv.flush()
    };
    let written = File::create(path).and_then(|file| write_rows(path, file, &content));
    written.map_err(|error| unwritten(path, &error))?;
    match stopped.into_inner() {
        Some(error) => Err(error),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
