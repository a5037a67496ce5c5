//! Rows of numbers, whatever a file holds them in.

use std::borrow::Cow;
use std::fmt::Display;
use std::path::Path;

use super::error::{FileError, Place};
use super::names;
use crate::recording::FileColumn;

/// A file that gives rows of numbers one after the other.
pub trait Rows {
    fn file(&self) -> &Path;

    /// The names of the columns.
    fn header(&self) -> &[String];

    /// The units of the columns; none at all where the file says none.
    fn units(&self) -> &[String];

    /// What the file says of the rate of rows, Hz.
    fn rate(&self) -> Option<f64> {
        None
    }

    /// What was done to the values, a sentence each.
    fn remarks(&self) -> &[String];

    /// Error of the integrals of the accelerometers' columns over any rows, in the columns' unit times s: what
    /// putting two streams on one grid left.
    fn integral_error(&self) -> [f64; 3] {
        [0.0; 3]
    }

    /// Goes to the next row, of which these columns are used; false at the end.
    fn advance(&mut self, used: &[usize]) -> Result<bool, FileError>;

    /// The number in a column of the row; NaN is none.
    fn value(&self, column: usize) -> f64;

    /// What stands in a column of the row.
    fn shown(&self, column: usize) -> Cow<'_, str> {
        self.value(column).to_string().into()
    }

    /// Whether nothing stands in a column of the row.
    fn is_blank(&self, column: usize) -> bool {
        self.value(column).is_nan()
    }

    /// Line of a text, sample of another file.
    fn line(&self) -> u64;

    /// The place of the row or of a column in it …
    fn place(&self, column: Option<usize>) -> Place;

    /// … and of the names.
    fn place_of_names(&self) -> Place {
        Place::File
    }

    /// An error of a row that names its line, with what its number counts in this file.
    fn placed(&self, error: FileError) -> FileError {
        error
    }

    /// Whether the row is the last and no line end shows that its last number is whole.
    fn may_be_cut(&self) -> bool {
        false
    }

    /// What the end of the file leaves open, in a sentence, with what was done about its last row.
    fn cut_off(&self, _done: &str) -> Option<String> {
        None
    }

    /// Takes less memory for granted: rows are packed as they come.
    fn pack(&mut self) {}
}

/// A file at one of its rows, and the columns of it that are used.
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
    pub fn new(rows: impl Rows + 'static) -> Self {
        Self {
            rows: Box::new(rows),
            used: Vec::new(),
        }
    }

    /// The index of a named column, which nothing else may be.
    pub fn column(&mut self, name: &str) -> Result<usize, FileError> {
        let found = names::find(self.header(), &self.used, name);
        let place = found.map_err(|[found, expected, advice]| {
            FileError::new(self.file(), self.place_of_names(), found, expected, advice)
        })?;
        self.used.push(place);
        Ok(place)
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
        self.rows.advance(&self.used)
    }

    /// Takes less memory for granted: rows are packed as they come.
    pub fn pack(&mut self) {
        self.rows.pack();
    }

    /// The finite number in a column of the row.
    pub fn number(&self, column: usize) -> Result<f64, FileError> {
        let value = self.value(column);
        match value.is_finite() {
            true => Ok(value),
            false => Err(self.not(column, "a finite number")),
        }
    }

    /// The text in a column of the row, not empty.
    pub fn text(&self, column: usize) -> Result<Cow<'_, str>, FileError> {
        let text = self.shown(column);
        match text.is_empty() {
            false => Ok(text),
            true => Err(self.not(column, "a text")),
        }
    }

    /// The error of a row's value that is not what it should be.
    pub fn not(&self, column: usize, expected: &str) -> FileError {
        let shown = self.shown(column);
        let found = match shown.is_empty() {
            true => "an empty field".to_owned(),
            false => format!("`{shown}`"),
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

    /// An error of the whole file.
    pub fn error(
        &self,
        found: impl Display,
        expected: impl Display,
        advice: impl Display,
    ) -> FileError {
        FileError::new(self.file(), Place::File, found, expected, advice)
    }

    /// An error of the row.
    pub fn error_here(
        &self,
        found: impl Display,
        expected: impl Display,
        advice: impl Display,
    ) -> FileError {
        FileError::new(self.file(), self.place(None), found, expected, advice)
    }
}
