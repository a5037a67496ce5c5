//! Calibrated samples as a CSV file.

use std::io::{self, Write};
use std::path::Path;

use crate::calibration::Correction;
use crate::formats::{FileError, write_rows, write_whole_with};
use crate::recording::nanoseconds;
use crate::run::Run;

/// Start and end of a sample, angular rate and specific force along right, front and up.
pub const HEADER: &str = "start_s,end_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,\
                          accel_y_m_s2,accel_z_m_s2";

/// Writes one row per log row, with [`HEADER`] first; for a temperature-dependent calibration, `in_range` states
/// whether it is valid at the temperature of the row. A row contains means over its sample, so the output is a log with
/// `output = "rate"` in `rad/s` and `m/s^2`.
///
/// With `fill`, missing samples are also written, interpolated, with 1 in a last column `filled`.
pub fn sample_rows(
    file: &mut dyn Write,
    correction: &Correction,
    run: &Run,
    fill: bool,
) -> io::Result<()> {
    let changes = correction.changes();
    let in_range = if changes { ",in_range" } else { "" };
    let filled = if fill { ",filled" } else { "" };
    writeln!(file, "{HEADER}{in_range}{filled}")?;
    let mut lost = run.recording.imu.lost().into_iter().peekable();
    for (k, sample) in correction.samples(run).enumerate() {
        while lost.next_if(|lost| lost.end <= k).is_some() {}
        let is_lost = lost.peek().is_some_and(|lost| lost.contains(&k));
        if is_lost && !fill {
            continue;
        }
        let [start, end] = [sample.start, sample.end].map(nanoseconds);
        write!(file, "{start},{end}")?;
        for value in sample.rate.iter().chain(&sample.force) {
            write!(file, ",{value:e}")?;
        }
        if changes {
            write!(file, ",{}", u8::from(sample.in_range))?;
        }
        if fill {
            write!(file, ",{}", u8::from(is_lost))?;
        }
        writeln!(file)?;
    }
    Ok(())
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
