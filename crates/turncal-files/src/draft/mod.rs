//! A draft of `run.toml` for a log that has none: detected fields with reasons, and unknown fields for the user to
//! complete.

mod columns;
mod convert;
mod found;
mod motion;
mod name;
mod priors;
mod rates;
mod raw_samples;
mod stated;
mod streams;
mod text;
mod time;
mod triads;
mod turns;
mod units;

use std::path::Path;

use nalgebra::Vector3;

use crate::{Sheet, unit_scale};
use columns::Columns;
pub use found::Found;
use motion::Motion;
use rates::Rates;
use raw_samples::RawSamples;
pub use stated::{DataSheetError, KalibrImu, Stated, StatedColumns, StatedUnit};
use streams::{FEWEST_ROWS, Streams};
pub use time::Certainty;
use time::Clock;
use turncal::imu::{Output, PerSensor, Sensor};
use turncal::noise::{Clusters, TriadNoise};
use turncal::number::rounded;
use turncal::units::STANDARD_GRAVITY;
use turncal_input::FileError;
use turncal_logs::DataFile;
use units::Quantities;

/// Minimum number of samples at rest for a noise estimate.
const FEWEST_AT_REST: usize = 64;
/// Fraction of gravity that no scale or bias of an accelerometer leaves.
const LITTLE: f64 = 0.3;

const NO_COLUMNS: &str = "not recognised by their names or values";
const AXES_OF_PROGRAM: &str = "axis convention of the program that wrote the log";

/// Information about the instrument and its recording, found in a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    /// Content of the streams, if the log has streams.
    streams: Option<Streams>,
    /// The column that distinguishes several instruments, with the number of the selected one.
    instance: Option<(usize, f64)>,
    columns: Columns,
    clock: Clock,
    quantities: Quantities,
    /// Nominal zero output of a register per row.
    offset: PerSensor<f64>,
    /// Reasons why the columns cannot be used unchanged.
    blocked: Vec<String>,
    /// White noise in the quantity of the file per second, per √Hz, if the log has dwells.
    random_walk: PerSensor<Option<f64>>,
    /// Gyro columns left out, because nothing shows their unit.
    left_out: Option<[usize; 3]>,
    /// Whether each row is the mean of a position.
    of_means: bool,
    /// Motion in the rows, relative to the nominal register zero.
    motion: Option<Motion>,
    /// The accelerometer column with negative gravity at the start.
    down: Option<usize>,
    /// Number of rows examined, if the log has more.
    only: Option<usize>,
    /// Statements of the user.
    stated: Stated,
    /// The first statement that the rows contradict: evidence, statement, remedy.
    contradiction: Option<[String; 3]>,
}

impl Draft {
    /// Examines a file of rows.
    ///
    /// # Errors
    /// Returns [`FileError`] if the file cannot be read or has too few rows.
    pub fn of_file(path: &Path) -> Result<Self, FileError> {
        Self::of_stream(&path.into(), None, &Stated::default())
    }

    /// Examines one stream of a log, using the information that the user gave about it.
    ///
    /// # Errors
    /// Returns [`FileError`] if the file cannot be read or has too few rows.
    pub fn of_stream(
        file: &DataFile,
        stream: Option<&str>,
        stated: &Stated,
    ) -> Result<Self, FileError> {
        if let Some(accel) = &stated.accel_file {
            let whole = accel.canonicalize().unwrap_or_else(|_| accel.to_path_buf());
            return Self::of_two_files(file, accel, &whole.to_string_lossy(), stated);
        }
        let streams = match file.table() {
            Some(table) => {
                stated.columns.check(table)?;
                None
            }
            None => Streams::of_file(file, stream)?,
        };
        if let Some((streams, sheet)) = streams {
            return Ok(Self::of_sheet(sheet, Some(streams), stated));
        }
        let sheet = Sheet::read(file, 1)?;
        if sheet.rows() < FEWEST_ROWS {
            return Self::of_means(file, sheet, stated);
        }
        if columns::have_rows_of_their_own(&sheet) {
            let (streams, sheet) = Streams::of_two_files(file, file, None)?;
            return Ok(Self::of_sheet(sheet, Some(streams), stated));
        }
        Ok(Self::of_sheet(sheet, None, stated))
    }

