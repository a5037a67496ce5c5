//! Values that no instrument at rest or on a turntable can give, as from a failed transfer or a counter
//! below zero.

use std::ops::Range;

use super::ranges;
use super::repair::Rows;
use crate::units::STANDARD_GRAVITY;

/// Beyond the range of any gyro, rad/s (57,000 °/s).
const FASTEST: f64 = 1000.0;
/// Beyond the specific force of any instrument on a table, m/s² (1,000 g).
const LARGEST_FORCE: f64 = 1e4;

/// Rows whose values are impossible.
#[derive(Default)]
pub struct Impossible {
    /// Rows beyond the range of any instrument by nominal scales, for each column.
    pub beyond: [Vec<Range<usize>>; 6],
    /// Rows of zeros in all columns, although gravity exceeds the smallest step.
    pub zero: Vec<Range<usize>>,
}

impl Impossible {
    /// Finds impossible rows; none in a column of which most rows are impossible, because then its unit is wrong.
    pub fn find(rows: &Rows) -> Self {
        let count = rows.columns[0].len();
        let few =
            |ranges: &Vec<Range<usize>>| 2 * ranges.iter().map(Range::len).sum::<usize>() < count;
        let beyond = std::array::from_fn(|k| {
            let largest = if k < 3 { FASTEST } else { LARGEST_FORCE };
            let limit = (largest * rows.period / rows.units[k]).abs();
            let found = ranges(count, |row| rows.columns[k][row].abs() > limit);
            Some(found).filter(few).unwrap_or_default()
        });
        // With a fraction carried on, a sample of up to a step on each axis can be zero.
        let shows = |k: usize| {
            let step = if rows.pulses {
                1.0
            } else {
                rows.facts[k].step.unwrap_or(0.0)
            };
            let gravity = (STANDARD_GRAVITY * rows.period / rows.units[k]).abs();
            gravity > 3f64.sqrt() * step
        };
        let zero = match (3..6).all(shows) {
            true => ranges(count, |row| {
                rows.columns.iter().all(|column| column[row] == 0.0)
            }),
            false => Vec::new(),
        };
        Self {
            beyond,
            zero: Some(zero).filter(few).unwrap_or_default(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.zero.is_empty() && self.beyond.iter().all(Vec::is_empty)
    }

    /// All impossible rows of a column.
    pub fn of_column(&self, column: usize) -> impl Iterator<Item = &Range<usize>> {
        self.beyond[column].iter().chain(&self.zero)
    }

    /// Columns in which each impossible value is replaced by the value before it.
    pub fn without(&self, columns: &[Vec<f64>; 6]) -> [Vec<f64>; 6] {
        let mut without = columns.clone();
        for (k, column) in without.iter_mut().enumerate() {
            let mut found: Vec<_> = self.of_column(k).cloned().collect();
            found.sort_by_key(|rows| rows.start);
            for rows in found {
                let beside = rows.start.checked_sub(1).unwrap_or(rows.end);
                let value = column.get(beside).copied().unwrap_or(0.0);
                column[rows].fill(value);
            }
        }
        without
    }
}
