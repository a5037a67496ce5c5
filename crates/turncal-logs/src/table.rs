//! Named columns of numbers in memory, in place of a file.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::rows::Rows;
use turncal_input::{FileError, Place};

/// Columns of equal length. Copies share the numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    name: PathBuf,
    names: Arc<[String]>,
    columns: Arc<[Vec<f64>]>,
}

impl Table {
    /// Columns with their names; NaN marks a missing number. Errors refer to the table by `name`.
    ///
    /// # Errors
    /// Returns [`FileError`] if the columns differ in length.
    pub fn new(
        name: impl AsRef<Path>,
        columns: Vec<(String, Vec<f64>)>,
    ) -> Result<Self, FileError> {
        let name = name.as_ref().to_path_buf();
        let (names, columns): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
        let rows = columns.first().map_or(0, Vec::len);
        if let Some(other) = columns.iter().position(|of| of.len() != rows) {
            let found = format!(
                "{rows} values in `{}` and {} in `{}`",
                names[0],
                columns[other].len(),
                names[other]
            );
            let advice = "Give columns with the same number of rows.";
            return Err(FileError::of(&name, found, "columns of one length", advice));
        }
        Ok(Self {
            name,
            names: names.into(),
            columns: columns.into(),
        })
    }

    /// Name.
    pub fn name(&self) -> &Path {
        &self.name
    }

    /// The names of its columns.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The rows, starting with the first.
    pub fn rows(&self) -> TableRows {
        TableRows {
            table: self.clone(),
            units: Vec::new(),
            remarks: Vec::new(),
            integral_error: [0.0; 3],
            begun: 0,
        }
    }
}

/// A table with its current row.
pub struct TableRows {
    table: Table,
    /// Units of the columns; empty if not stated.
    pub units: Vec<String>,
    /// Modifications of the values, one sentence each.
    pub remarks: Vec<String>,
    /// Error of integrals of the accelerometer columns, in the column unit times s.
    pub integral_error: [f64; 3],
    /// Number of rows up to and including this one.
    begun: usize,
}

impl Rows for TableRows {
    fn file(&self) -> &Path {
        &self.table.name
    }

    fn header(&self) -> &[String] {
        &self.table.names
    }

    fn units(&self) -> &[String] {
        &self.units
    }

    fn remarks(&self) -> &[String] {
        &self.remarks
    }

    fn integral_error(&self) -> [f64; 3] {
        self.integral_error
    }

    fn advance(&mut self, _used: &[usize]) -> Result<bool, FileError> {
        self.begun += 1;
        Ok((self.table.columns.first()).is_some_and(|column| column.len() >= self.begun))
    }

    fn value(&self, column: usize) -> f64 {
        let column = self.table.columns.get(column);
        let value = column.and_then(|column| column.get(self.begun.checked_sub(1)?));
        value.copied().unwrap_or(f64::NAN)
    }

    fn line(&self) -> u64 {
        self.begun as u64
    }

    fn place(&self, column: Option<usize>) -> Place {
        Place::Row {
            row: self.line().saturating_sub(1),
            column: column.and_then(|column| self.table.names.get(column).cloned()),
        }
    }

    fn placed(&self, mut error: FileError) -> FileError {
        if let Place::Line(line) = error.place {
            let row = line.saturating_sub(1);
            error.place = Place::Row { row, column: None };
        }
        error
    }
}
