//! The rows in which faults are searched for.

use std::ops::Range;

use super::fault::FaultKind;
use crate::imu::Sensor;
use crate::recording::ColumnFacts;

/// The rows of a file without duplicates. The columns are gyro x, y, z and accelerometer x, y, z of the file.
pub struct Rows<'a> {
    /// Gyro x, y, z and accelerometer x, y, z.
    pub columns: [Vec<f64>; 6],
    /// Facts that the reader found about each column.
    pub facts: &'a [ColumnFacts; 6],
    /// Full scale of each column, in the file's quantity.
    pub full_scale: [Option<f64>; 6],
    /// Whether rows are whole pulses, with the remainder carried into the next row.
    pub pulses: bool,
    /// The body axis of each column.
    pub body_axes: [usize; 6],
    /// One unit of the file's quantity in rad or m/s.
    pub units: [f64; 6],
    /// Line number of each row.
    pub lines: Vec<u64>,
    /// Sample number of each row, increasing from zero.
    pub numbers: Vec<usize>,
    /// Sample period, s.
    pub period: f64,
    /// Number of rows before each duplicate, and the line of the duplicate.
    pub duplicates: Vec<(usize, u64)>,
}

/// The sensor of a column.
pub fn sensor(column: usize) -> Sensor {
    Sensor::ALL[column / 3]
}

/// Faulty rows in one column, or faulty whole rows.
pub struct FaultyRows {
    pub kind: FaultKind,
    pub column: Option<usize>,
    pub rows: Range<usize>,
}

impl FaultyRows {
    /// The columns that the fault concerns.
    pub fn columns(&self) -> Range<usize> {
        self.column.map_or(0..6, |column| column..column + 1)
    }
}

/// Runs of consecutive rows or samples for which `is` is true.
pub fn ranges(count: usize, is: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    consecutive((0..count).filter(|&row| is(row)))
}

/// Groups increasing numbers into runs of consecutive numbers.
pub fn consecutive(rows: impl Iterator<Item = usize>) -> Vec<Range<usize>> {
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for row in rows {
        match ranges.last_mut() {
            Some(last) if last.end == row => last.end += 1,
            _ => ranges.push(row..row + 1),
        }
    }
    ranges
}
