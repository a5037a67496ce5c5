//! A source of rows: a file of text, a stream of a binary log, or columns in memory.

use super::csv_file::CsvFile;
use super::data_file::DataFile;
use super::rows::LogRows;
use super::streams::{self, StreamRows};
use turncal_input::FileError;

/// Source of rows.
#[derive(Debug, Clone)]
pub struct Source<'a> {
    /// The file.
    pub file: DataFile,
    /// The selected stream, if the file has several.
    pub stream: Option<&'a str>,
    /// Whether the intact part of a damaged file is used.
    pub salvage: bool,
}

impl Source<'_> {
    /// A file without further settings.
    pub fn of_file(file: impl Into<DataFile>) -> Self {
        Self {
            file: file.into(),
            stream: None,
            salvage: false,
        }
    }

    /// Opens the source according to its content.
    pub fn open(&self) -> Result<LogRows, FileError> {
        if let Some(table) = self.file.table() {
            return Ok(LogRows::new(table.rows()));
        }
        let Some(log) = streams::open(&self.file)? else {
            return CsvFile::open(&self.file, self.stream).map(LogRows::new);
        };
        let rows = StreamRows::open(&self.file, log, self.stream, self.salvage)?;
        Ok(LogRows::new(rows))
    }
}
