//! Two streams with separate clocks, which are combined into rows with one clock.
//!
//! Gyros are unchanged. Accelerometers are integrated over each gyro sample: their integral is known at the edges of
//! their samples and interpolated by a cubic through four of them. The sum over samples is exact, so errors do not
//! accumulate; the remaining error of the integral at an edge is estimated from the data (see [`Course::edge_error`]).

use std::path::Path;

use super::course::{Course, Resampled};
use turncal::imu::{Output, PerSensor};
use turncal::number::rounded;
use turncal_input::FileError;
use turncal_logs::clock::{Breaks, Clock, Stamp, TimeUnit, Uniform};
use turncal_logs::{Source, Table, TableRows};

/// The time column, in s.
pub const TIME: &str = "time";

/// One of the streams, as described in `run.toml`.
pub struct Part<'a> {
    pub source: &'a Source<'a>,
    pub clock: Clock<'a>,
    pub columns: [&'a str; 3],
    /// Columns that are passed on unchanged.
    pub further: &'a [&'a str],
}

/// Column names of both triads, modified so that each is unique.
pub fn distinct(triads: &PerSensor<[&str; 3]>) -> PerSensor<[String; 3]> {
    let bare = |name: &str| name.strip_prefix('-').unwrap_or(name).to_owned();
    let clash = |name: &str| triads.gyro.iter().any(|other| bare(other) == bare(name));
    PerSensor {
        gyro: triads.gyro.map(str::to_owned),
        accel: triads.accel.map(|name| {
            if clash(name) {
                format!("{name} of accelerometers")
            } else {
                name.to_owned()
            }
        }),
    }
}

/// Reads both streams, with stamps `lag` samples after the start of a sample.
pub fn read(parts: &PerSensor<Part>, output: Output, lag: f64) -> Result<TableRows, FileError> {
    let gyro = Track::read(&parts.gyro)?;
    let accel = Track::read(&parts.accel)?;
    let courses = accel.courses();
    let mut resampled = Resampled::new(output);
    courses.iter().for_each(|course| resampled.measure(course));
    let columns = columns_of_both(&gyro, &accel, &courses, &mut resampled, lag);
    if columns.iter().all(Vec::is_empty) {
        return Err(apart(&parts.accel.source.file, &gyro, &accel));
    }
    let seconds = match output {
        Output::Rate => accel.clock.period,
        Output::Increment | Output::Pulse => 1.0,
    };
    let triads = distinct(&PerSensor::from_fn(|sensor| parts.get(sensor).columns));
    let triads = triads.gyro.iter().chain(&triads.accel);
    let triads = triads.map(|name| name.strip_prefix('-').unwrap_or(name));
    let names = std::iter::once(TIME).chain(triads);
    let names = names.chain(parts.gyro.further.iter().copied());
    let mut units = vec!["s".to_owned()];
    units.extend(gyro.units.iter().chain(&accel.units).cloned());
    units.resize(columns.len(), String::new());
    let names = names.map(str::to_owned);
    let mut rows = Table::new(&parts.gyro.source.file, names.zip(columns).collect())?.rows();
    rows.units = units;
    rows.remarks = remarks_of_both(gyro, accel);
    rows.integral_error = resampled.error().map(|error| seconds * error);
    Ok(rows)
}

/// Times, both triads and further columns of the gyros where both streams have samples.
fn columns_of_both(
    gyro: &Track,
    accel: &Track,
    courses: &[Course],
    resampled: &mut Resampled,
    lag: f64,
) -> Vec<Vec<f64>> {
    let mut columns = vec![Vec::new(); 7 + gyro.further.len()];
    // Relative to the first accelerometer stamp, because seconds since 1970 leave no digits for fractions of a sample.
    let ahead = gyro.clock.first - accel.clock.first;
    let place = |number: f64| accel.clock.number(ahead + gyro.clock.time(number)) + lag;
    let mut course = 0;
    for (k, &number) in gyro.clock.numbers.iter().enumerate() {
        let time = gyro.clock.first + gyro.clock.time(number as f64);
        let begin = place(number as f64 - lag);
        let end = place(number as f64 + 1.0 - lag);
        let is_before = |course: &Course| course.end() < begin;
        while courses.get(course).is_some_and(is_before) {
            course += 1;
        }
        let course = courses.get(course);
        // If one of the two lacks a sample, the row is missing.
        let Some(sample) = course.and_then(|course| resampled.sample(course, begin, end)) else {
            continue;
        };
        let of_gyro = gyro.columns.iter().map(|column| column[k]);
        let values = std::iter::once(time).chain(of_gyro).chain(sample);
        let values = values.chain(gyro.further.iter().map(|column| column[k]));
        for (column, value) in columns.iter_mut().zip(values) {
            column.push(value);
        }
    }
    columns
}

