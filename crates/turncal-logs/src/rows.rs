//! Rows of numbers, independent of the file format.

use std::borrow::Cow;
use std::fmt::Display;
use std::path::Path;

use turncal_input::names;
use turncal_input::{FileColumn, FileError, Place};

/// A file that provides rows of numbers in sequence.
pub trait Rows {
    /// The file name used in errors.
    fn file(&self) -> &Path;

    /// The names of the columns.
    fn header(&self) -> &[String];

    /// The column units; empty if the file states none.
    fn units(&self) -> &[String];

    /// Stated row rate, Hz.
    fn rate(&self) -> Option<f64> {
        None
    }

    /// Remarks on modifications of the values, one sentence each.
    fn remarks(&self) -> &[String];

    /// Error of integrals of the accelerometer columns over any rows, in the column unit times s, from combining two
    /// streams.
    fn integral_error(&self) -> [f64; 3] {
        [0.0; 3]
    }

    /// Advances to the next row, of which these columns are used; returns false at the end.
    fn advance(&mut self, used: &[usize]) -> Result<bool, FileError>;

    /// The number in a column of the row; NaN if missing.
    fn value(&self, column: usize) -> f64;

    /// The text in a column of the row.
    fn shown(&self, column: usize) -> Cow<'_, str> {
        self.value(column).to_string().into()
    }

    /// Whether a column of the row is blank.
    fn is_blank(&self, column: usize) -> bool {
        self.value(column).is_nan()
    }

    /// Line number of a text, or sample number of another file.
    fn line(&self) -> u64;

    /// The place of the row, or of a column in the row.
    fn place(&self, column: Option<usize>) -> Place;

    /// The place of the column names.
    fn place_of_names(&self) -> Place {
        Place::File
    }

    /// Converts the line in an error to the numbering of this file.
    fn placed(&self, error: FileError) -> FileError {
        error
    }

    /// Whether the row is the last one and lacks a line ending, so that its last number may be truncated.
    fn may_be_cut(&self) -> bool {
        false
    }

    /// Remark on lines between the rows that are not rows.
    fn left_out(&self) -> Option<String> {
        None
    }

    /// Remark on a truncated end of the file, which says how its last row was treated.
    fn cut_off(&self, _done: &str) -> Option<String> {
        None
    }
}

/// A file of rows with its current row and the columns that are used.
pub struct LogRows {
    rows: Box<dyn Rows>,
    used: Vec<usize>,
}

impl std::ops::Deref for LogRows {
    type Target = dyn Rows;

    fn deref(&self) -> &Self::Target {
        &*self.rows
    }
}

impl LogRows {
    /// The rows of any source.
    pub fn new(rows: impl Rows + 'static) -> Self {
        Self {
            rows: Box::new(rows),
            used: Vec::new(),
        }
    }

    /// Index of a named column; the column becomes exclusive.
    pub fn column(&mut self, name: &str) -> Result<usize, FileError> {
        let found = names::find(self.header(), &self.used, name);
        let place = found.map_err(|[found, expected, advice]| {
            FileError::new(self.file(), self.place_of_names(), found, expected, advice)
        })?;
        self.used.push(place);
        Ok(place)
    }

    /// Index of a column; a minus sign before its name reverses the sign of the values.
    pub fn signed_column(&mut self, name: &str) -> Result<(usize, FileColumn), FileError> {
        let literal = self.header().iter().any(|known| known == name);
        let bare = name.strip_prefix('-').filter(|_| !literal);
        let column = FileColumn {
            name: bare.unwrap_or(name).to_owned(),
            reversed: bare.is_some(),
        };
        Ok((self.column(&column.name)?, column))
    }

    /// Advances to the next row; returns false at the end.
    pub fn advance(&mut self) -> Result<bool, FileError> {
        self.rows.advance(&self.used)
    }

    /// The finite number in a column of the row.
    pub fn number(&self, column: usize) -> Result<f64, FileError> {
        let value = self.value(column);
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self.not(column, "a finite number"))
        }
    }

    /// The text in a column of the row, not empty.
    pub fn text(&self, column: usize) -> Result<Cow<'_, str>, FileError> {
        let text = self.shown(column);
        if text.is_empty() {
            Err(self.not(column, "a text"))
        } else {
            Ok(text)
        }
    }

    /// The error for an invalid value in a row.
    pub fn not(&self, column: usize, expected: &str) -> FileError {
        let shown = self.shown(column);
        let found = if shown.is_empty() {
            "an empty field".to_owned()
        } else {
            format!("`{shown}`")
        };
        let advice = "Correct the value, or repeat the recording.";
        FileError::new(
            self.file(),
            self.place(Some(column)),
            found,
            expected,
            advice,
        )
    }

    /// An error that concerns the whole file.
    pub fn error(
        &self,
        found: impl Display,
        expected: impl Display,
        advice: impl Display,
    ) -> FileError {
        FileError::new(self.file(), Place::File, found, expected, advice)
    }

    /// An error about the row.
    pub fn error_here(
        &self,
        found: impl Display,
        expected: impl Display,
        advice: impl Display,
    ) -> FileError {
        FileError::new(self.file(), self.place(None), found, expected, advice)
    }
}