    /// Examines a short table, whose rows are the means of positions.
    fn of_means(file: &DataFile, sheet: Sheet, stated: &Stated) -> Result<Self, FileError> {
        let found = format!("only {} rows", sheet.rows());
        // A row lasts a second: what it is the mean of is not known.
        let rate_hz = stated.rate_hz.or(Some(1.0));
        let stated = Stated {
            rate_hz,
            ..stated.clone()
        };
        let mut draft = Self::of_sheet(sheet, None, &stated);
        if draft.is_of_magnetometer() {
            return Ok(draft);
        }
        let columns = &draft.columns;
        let PerSensor { gyro, accel } = columns.triads;
        if accel.is_none() || gyro.is_some() || columns.time.is_some() {
            let expected =
                format!("at least {FEWEST_ROWS}, or the mean values of several positions");
            let advice = "Record a run with dwells and turns, or give a table of accelerometer means with one row per \
                          position.";
            return Err(FileError::of(file, found, expected, advice));
        }
        draft.of_means = true;
        Ok(draft)
    }

    /// Whether the gravity direction never changes, as in a log of one position.
    pub fn is_of_one_position(&self) -> bool {
        let stays = |motion: &Motion| !motion.is_turned && motion.cuts.is_empty();
        self.motion.as_ref().is_some_and(stays)
    }

    /// Adopts the units of another log of the same sensor.
    ///
    /// # Errors
    /// Returns [`FileError`] if the columns differ from those of the other log.
    pub fn as_in(&mut self, file: &Path, other: &Self) -> Result<(), FileError> {
        let names = |of: &Self| of.columns.names.join(", ");
        if self.columns.names != other.columns.names {
            let advice = "Give the logs of one sensor, or add --lot for several sensors.";
            return Err(FileError::of(
                file,
                format!("the columns {}", names(self)),
                names(other),
                advice,
            ));
        }
        self.quantities = other.quantities.clone();
        self.offset = other.offset;
        self.leave_out_gyros();
        Ok(())
    }

    /// Leaves out the gyros if their unit cannot be determined; the accelerometers are then calibrated with gravity
    /// alone.
    pub fn leave_out_gyros(&mut self) {
        let knows = |sensor| self.quantities.units.get(sensor).word.is_some();
        if !knows(Sensor::Gyro) && knows(Sensor::Accel) && self.columns.triads.accel.is_some() {
            self.left_out = self.columns.triads.gyro.take();
        }
    }

    /// Examines two files of rows, one of gyros and one of accelerometers. `accel_name` is the name of the second file
    /// in the draft.
    ///
    /// # Errors
    /// Returns [`FileError`] if a file cannot be read, has too few rows, or lacks its triad or a time.
    pub fn of_two_files(
        gyro: &DataFile,
        accel: &DataFile,
        accel_name: &str,
        stated: &Stated,
    ) -> Result<Self, FileError> {
        let (streams, sheet) = Streams::of_two_files(gyro, accel, Some(accel_name))?;
        Ok(Self::of_sheet(sheet, Some(streams), stated))
    }

    fn of_sheet(mut sheet: Sheet, streams: Option<Streams>, stated: &Stated) -> Self {
        let written = sheet.rate;
        sheet.rate = stated.rate_hz.or(written);
        let only = sheet.goes_on.then(|| sheet.rows());
        let instance = match streams {
            Some(_) => None,
            None => retain_instance(&mut sheet),
        };
        let mut columns = columns_of(&mut sheet);
        columns.state(&stated.columns);
        retain_samples(&mut sheet, &columns);
        let clock = Clock::find(&sheet, &mut columns);
        let rates = Rates {
            sheet: &sheet,
            columns: &columns,
            stated,
            written,
        };
        let first = rates.rows(&clock);
        let has_times = streams.as_ref().is_some_and(|of| of.time.is_some());
        let (clock, contradiction) = if has_times {
            (clock, None)
        } else {
            rates.agreed(clock, first.as_ref())
        };
        let contradiction = contradiction.or_else(|| no_time(&sheet, &columns, &clock));
        let is_same = |rows: &RawSamples| rows.period == rates::period(&clock);
        let rows = first.filter(is_same).or_else(|| rates.rows(&clock));
        let down = rows.as_ref().and_then(RawSamples::points_down);
        let mut draft = Self {
            down: down.and_then(|axis| Some(columns.triads.accel?[axis])),
            quantities: Quantities::unknown(),
            streams,
            instance,
            columns,
            clock,
            offset: PerSensor::default(),
            blocked: Vec::new(),
            random_walk: PerSensor::default(),
            left_out: None,
            of_means: false,
            motion: None,
            only,
            contradiction,
            stated: stated.clone(),
        };
        match rows {
            Some(rows) => draft.take_rows(&rows, &sheet),
            None => draft.quantities.state(stated),
        }
        draft.ignore_row_numbers();
        draft.take_streams();
        draft
    }

