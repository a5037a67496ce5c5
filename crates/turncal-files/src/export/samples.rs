//! Calibrated samples as a CSV file.

use std::io::{self, Write};
use std::ops::Range;
use std::path::Path;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::{write_rows, write_whole_with};
use turncal::calibration::result::MagRecord;
use turncal::calibration::{Correction, Word};
use turncal::recording::{Magnetometer, nanoseconds};
use turncal::run::Run;
use turncal_input::FileError;

/// Start and end of a sample, and angular rate and specific force along the right, front and up axes.
pub const HEADER: &str = "start_s,end_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,\
                          accel_y_m_s2,accel_z_m_s2";

/// Columns of the magnetic field; they are empty in rows without a value.
const IN_TESLA: &str = ",mag_x_t,mag_y_t,mag_z_t";
const RELATIVE: &str = ",mag_x,mag_y,mag_z";

/// Usual length of a row, bytes.
const ROW_LENGTH: usize = 176;
/// Rows that one task turns into text.
const ROWS: usize = 4096;
/// Number of tasks whose text is written at once.
const TASKS: usize = 64;

/// The samples of a run that are to be written.
#[derive(Debug, Clone, Copy)]
pub struct Samples<'a> {
    /// The run that contains the samples.
    pub run: &'a Run,
    /// Correction.
    pub correction: &'a Correction,
    /// Whether missing samples are interpolated and also written, with 1 in a column `filled`.
    pub fill: bool,
    /// The calibration of the magnetometer, if the run has one in the same unit.
    pub magnetometer: Option<&'a MagRecord>,
    /// Verdict of the calibration, used as the name of the last column.
    pub verdict: Option<Word>,
}

/// The field of a magnetometer alone.
#[derive(Debug, Clone, Copy)]
pub struct FieldSamples<'a> {
    /// Calibration of the magnetometer.
    pub mag: &'a MagRecord,
    /// Its values.
    pub log: &'a Magnetometer,
    /// Verdict of the calibration, used as the name of the last column.
    pub verdict: Option<Word>,
}

impl FieldSamples<'_> {
    /// Writes one row per value, with its time or, if the log has no times, its number from one.
    pub fn rows(&self, file: &mut dyn Write) -> io::Result<()> {
        let columns = in_unit(&self.mag.field.unit);
        let verdict = self.verdict.map(|word| format!(",{}", word.column()));
        let one = if verdict.is_some() { ",1" } else { "" };
        let first = if self.log.has_times { "time_s" } else { "row" };
        writeln!(file, "{first}{columns}{}", verdict.unwrap_or_default())?;
        for (row, (time, field)) in (1..).zip(self.mag.corrected(self.log)) {
            let time = if self.log.has_times {
                nanoseconds(time)
            } else {
                f64::from(row)
            };
            writeln!(file, "{time},{},{},{}{one}", field.x, field.y, field.z)?;
        }
        Ok(())
    }

    /// Writes the rows into a complete file, as [`Samples::write`].
    pub fn write(&self, path: &Path, force: bool) -> Result<(), FileError> {
        write_whole_with(path, force, |file| {
            write_rows(path, file, |rows| self.rows(rows))
        })
    }
}

/// Columns of the field in this unit.
fn in_unit(unit: &str) -> &'static str {
    if unit == "T" { IN_TESLA } else { RELATIVE }
}

impl Samples<'_> {
    /// Writes one row per log row, with [`HEADER`] first; for a temperature-dependent calibration, `in_range` states
    /// whether the calibration is valid at the temperature of the row. Each row contains the means over its sample, so
    /// the output can itself be read as a log with `output = "rate"` in `rad/s` and `m/s^2`. Numbers are written with
    /// the fewest digits that reproduce the same value when read.
    pub fn rows(&self, file: &mut dyn Write) -> io::Result<()> {
        let optional = |is_there: bool, column| if is_there { column } else { "" };
        let in_range = optional(self.correction.changes(), ",in_range");
        let filled = optional(self.fill, ",filled");
        let verdict = self.verdict.map(|word| format!(",{}", word.column()));
        let verdict = verdict.unwrap_or_default();
        let field = self.magnetometer.map_or("", |of| in_unit(&of.field.unit));
        writeln!(file, "{HEADER}{field}{in_range}{filled}{verdict}")?;
        let imu = &self.run.recording.imu;
        let field = self.field();
        let (samples, lost) = (imu.len(), imu.lost());
        let parts = (0..samples).step_by(ROWS);
        let parts: Vec<_> = parts
            .map(|first| first..samples.min(first + ROWS))
            .collect();
        for parts in parts.chunks(TASKS) {
            let text = |part: &Range<usize>| self.part(part.clone(), &lost, &field);
            for text in parts.par_iter().map(text).collect::<Vec<_>>() {
                file.write_all(&text)?;
            }
        }
        Ok(())
    }

    /// Writes the rows into a complete file, compressed if its name ends in `.gz`; an existing file is replaced only
    /// with `force`.
    pub fn write(&self, path: &Path, force: bool) -> Result<(), FileError> {
        write_whole_with(path, force, |file| {
            write_rows(path, file, |rows| self.rows(rows))
        })
    }

    /// Corrected means of the magnetometer, each with the sample that contains the middle of its span.
    fn field(&self) -> Vec<(usize, Vector3<f64>)> {
        let recording = &self.run.recording;
        let both = self.magnetometer.zip(recording.magnetometer.as_ref());
        let values = both.into_iter().flat_map(|(of, log)| of.corrected(log));
        let place = |time| recording.imu.edge(time).max(0.0) as usize;
        values.map(|(time, value)| (place(time), value)).collect()
    }

    /// The rows of some samples.
    fn part(
        &self,
        samples: Range<usize>,
        lost: &[Range<usize>],
        field: &[(usize, Vector3<f64>)],
    ) -> Vec<u8> {
        let (correction, fill) = (self.correction, self.fill);
        let mut text = Vec::with_capacity(samples.len() * ROW_LENGTH);
        let mut number = zmij::Buffer::new();
        let lost = &lost[lost.partition_point(|lost| lost.end <= samples.start)..];
        let mut lost = lost.iter().peekable();
        let mut field = field[field.partition_point(|of| of.0 < samples.start)..]
            .iter()
            .peekable();
        for (k, sample) in samples.clone().zip(correction.samples(self.run, samples)) {
            while lost.next_if(|lost| lost.end <= k).is_some() {}
            let is_lost = lost.peek().is_some_and(|lost| lost.contains(&k));
            if is_lost && !fill {
                continue;
            }
            let times = [nanoseconds(sample.start), nanoseconds(sample.end)];
            for &value in times.iter().chain(&sample.rate).chain(&sample.force) {
                text.extend_from_slice(number.format(value).as_bytes());
                text.push(b',');
            }
            text.pop();
            while field.next_if(|of| of.0 < k).is_some() {}
            let (mut sum, mut count) = (Vector3::zeros(), 0.0);
            while let Some((_, value)) = field.next_if(|of| of.0 == k) {
                (sum, count) = (sum + value, count + 1.0);
            }
            for axis in (0..3).filter(|_| self.magnetometer.is_some()) {
                text.push(b',');
                if count > 0.0 {
                    text.extend_from_slice(number.format(sum[axis] / count).as_bytes());
                }
            }
            if correction.changes() {
                text.extend([b',', b'0' + u8::from(sample.in_range)]);
            }
            if fill {
                text.extend([b',', b'0' + u8::from(is_lost)]);
            }
            if self.verdict.is_some() {
                text.extend(b",1");
            }
            text.push(b'\n');
        }
        text
    }
}