/// Streams whose times do not overlap.
fn apart(file: &Path, gyro: &Track, accel: &Track) -> FileError {
    let of = |track: &Track| {
        let last = track.clock.numbers.last().map_or(0.0, |&last| last as f64);
        let (first, period) = (track.clock.first, track.clock.period);
        format!("{first} s to {} s", first + last * period)
    };
    let found = format!("an accelerometer stream from {}", of(accel));
    let expected = format!("times that overlap those of the gyro stream ({})", of(gyro));
    let advice = "Convert both streams to the same clock, or correct time_unit.";
    FileError::of(file, found, expected, advice)
}

/// Remarks of both streams, each once, and a note about two streams.
fn remarks_of_both(gyro: Track, accel: Track) -> Vec<String> {
    let (mut remarks, mut others) = (gyro.remarks, accel.remarks);
    others.retain(|remark| !remarks.contains(remark));
    remarks.extend(others);
    let uneven = accel.clock.uneven();
    remarks.extend(uneven.map(|said| format!("Accelerometers: {said}")));
    remarks.push(format!(
        "Gyros (every {} s) and accelerometers (every {} s) are separate streams, so turncal integrated the \
         accelerometers over the gyro samples. If the two clocks may differ, estimate the offset with --with \
         time-offset.",
        rounded(gyro.clock.period, 7),
        rounded(accel.clock.period, 7)
    ));
    remarks
}

/// The samples of a stream on its own uniform clock.
struct Track {
    clock: Uniform,
    columns: [Vec<f64>; 3],
    further: Vec<Vec<f64>>,
    units: [String; 3],
    remarks: Vec<String>,
}

impl Track {
    fn read(part: &Part) -> Result<Self, FileError> {
        let mut rows = part.source.open()?;
        let mut stamps = part.clock.start(&mut rows)?;
        let mut places = [0; 3];
        for (place, name) in places.iter_mut().zip(part.columns) {
            *place = rows.signed_column(name)?.0;
        }
        let further = part.further.iter().map(|name| rows.column(name));
        let further: Vec<usize> = further.collect::<Result<_, FileError>>()?;
        let mut others = vec![Vec::new(); further.len()];
        let units = places.map(|k| rows.units().get(k).cloned().unwrap_or_default());
        let mut columns = [const { Vec::<f64>::new() }; 3];
        while rows.advance()? && !rows.may_be_cut() {
            if places.iter().any(|&place| rows.is_blank(place)) {
                continue;
            }
            let mut row = [0.0; 3];
            for (value, &place) in row.iter_mut().zip(&places) {
                *value = rows.number(place)?;
            }
            let is_same = |other: usize| columns.each_ref().map(|column| column[other]) == row;
            let Stamp::New(place) = stamps.take(&rows, is_same)? else {
                continue;
            };
            for (column, value) in columns.iter_mut().zip(row) {
                column.insert(place, value);
            }
            for (column, &of) in others.iter_mut().zip(&further) {
                column.insert(place, rows.number(of).unwrap_or(f64::NAN));
            }
        }
        if stamps.of_rows.len() < 2 {
            let found = format!("{} samples", stamps.of_rows.len());
            let advice = "Name another stream, or repeat the recording.";
            return Err(rows.error(found, "at least 2", advice));
        }
        let mut remarks = rows.remarks().to_vec();
        remarks.extend(rows.left_out());
        remarks.extend(rows.cut_off("turncal ignored it"));
        remarks.extend(stamps.notes(rows.file(), 0));
        let clock = Uniform::new(&part.source.file, &stamps.of_rows, part.clock.period)
            .map_err(|error| rows.placed(error))?;
        Ok(Self {
            clock,
            columns,
            further: others,
            units,
            remarks,
        })
    }

    /// Consecutive samples, by number.
    fn courses(&self) -> Vec<Course> {
        let numbers = &self.clock.numbers;
        let mut courses: Vec<Course> = Vec::new();
        for (k, &number) in numbers.iter().enumerate() {
            let follows = k > 0 && number == numbers[k - 1] + 1;
            if !follows {
                courses.push(Course {
                    begin: number as f64,
                    ..Course::default()
                });
            }
            if let Some(course) = courses.last_mut() {
                for (sums, column) in course.sums.iter_mut().zip(&self.columns) {
                    sums.push(column[k]);
                }
            }
        }
        courses
    }
}

/// The clock of the rows of both streams.
pub fn clock(period: Option<f64>) -> Clock<'static> {
    Clock {
        column: Some(TIME),
        nanoseconds: None,
        unit: TimeUnit::PerSecond(1.0),
        period,
        breaks: Breaks::None,
    }
}
