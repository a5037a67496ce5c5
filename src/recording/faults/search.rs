//! Searches for faulty rows by comparing them with the other rows.

use std::ops::Range;

use rayon::prelude::*;

use super::chance::Limit;
use super::fault::FaultKind;
use super::pinned::{Axis, saturated};
use super::rows::FaultyRows;
use super::spikes::spikes;
use crate::recording::ColumnFacts;

/// Searches for saturated and stuck values and spikes in the columns of gyro x, y, z and accelerometer x, y, z.
pub fn find(
    columns: &[Vec<f64>; 6],
    facts: &[ColumnFacts; 6],
    full_scale: &[Option<f64>; 6],
    pulses: bool,
) -> Vec<FaultyRows> {
    let limit = Limit::of_rows(columns[0].len());
    let step_of = |(facts, column): (&ColumnFacts, &Vec<f64>)| {
        facts.step.unwrap_or_else(|| last_digit(column))
    };
    let steps: Vec<f64> = facts.par_iter().zip(columns).map(step_of).collect();
    let spikes = spikes(
        &std::array::from_fn(|k| columns[k].as_slice()),
        &steps,
        limit,
    );
    let axis = |k: usize| Axis::of(&columns[k], &facts[k], steps[k], pulses);
    let axes: Vec<Axis> = (0..columns.len()).into_par_iter().map(axis).collect();
    let of_column = |column: usize| {
        let spikes = &spikes[column];
        let stuck = axes[column].stuck(limit);
        let triad = [0, 1, 2].map(|axis| &axes[column - column % 3 + axis]);
        let saturated = saturated(triad, column % 3, full_scale[column], spikes, limit);
        // The row before a run has the same value.
        let free = |rows: &Range<usize>| {
            !saturated
                .iter()
                .any(|known| known.start < rows.end && rows.start < known.end)
        };
        let spikes = spikes.iter().map(|&row| row..row + 1);
        let spikes = spikes.filter(free).map(|rows| (FaultKind::Spike, rows));
        let stuck = stuck.iter().filter(|&rows| free(rows));
        let stuck = stuck.map(|rows| (FaultKind::Stuck, rows.clone()));
        let kinds: Vec<_> = spikes.chain(stuck).collect();
        let saturated = saturated
            .into_iter()
            .map(|rows| (FaultKind::Saturated, rows));
        let found = saturated.chain(kinds);
        let column = Some(column);
        let found = found.map(|(kind, rows)| FaultyRows { kind, column, rows });
        found.collect::<Vec<_>>()
    };
    let found: Vec<_> = (0..columns.len()).into_par_iter().map(of_column).collect();
    found.into_iter().flatten().collect()
}

/// Resolution of a column of numbers with a fixed number of digits, at its largest values. It follows from the smallest
/// change relative to the value; the last digit is up to ten times larger.
fn last_digit(values: &[f64]) -> f64 {
    let changes = values.windows(2).filter(|pair| pair[0] != pair[1]);
    let relative = changes.map(|pair| (pair[1] - pair[0]).abs() / pair[0].abs().max(pair[1].abs()));
    let largest = values
        .iter()
        .fold(0.0, |largest, value| value.abs().max(largest));
    match relative.reduce(f64::min) {
        Some(least) => 10.0 * least * largest,
        None => 0.0,
    }
}
