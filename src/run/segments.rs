//! Labelled sections of a record.

use std::path::Path;

use super::csv_file::CsvFile;
use super::error::RunError;
use super::{ImuRecord, Segment};

/// Reads the sections of a run with these samples.
pub(super) fn read(file: &Path, imu: &ImuRecord) -> Result<Vec<Segment>, RunError> {
    let mut csv = CsvFile::open(file)?;
    let start_column = csv.column("start")?;
    let end_column = csv.column("end")?;
    let label_column = csv.column("label")?;
    let record = (imu.start, imu.time(imu.len()));
    // Stamps may name either end of a sample, so borders can be out by one, and are rounded.
    let slack = 1.5 * imu.period;
    let mut segments = Vec::new();
    while csv.advance()? {
        let start = csv.number(start_column)?;
        let end = csv.number(end_column)?;
        if end <= start {
            return Err(csv.error_here(
                format_args!("a segment from {start} s to {end} s"),
                "an end after the start",
                "Correct the row.",
            ));
        }
        if start < record.0 - slack || end > record.1 + slack {
            return Err(csv.error_here(
                format_args!("a segment from {start} s to {end} s"),
                format_args!(
                    "times inside the IMU record, {} s to {} s",
                    record.0, record.1
                ),
                "Correct the row.",
            ));
        }
        segments.push(Segment {
            start,
            end,
            label: csv.text(label_column)?.to_owned(),
        });
    }
    Ok(segments)
}
