//! Where rows come from, as `run.toml` says it.

use std::path::{Path, PathBuf};

use super::clock::Clock;
use super::csv_file::CsvFile;
use super::error::FileError;
use super::fields::Fields;
use super::rows::LogRows;
use super::streams::{self, StreamRows};

/// Where rows come from.
#[derive(Debug, Clone)]
pub(super) struct Source<'a> {
    pub file: PathBuf,
    /// Of a file of several streams the one that is meant.
    pub stream: Option<&'a str>,
    /// Whether what is whole of a damaged file is used.
    pub salvage: bool,
}

impl Source<'_> {
    /// A file of which nothing is known.
    pub fn of_file(file: &Path) -> Self {
        Self {
            file: file.to_owned(),
            stream: None,
            salvage: false,
        }
    }

    /// Opens it by its content.
    pub fn open(&self) -> Result<LogRows, FileError> {
        let Some(log) = streams::open(&self.file)? else {
            return CsvFile::open(&self.file, self.stream).map(LogRows::new);
        };
        let rows = StreamRows::open(&self.file, log, self.stream, self.salvage)?;
        Ok(LogRows::new(rows))
    }
}

impl<'a> Source<'a> {
    /// Reads `file`, `stream` and `salvage` of a table; what it does not say is as in the other.
    pub fn of_fields(
        fields: &Fields<'a>,
        directory: &Path,
        other: Option<&Source<'a>>,
    ) -> Result<Self, FileError> {
        let file = match (fields.get("file"), other) {
            (None, Some(other)) => other.file.clone(),
            _ => directory.join(fields.need("file", "a file name")?.text()?),
        };
        let stream = fields.get("stream").map(|field| field.text()).transpose()?;
        let salvage = fields
            .get("salvage")
            .map(|field| field.flag())
            .transpose()?;
        Ok(Self {
            file,
            stream: stream.or(other.and_then(|other| other.stream)),
            salvage: salvage
                .or(other.map(|other| other.salvage))
                .unwrap_or(false),
        })
    }
}

/// Where the accelerometers are, if not in the rows of the gyros, and their clock.
pub(super) fn accel_from<'a>(
    imu: &Fields<'a>,
    directory: &Path,
    gyro: &Source<'a>,
    clock: Clock<'a>,
) -> Result<Option<(Source<'a>, Clock<'a>)>, FileError> {
    let known = [
        "file",
        "stream",
        "salvage",
        "time",
        "time_unit",
        "sample_period_s",
    ];
    let Some(fields) = imu.table("accel_from", &known)? else {
        return Ok(None);
    };
    let source = Source::of_fields(&fields, directory, Some(gyro))?;
    let mut of_accel = Clock::of_fields(&fields, &fields)?;
    if of_accel.column.is_none() {
        (of_accel.column, of_accel.nanoseconds) = (clock.column, clock.nanoseconds);
    }
    if fields.get("time_unit").is_none() {
        of_accel.unit = clock.unit;
    }
    if of_accel.column.is_none() {
        return Err(fields.missing("time", "the column of its time, for two streams need both"));
    }
    Ok(Some((source, of_accel)))
}
