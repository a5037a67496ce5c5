//! The columns of a file of rows, unchanged.

use turncal_input::FileError;
use turncal_logs::rows::LogRows;
use turncal_logs::{DataFile, Source};

/// The columns of an unknown file.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    pub names: Vec<String>,
    /// Units from the row below the column names; empty if there is no such row.
    pub units: Vec<String>,
    /// Row rate stated in comments, Hz.
    pub rate: Option<f64>,
    /// The numbers; NaN where a number is missing.
    pub columns: Vec<Vec<f64>>,
    /// Whether the file contains more rows than were read.
    pub goes_on: bool,
}

/// Maximum number of values read to identify a file, 48 MiB: more than an hour of both triads at 200 Hz.
const MOST: usize = 6 << 20;

impl Sheet {
    /// Reads a file that must contain at least this many rows.
    pub fn read(file: &DataFile, fewest: usize) -> Result<Self, FileError> {
        Self::of(Source::of_file(file.clone()).open()?, fewest)
    }

    /// Reads as many rows as are needed to identify the columns; the log must have at least `fewest`.
    pub fn of(mut csv: LogRows, fewest: usize) -> Result<Self, FileError> {
        let names = csv.header().to_vec();
        let mut units = csv.units().to_vec();
        units.resize(names.len(), String::new());
        let mut columns = vec![Vec::new(); names.len()];
        let most = MOST / names.len().max(1);
        let mut goes_on = false;
        while csv.advance()? {
            if columns.first().is_some_and(|column| column.len() == most) {
                goes_on = true;
                break;
            }
            for (index, column) in columns.iter_mut().enumerate() {
                let value = csv.value(index);
                column.push(if value.is_finite() { value } else { f64::NAN });
            }
        }
        let rows = columns.first().map_or(0, Vec::len);
        if rows < fewest {
            let (found, expected) = (format!("only {rows} rows"), format!("at least {fewest}"));
            return Err(csv.error(found, expected, "Record a run with dwells and turns."));
        }
        Ok(Self {
            names,
            units,
            rate: csv.rate(),
            columns,
            goes_on,
        })
    }

    /// The number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// Whether one of these columns has a number in a row.
    pub fn has(&self, columns: &[usize], row: usize) -> bool {
        columns.iter().any(|&k| self.columns[k][row].is_finite())
    }

    /// Whether a column has two different numbers.
    pub fn varies(&self, column: usize) -> bool {
        let mut values = self.columns[column]
            .iter()
            .filter(|value| value.is_finite());
        let first = values.next();
        first.is_some_and(|first| values.any(|value| value != first))
    }

    /// Keeps the rows that satisfy a condition.
    pub fn retain(&mut self, keep: impl Fn(&Self, usize) -> bool) {
        let kept: Vec<bool> = (0..self.rows()).map(|row| keep(self, row)).collect();
        for column in &mut self.columns {
            let mut kept = kept.iter();
            column.retain(|_| kept.next() == Some(&true));
        }
    }
}
