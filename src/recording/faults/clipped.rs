//! Axes that an end of their range holds while the instrument moves.
//!
//! A motion that is beyond the range leaves the same value row after row, while the other axes of the triad go on. How
//! much an axis changes from row to row by itself is seen beside these rows, and how much less all of them may do so
//! within is seen on the others: at rest, and in a turn as even as a table's, these are as silent as it is.

use std::ops::Range;

use statrs::function::erf::erf;

use super::chance::Limit;
use super::stuck::{Column, runs};
use crate::statistics::median;

/// Rows on either side that tell how a motion goes on.
const BESIDE: usize = 16;
/// Median magnitude of second differences of white noise over its σ: √6 times that of a normal variate.
const OF_SECOND_DIFFERENCES: f64 = 2.449_489_742_783_178 * 0.674_489_750_196_081_7;

/// Whether the smallest value of a triad's axis, and the largest, comes in a row more often than its motion lets it.
pub(super) fn clipped(triad: [&Column; 3], axis: usize, limit: Limit) -> [bool; 2] {
    let values = triad[axis].values;
    let runs = runs(values);
    let at = |end: f64| runs.iter().filter(move |run| values[run.start] == end);
    let extreme = |of: fn(f64, f64) -> f64| values.iter().copied().fold(f64::NAN, of);
    [extreme(f64::min), extreme(f64::max)]
        .map(|end| at(end).any(|run| is_improbable(triad, axis, run, limit)))
}

/// Whether so many repeats are, of a motion that goes on as beside them.
fn is_improbable(triad: [&Column; 3], axis: usize, repeats: &Range<usize>, limit: Limit) -> bool {
    let within = repeats.start - 1..repeats.end;
    let Some(before) = within.start.checked_sub(BESIDE) else {
        return false;
    };
    if within.end + BESIDE > triad[axis].values.len() {
        return false;
    }
    let sides = [before..within.start, within.end..within.end + BESIDE];
    // The quieter side, for the other may be where the motion begins or ends.
    let beside = |of: usize| {
        let of_side = |side: &Range<usize>| triad[of].unrest(side);
        sides.iter().map(of_side).fold(f64::INFINITY, f64::min)
    };
    let quieter = |other: usize| match beside(other) {
        // It tells nothing.
        0.0 => 0.0,
        usual => (triad[other].unrest(&within) / usual).min(1.0),
    };
    let others = (0..3).filter(|&other| other != axis);
    let variance = beside(axis) * others.map(quieter).fold(1.0, f64::min);
    let probability = erf((8.0 * variance).sqrt().recip());
    repeats.len() as f64 * probability.recip().ln() > limit.nats
}

impl Column<'_> {
    /// Variance of white noise whose second differences were as large as those of most of these rows, steps²: a few
    /// are where a motion begins or ends.
    fn unrest(&self, rows: &Range<usize>) -> f64 {
        let second = |three: &[f64]| (three[0] - 2.0 * three[1] + three[2]).abs();
        let mut sizes: Vec<f64> = self.values[rows.clone()].windows(3).map(second).collect();
        match median(&mut sizes) {
            Some(size) if self.step > 0.0 => (size / (OF_SECOND_DIFFERENCES * self.step)).powi(2),
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: usize = 3000;

    /// Turns by hand on a grid of one: smooth, of all axes at once, up to these values, with pauses between them.
    fn by_hand(largest: [f64; 3], at_rest: f64) -> [Vec<f64>; 3] {
        [0, 1, 2].map(|axis| {
            let value = |k: usize| {
                let t = k as f64;
                let turn = (t / 500.0 * std::f64::consts::TAU).sin().max(0.0).powi(2);
                let hand = 1.0 + 0.2 * (t / (7.0 + axis as f64)).sin();
                (at_rest + largest[axis] * turn * hand).round()
            };
            (0..ROWS).map(value).collect()
        })
    }

    fn clipped_of(triad: &[Vec<f64>; 3], step: f64) -> [[bool; 2]; 3] {
        let columns = [0, 1, 2].map(|axis| Column {
            values: &triad[axis],
            step,
            pulses: false,
        });
        let columns = columns.each_ref();
        [0, 1, 2].map(|axis| clipped(columns, axis, Limit::of_rows(ROWS)))
    }

    #[test]
    fn a_motion_that_the_range_cuts_off_is_clipped_there_and_nowhere_else() {
        let mut triad = by_hand([4000.0, 3000.0, 2000.0], 0.0);
        for value in &mut triad[0] {
            *value = value.min(2500.0);
        }
        let none = [false; 2];
        assert_eq!(clipped_of(&triad, 1.0), [[false, true], none, none]);
        // The grid may be finer than is known.
        assert_eq!(clipped_of(&triad, 0.1), [[false, true], none, none]);
    }

    #[test]
    fn neither_peaks_of_a_motion_nor_rest_between_two_are_ends_of_the_range() {
        for largest in [3.0, 30.0, 300.0, 3000.0] {
            for at_rest in [0.0, 17.0] {
                let triad = by_hand([largest; 3], at_rest);
                assert_eq!(clipped_of(&triad, 1.0), [[false; 2]; 3], "{largest}");
                assert_eq!(clipped_of(&triad, 0.1), [[false; 2]; 3], "{largest}");
            }
        }
    }
}
