//! Detection of values that are impossible for an instrument at rest or on a turntable, for example after a failed
//! transfer or a counter underflow.

use std::ops::Range;

use super::fault::FaultKind;
use super::rows::{FaultyRows, Rows, ranges};
use crate::units::STANDARD_GRAVITY;

/// Beyond the range of any gyro, rad/s (57,000 °/s).
const FASTEST: f64 = 1000.0;
/// Beyond the specific force of any instrument on a table, m/s² (1,000 g).
const LARGEST_FORCE: f64 = 1e4;

/// Rows that exceed the range of any instrument at nominal scales, and rows that are zero in all columns although
/// gravity exceeds the smallest step, in row order. If most rows are impossible, no rows of this kind are returned,
/// because the cause is then a wrong unit.
pub fn impossible(rows: &Rows) -> Vec<FaultyRows> {
    let count = rows.columns[0].len();
    let found = |kind, column, is: &dyn Fn(usize) -> bool| {
        let found = ranges(count, is);
        let are_few = 2 * found.iter().map(Range::len).sum::<usize>() < count;
        let found = found.into_iter().filter(move |_| are_few);
        found.map(move |rows| FaultyRows { kind, column, rows })
    };
    let beyond = (0..6).flat_map(|k| {
        let largest = if k < 3 { FASTEST } else { LARGEST_FORCE };
        let limit = (largest * rows.period / rows.units[k]).abs();
        let column = &rows.columns[k];
        found(FaultKind::Beyond, Some(k), &|row| column[row].abs() > limit)
    });
    // If the remainder is carried over, a sample of up to one step on each axis can be zero.
    let shows = |k: usize| {
        let step = if rows.pulses {
            1.0
        } else {
            rows.facts[k].step.unwrap_or(0.0)
        };
        let gravity = (STANDARD_GRAVITY * rows.period / rows.units[k]).abs();
        gravity > 3f64.sqrt() * step
    };
    let are_shown = (3..6).all(shows);
    let zero = found(FaultKind::Zero, None, &|row| {
        are_shown && rows.columns.iter().all(|column| column[row] == 0.0)
    });
    let mut all: Vec<FaultyRows> = beyond.chain(zero).collect();
    all.sort_by_key(|found| found.rows.start);
    all
}

/// Columns with each impossible value replaced by the previous value.
pub fn without(columns: &[Vec<f64>; 6], impossible: &[FaultyRows]) -> [Vec<f64>; 6] {
    let mut without = columns.clone();
    for found in impossible {
        let beside = found.rows.start.checked_sub(1);
        let beside = beside.unwrap_or(found.rows.end);
        for column in found.columns() {
            let value = without[column].get(beside).copied().unwrap_or(0.0);
            without[column][found.rows.clone()].fill(value);
        }
    }
    without
}
