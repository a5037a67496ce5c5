//! LogRows of numbers, whatever a file holds them in.

use std::path::Path;

use super::csv_file::CsvFile;
use super::error::{FileError, Place};
use super::joined::Joined;
use super::names::Names;
use super::streams::StreamRows;
use crate::recording::FileColumn;

/// A file at one of its rows.
pub(super) struct LogRows {
    kind: Kind,
    /// Of what is no text; a text knows its own.
    names: Names,
}

enum Kind {
    Text(Box<CsvFile>),
    Stream(StreamRows),
    Joined(Joined),
}

impl LogRows {
    pub fn text(csv: CsvFile) -> Self {
        Self {
            kind: Kind::Text(Box::new(csv)),
            names: Names::default(),
        }
    }

    pub fn stream(rows: StreamRows) -> Self {
        Self {
            names: Names::new(rows.header()),
            kind: Kind::Stream(rows),
        }
    }

    pub fn joined(rows: Joined) -> Self {
        Self {
            names: Names::new(rows.header()),
            kind: Kind::Joined(rows),
        }
    }

    /// The names of the columns.
    pub fn header(&self) -> &[String] {
        match &self.kind {
            Kind::Text(csv) => csv.header(),
            Kind::Stream(_) | Kind::Joined(_) => self.names.all(),
        }
    }

    /// What the file says of the rate of rows, Hz.
    pub fn rate(&self) -> Option<f64> {
        match &self.kind {
            Kind::Text(csv) => csv.rate(),
            Kind::Stream(_) | Kind::Joined(_) => None,
        }
    }

    /// Of the columns, if the file says them.
    pub fn units(&self) -> Option<&[String]> {
        match &self.kind {
            Kind::Text(csv) => csv.units(),
            Kind::Stream(rows) => Some(rows.units()),
            Kind::Joined(rows) => Some(rows.units()),
        }
    }

    /// What was done to the values, a sentence each.
    pub fn remarks(&self) -> &[String] {
        match &self.kind {
            Kind::Text(csv) => csv.remarks(),
            Kind::Stream(rows) => rows.remarks(),
            Kind::Joined(rows) => rows.remarks(),
        }
    }

    /// Error of the integrals of the accelerometers' columns over any rows, in the columns' unit times s: what
    /// putting two streams on one grid left.
    pub fn integral_error(&self) -> [f64; 3] {
        match &self.kind {
            Kind::Joined(rows) => rows.integral_error(),
            Kind::Text(_) | Kind::Stream(_) => [0.0; 3],
        }
    }

    /// Takes less memory for granted: rows are packed as they come.
    pub fn pack(&mut self) {
        if let Kind::Text(csv) = &mut self.kind {
            csv.pack();
        }
    }

    /// The index of a named column, which nothing else may be.
    pub fn column(&mut self, name: &str) -> Result<usize, FileError> {
        if let Kind::Text(csv) = &mut self.kind {
            return csv.column(name);
        }
        let found = self.names.find(name);
        found.map_err(|wrong| {
            FileError::new(
                self.file(),
                Place::File,
                wrong.found,
                wrong.expected,
                wrong.advice,
            )
        })
    }

    /// The same of a name that a minus may precede, which turns the sign of the column's values.
    pub fn signed_column(&mut self, name: &str) -> Result<(usize, FileColumn), FileError> {
        let literal = self.header().iter().any(|known| known == name);
        let bare = name.strip_prefix('-').filter(|_| !literal);
        let column = FileColumn {
            name: bare.unwrap_or(name).to_owned(),
            reversed: bare.is_some(),
        };
        Ok((self.column(&column.name)?, column))
    }

    /// Goes to the next row; false at the end.
    pub fn advance(&mut self) -> Result<bool, FileError> {
        match &mut self.kind {
            Kind::Text(csv) => csv.advance(),
            Kind::Stream(rows) => rows.advance(),
            Kind::Joined(rows) => Ok(rows.advance()),
        }
    }

    /// Whether the row is the last and no line end shows that its last number is whole.
    pub fn may_be_cut(&self) -> bool {
        matches!(&self.kind, Kind::Text(csv) if csv.may_be_cut())
    }

    /// What the end of the file leaves open, in a sentence, with what was done about its last row.
    pub fn cut_off(&self, done: &str) -> Option<String> {
        match &self.kind {
            Kind::Text(csv) => csv.cut_off(done),
            Kind::Stream(rows) => rows.cut_off(),
            Kind::Joined(_) => None,
        }
    }

    /// Line of a text, sample of another file.
    pub fn line(&self) -> u64 {
        match &self.kind {
            Kind::Text(csv) => csv.line(),
            Kind::Stream(rows) => rows.sample(),
            Kind::Joined(rows) => rows.sample(),
        }
    }

    /// The finite number in a column of the row.
    pub fn number(&self, column: usize) -> Result<f64, FileError> {
        let value = match &self.kind {
            Kind::Text(csv) => return csv.number(column),
            Kind::Stream(rows) => rows.value(column),
            Kind::Joined(rows) => rows.value(column),
        };
        match value.is_finite() {
            true => Ok(value),
            false => Err(self.not(column, "a finite number")),
        }
    }

    /// Whether nothing stands in a column of the row.
    pub fn is_blank(&self, column: usize) -> bool {
        match &self.kind {
            Kind::Text(csv) => csv.is_blank(column),
            Kind::Stream(rows) => rows.value(column).is_nan(),
            Kind::Joined(_) => false,
        }
    }

    /// The error of a row's value that is not what it should be.
    pub fn not(&self, column: usize, expected: &str) -> FileError {
        let (value, place) = match &self.kind {
            Kind::Text(csv) => return csv.not(column, expected),
            Kind::Stream(rows) => (rows.value(column), rows.place(Some(column))),
            Kind::Joined(rows) => (rows.value(column), Place::Line(rows.sample())),
        };
        let advice = "Correct the value or record the file again.";
        FileError::new(self.file(), place, value, expected, advice)
    }

    /// An error of the whole file.
    pub fn error(
        &self,
        found: impl std::fmt::Display,
        expected: impl std::fmt::Display,
        advice: impl std::fmt::Display,
    ) -> FileError {
        match &self.kind {
            Kind::Text(csv) => csv.error(found, expected, advice),
            _ => FileError::new(self.file(), Place::File, found, expected, advice),
        }
    }

    /// An error of the row.
    pub fn error_here(
        &self,
        found: impl std::fmt::Display,
        expected: impl std::fmt::Display,
        advice: impl std::fmt::Display,
    ) -> FileError {
        let place = match &self.kind {
            Kind::Text(csv) => return csv.error_here(found, expected, advice),
            Kind::Stream(rows) => rows.place(None),
            Kind::Joined(rows) => Place::Line(rows.sample()),
        };
        FileError::new(self.file(), place, found, expected, advice)
    }

    /// An error of a row that names its line, with what its number counts in this file.
    pub fn placed(&self, error: FileError) -> FileError {
        match &self.kind {
            Kind::Stream(rows) => rows.placed(error),
            Kind::Text(_) | Kind::Joined(_) => error,
        }
    }

    pub fn file(&self) -> &Path {
        match &self.kind {
            Kind::Text(csv) => csv.path(),
            Kind::Stream(rows) => rows.file(),
            Kind::Joined(rows) => rows.file(),
        }
    }
}
