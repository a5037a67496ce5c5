//! Calibrated samples as a CSV file.

use std::io::{self, Write};
use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use crate::{write_rows, write_whole_with};
use turncal::calibration::Correction;
use turncal::recording::nanoseconds;
use turncal::run::Run;
use turncal_input::FileError;

/// Start and end of a sample, angular rate and specific force along right, front and up.
pub const HEADER: &str = "start_s,end_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,\
                          accel_y_m_s2,accel_z_m_s2";

/// Usual length of a row, bytes.
const ROW_LENGTH: usize = 176;
/// Rows that one task turns into text.
const ROWS: usize = 4096;
/// Tasks before their text is written.
const TASKS: usize = 64;

/// Writes one row per log row, with [`HEADER`] first; for a temperature-dependent calibration, `in_range` states
/// whether it is valid at the temperature of the row. A row contains means over its sample, so the output is a log with
/// `output = "rate"` in `rad/s` and `m/s^2`.
///
/// Numbers are the shortest that read as the same value. With `fill`, missing samples are also written, interpolated,
/// with 1 in a last column `filled`.
pub fn sample_rows(
    file: &mut dyn Write,
    correction: &Correction,
    run: &Run,
    fill: bool,
) -> io::Result<()> {
    let optional = |is_there: bool, column| if is_there { column } else { "" };
    let in_range = optional(correction.changes(), ",in_range");
    let filled = optional(fill, ",filled");
    writeln!(file, "{HEADER}{in_range}{filled}")?;
    let (samples, lost) = (run.recording.imu.len(), run.recording.imu.lost());
    let parts = (0..samples).step_by(ROWS);
    let parts: Vec<_> = parts
        .map(|first| first..samples.min(first + ROWS))
        .collect();
    for parts in parts.chunks(TASKS) {
        let text = |part: &Range<usize>| rows(correction, run, part.clone(), &lost, fill);
        for text in parts.par_iter().map(text).collect::<Vec<_>>() {
            file.write_all(&text)?;
        }
    }
    Ok(())
}

/// The rows of some samples.
fn rows(
    correction: &Correction,
    run: &Run,
    samples: Range<usize>,
    lost: &[Range<usize>],
    fill: bool,
) -> Vec<u8> {
    let mut text = Vec::with_capacity(samples.len() * ROW_LENGTH);
    let mut number = zmij::Buffer::new();
    let lost = &lost[lost.partition_point(|lost| lost.end <= samples.start)..];
    let mut lost = lost.iter().peekable();
    for (k, sample) in samples.clone().zip(correction.samples(run, samples)) {
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
        if correction.changes() {
            text.extend([b',', b'0' + u8::from(sample.in_range)]);
        }
        if fill {
            text.extend([b',', b'0' + u8::from(is_lost)]);
        }
        text.push(b'\n');
    }
    text
}

/// The same into a complete file, compressed if its name ends in `.gz`; an existing file is replaced only with `force`.
pub fn write_samples(
    path: &Path,
    correction: &Correction,
    run: &Run,
    fill: bool,
    force: bool,
) -> Result<(), FileError> {
    write_whole_with(path, force, |file| {
        write_rows(path, file, |rows| sample_rows(rows, correction, run, fill))
    })
}