    /// Detects units and noise.
    fn take_rows(&mut self, rows: &RawSamples, sheet: &Sheet) {
        let motion = rows.motion().clone();
        self.quantities = Quantities::find(sheet, &self.columns, &self.clock, rows.whole, &motion);
        if self.quantities.has_counts() {
            self.blocked = rows.unfit();
        }
        let period = self.clock.period.unwrap_or(f64::NAN);
        let of_units = || self.quantities.contradiction(&self.stated, &motion, period);
        let exchanged = || self.are_exchanged(rows, sheet).then(|| self.exchanged());
        let contradiction = self.contradiction.clone().or_else(of_units);
        let contradiction = contradiction.or_else(exchanged);
        self.contradiction = contradiction.or_else(|| self.without_gravity(&motion));
        self.quantities.state(&self.stated);
        self.random_walk = self.noise_at_rest(rows, &motion).unwrap_or_default();
        self.offset = rows.offset;
        let is_joined = motion.stands && !motion.cuts.is_empty();
        self.motion = Some(motion);
        if is_joined {
            self.leave_out_gyros();
        }
    }

    /// Whether the triads are swapped: gravity is in the columns named as gyros, its rotation in those named as
    /// accelerometers.
    fn are_exchanged(&self, rows: &RawSamples, sheet: &Sheet) -> bool {
        let shown = |of: &Quantities| of.units.get(Sensor::Accel).is_shown;
        let both = |of: &Quantities| {
            Sensor::ALL
                .iter()
                .all(|&sensor| of.units.get(sensor).is_shown)
        };
        !shown(&self.quantities) && {
            let motion = rows.exchanged();
            let (columns, clock) = (&self.columns, &self.clock);
            both(&Quantities::find(
                sheet, columns, clock, rows.whole, &motion,
            ))
        }
    }

    /// Evidence, statement and remedy if the accelerometers do not measure gravity in the unit that the file states.
    fn without_gravity(&self, motion: &Motion) -> Option<[String; 3]> {
        let unit = &self.quantities.units.accel;
        let is_rate = self.quantities.output == Output::Rate;
        let word = unit.word.filter(|_| is_rate && !unit.is_shown)?;
        let at_rest = motion.gravity / unit_scale(Sensor::Accel, word)?;
        (at_rest < LITTLE * STANDARD_GRAVITY).then(|| {
            [
                format!(
                    "{} m/s² at rest in the columns of the accelerometers",
                    rounded(at_rest, 3)
                ),
                "gravity".to_owned(),
                "Log the acceleration including gravity, not the linear or user acceleration."
                    .to_owned(),
            ]
        })
    }

    fn exchanged(&self) -> [String; 3] {
        let names = PerSensor::from_fn(|sensor| {
            let names = self.columns.triads.get(sensor).iter().flatten();
            let names = names.map(|column| self.columns.names[*column].as_str());
            names.collect::<Vec<_>>().join(" ")
        });
        [
            format!(
                "gravity in the columns {} and turns in the columns {}",
                names.gyro, names.accel
            ),
            "rates and accelerations, according to the column names".to_owned(),
            "Exchange the two triads in the header of the log, or in columns of run.toml."
                .to_owned(),
        ]
    }

    /// White noise of both triads in the longest dwell, as from `turncal allan`.
    fn noise_at_rest(&self, rows: &RawSamples, motion: &Motion) -> Option<PerSensor<Option<f64>>> {
        let (period, rest) = (self.clock.period?, motion.longest_rest.clone());
        let clusters = Clusters::new(rest.len(), period);
        let seconds = period * self.quantities.per_second(period);
        let of = |sensor: Sensor| {
            let rows = rows.triads.get(sensor)[rest.clone()].iter();
            let increments: Vec<Vector3<f64>> = rows.map(|row| row * seconds).collect();
            let figures = TriadNoise::new(&increments, period, &clusters).figures();
            figures.map(|figures| figures.noise.random_walk)
        };
        (rest.len() >= FEWEST_AT_REST).then(|| PerSensor::from_fn(of))
    }

    /// Whether the log has this triad; both if none was identified.
    fn is_present(&self, sensor: Sensor) -> bool {
        let triads = &self.columns.triads;
        let none = triads.gyro.is_none() && triads.accel.is_none();
        none && !self.is_of_magnetometer() || triads.get(sensor).is_some()
    }

    /// Takes names and the unit of time from streams.
    fn take_streams(&mut self) {
        if let Some(streams) = &self.streams {
            self.columns.names.clone_from(&streams.names);
            if let Some(time) = &streams.time {
                self.clock.unit.clone_from(&time.gyro.1);
                "stated in the file".clone_into(&mut self.clock.why);
                self.clock.certainty = Certainty::Certain;
            }
        }
    }

    /// Drops a time that counts rows: a magnetometer alone needs no times.
    fn ignore_row_numbers(&mut self) {
        let clock = &self.clock;
        if clock.unit == "count" && clock.period.is_none() && self.is_of_magnetometer() {
            self.columns.time = None;
            "s".clone_into(&mut self.clock.unit);
        }
    }

    /// Whether the log has a magnetometer, but neither gyros nor accelerometers.
    fn is_of_magnetometer(&self) -> bool {
        let PerSensor { gyro, accel } = self.columns.triads;
        self.columns.magnetometer.is_some() && gyro.is_none() && accel.is_none()
    }
}

/// Angle in rad for one gyro unit in one row, determined from the rotation of gravity; negative if the triads have
/// opposite signs.
pub fn turned_angle(triads: PerSensor<Vec<Vector3<f64>>>, period: f64) -> Option<f64> {
    RawSamples::new(triads, Vec::new(), period).motion().angle
}

/// Evidence, statement and remedy if the only time never changes or falls.
fn no_time(sheet: &Sheet, columns: &Columns, clock: &Clock) -> Option<[String; 3]> {
    if let Some(name) = columns::falling_time(sheet).filter(|_| columns.time.is_none()) {
        return Some([
            format!("times in the column `{name}` that decrease from row to row"),
            "times that increase".to_owned(),
            "The newest row is first: reverse the rows below the names.".to_owned(),
        ]);
    }
    let (name, value) = columns::standing_time(sheet).filter(|_| clock.period.is_none())?;
    Some([
        format!("{value} in all rows of the column `{name}`"),
        "times that increase".to_owned(),
        "Log the time of each row, or give the sample rate with --rate.".to_owned(),
    ])
}

/// The columns of a log. Rows that repeat the row above are dropped if they hide the time, as erased memory does.
fn columns_of(sheet: &mut Sheet) -> Columns {
    let columns = Columns::find(sheet);
    if columns.time.is_some() {
        return columns;
    }
    let mut new = sheet.clone();
    new.retain(|of, row| {
        let is_new = |of: &Vec<f64>| of[row] != of[row - 1];
        row == 0 || of.columns.iter().any(is_new)
    });
    let of_new = Columns::find(&new);
    if of_new.time.is_none() {
        return columns;
    }
    *sheet = new;
    of_new
}

/// Keeps the rows of one of several instruments; returns the column and the number that identify it.
fn retain_instance(sheet: &mut Sheet) -> Option<(usize, f64)> {
    let (column, number) = columns::instance(sheet)?;
    sheet.retain(|of, row| of.columns[column][row] == number);
    Some((column, number))
}

/// Keeps the rows in which a triad has a value.
fn retain_samples(sheet: &mut Sheet, columns: &Columns) {
    // Rows of another sensor have no values in these columns.
    let triads = [columns.triads.gyro, columns.triads.accel];
    let of_triads: Vec<usize> = triads.into_iter().flatten().flatten().collect();
    let Some(time) = columns.time.filter(|_| !of_triads.is_empty()) else {
        return;
    };
    sheet.retain(|of, row| of.has(&of_triads, row));
    // A repeated row is one sample.
    let of_samples = [&of_triads[..], &[time]].concat();
    sheet.retain(|of, row| {
        let is_new = |&k: &usize| of.columns[k][row] != of.columns[k][row - 1];
        row == 0 || of_samples.iter().any(is_new)
    });
}

#[cfg(test)]
mod tests;
