//! Detection of samples at an end of the range of an axis. The signs of an end are the end of a register, a value that
//! several spikes have in common, and repeated values that noise or continued motion would not give.

use std::ops::Range;

use super::{Axis, repeats_at_best};
use crate::recording::faults::chance::Limit;
use crate::statistics::median;

/// Possible register widths of a column. The extreme of a column equals the end of such a register by chance in at
/// most one of 2¹⁵ columns; the ends of shorter registers are ordinary values.
const BITS: [i32; 3] = [16, 24, 32];

/// Rows in which the value of an axis is at the end of its range or beyond.
pub fn saturated(
    triad: [&Axis; 3],
    axis: usize,
    full_scale: Option<f64>,
    spikes: &[usize],
    limit: Limit,
) -> Vec<Range<usize>> {
    let own = triad[axis];
    let extremes = own.extremes();
    let pinned = extremes.map(|end| pinned(triad, axis, end, limit));
    let noise = pinned.into_iter().flatten().reduce(f64::max);
    let noise = noise.filter(|noise| *noise > 0.0);
    if let Some(full) = full_scale {
        // Registers extend one step further down than up.
        let (zero, step) = (own.zero(), own.facts.step.unwrap_or(0.0));
        return own.at_end(noise, |value| {
            (value - zero).abs() >= (full - step) * (1.0 - 1e-9)
        });
    }
    let sure: [bool; 2] = std::array::from_fn(|k| {
        let end = extremes[k];
        pinned[k].is_some() || own.is_register_end(end) || own.is_reached_by_spikes(end, spikes)
    });
    // The range is symmetric except for one step.
    let [smallest, largest] = extremes;
    let slack = 1.5 * own.facts.step.unwrap_or(0.0) + 1e-9 * largest.abs();
    let mirrored = (smallest + largest).abs() <= slack;
    let is_end = [0, 1].map(|k| sure[k] || (mirrored && sure[1 - k]));
    own.at_end(noise, |value| {
        (is_end[0] && value == smallest) || (is_end[1] && value == largest)
    })
}

/// Whether an axis repeats this value more often in a row than its noise or its motion allows. Returns the σ of the
/// noise that reaches the value; zero for a motion that is clipped there.
///
/// An axis may be quieter than usual, or than its neighbouring rows, at rest or in the steady turn of a table. Then the
/// other axes of the triad are also quiet, and noise and motion are scaled down accordingly.
fn pinned(triad: [&Axis; 3], axis: usize, end: f64, limit: Limit) -> Option<f64> {
    let own = triad[axis];
    let of_run = |run: &Range<usize>| {
        let rows = run.start - 1..run.end;
        let is_improbable = |nats: f64| run.len() as f64 * nats > limit.nats;
        let quieter = |usual: &dyn Fn(&Axis) -> f64| {
            let others = (0..3).filter(|&other| other != axis);
            let quieter = others.map(|other| match usual(triad[other]) {
                // This axis gives no information.
                0.0 => 0.0,
                usual => (triad[other].unrest(rows.clone()) / usual).min(1.0),
            });
            quieter.fold(1.0, f64::min)
        };
        let by_noise = |variance: f64| is_improbable(own.nats(variance));
        if by_noise(own.noise) {
            let variance = own.noise * quieter(&|other| other.noise);
            if by_noise(variance) {
                return Some(variance.sqrt() * own.step);
            }
        }
        let by_motion = |variance: f64| is_improbable(repeats_at_best(variance).recip().ln());
        let beside = own.unrest_beside(&rows);
        let is_cut_off =
            by_motion(beside) && by_motion(beside * quieter(&|other| other.unrest_beside(&rows)));
        is_cut_off.then_some(0.0)
    };
    let at_end = own.runs.iter().filter(|run| own.values[run.start] == end);
    at_end.filter_map(of_run).reduce(f64::max)
}

impl Axis<'_> {
    /// The smallest value and the largest.
    fn extremes(&self) -> [f64; 2] {
        [self.facts.smallest, self.facts.largest]
    }

    /// Value of the register at zero: the middle of its range if it is unsigned.
    fn zero(&self) -> f64 {
        let [smallest, largest] = self.extremes();
        let unsigned = |bits: i32| {
            let half = 2f64.powi(bits - 1);
            let around = (0.5 * half..=1.5 * half).contains(&self.median()?);
            (smallest >= 0.0 && largest < 2.0 * half && around).then_some(half)
        };
        let whole = self.facts.step.is_some_and(|step| step.fract() == 0.0);
        let zero = BITS.into_iter().filter(|_| whole).find_map(unsigned);
        zero.unwrap_or(0.0)
    }

    fn is_register_end(&self, end: f64) -> bool {
        let Some(step) = self.facts.step else {
            return false;
        };
        BITS.into_iter().any(|bits| {
            let half = 2f64.powi(bits - 1);
            // Raw registers have their zero in the middle.
            let offset = || {
                let middle = 0.5 * half..=1.5 * half;
                self.median()
                    .is_some_and(|median| middle.contains(&(median / step)))
            };
            // A grid that follows from rounded digits is known to its last step.
            let is = |register: f64| (end / step - register).abs() < 0.5;
            [half - 1.0, 1.0 - half, -half].into_iter().any(is)
                || ([0.0, 2.0 * half - 1.0].into_iter().any(is) && offset())
        })
    }

    /// Whether several spikes have this value: spikes differ from one another, unless they are at the end of the
    /// range.
    fn is_reached_by_spikes(&self, end: f64, spikes: &[usize]) -> bool {
        spikes.iter().filter(|&&k| self.values[k] == end).count() >= 2
    }

    /// Rows at an end. If an axis at rest is clipped there with noise of this σ, the rows in between are included:
    /// noise moves them from beyond the end into the range, so their mean is biased. Rows that noise moves to the end
    /// from within the range are excluded.
    fn at_end(&self, noise: Option<f64>, is_end: impl Fn(f64) -> bool) -> Vec<Range<usize>> {
        let is_cut = |rows: Range<usize>| {
            let end = self.values[rows.end];
            let near = |value: &f64| noise.is_some_and(|sigma| (value - end).abs() <= FAR * sigma);
            rows.len() <= APART && self.values[rows].iter().all(near)
        };
        let mut rows: Vec<(Range<usize>, usize)> = Vec::new();
        for k in (0..self.values.len()).filter(|&k| is_end(self.values[k])) {
            match rows.last_mut() {
                Some((last, at_end)) if is_cut(last.end..k) => {
                    last.end = k + 1;
                    *at_end += 1;
                }
                _ => rows.push((k..k + 1, 1)),
            }
        }
        if noise.is_some() {
            rows.retain(|(rows, at_end)| *at_end > 1 && SELDOM * at_end >= rows.len());
        }
        rows.into_iter().map(|(rows, _)| rows).collect()
    }

    fn median(&self) -> Option<f64> {
        median(&mut self.values.to_vec())
    }
}

/// Noise moves no row farther than this from the true value, σ.
const FAR: f64 = 5.0;
/// If noise reaches an end in less than one row in this many, clipping biases the mean by less than a hundredth of its
/// σ.
const SELDOM: usize = 64;
/// Maximum number of rows between two rows at an end. With a smaller number, rows that are SELDOM apart on average
/// would be separated by chance, and the remaining noise would be selected by its sign.
const APART: usize = 8 * SELDOM;

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::recording::ColumnFacts;
    use crate::recording::faults::spikes::spikes;

    fn facts(triad: &[Vec<f64>; 3]) -> [ColumnFacts; 3] {
        triad
            .each_ref()
            .map(|values| ColumnFacts::of("", values, 1.0))
    }

    fn found(values: &[f64], step: Option<f64>, full_scale: Option<f64>) -> Vec<Range<usize>> {
        let rest = vec![0.0; values.len()];
        let mut columns = [rest.as_slice(); 6];
        columns[0] = values;
        let limit = Limit::of_rows(values.len());
        let [spikes, ..] = spikes(&columns, &[step.unwrap_or(0.0); 6], limit);
        let facts = ColumnFacts {
            step,
            ..ColumnFacts::of("", values, 1.0)
        };
        let axis = Axis::of(values, &facts, step.unwrap_or(0.0), false);
        let silent = Axis::of(&rest, &facts, 1.0, false);
        saturated([&axis, &silent, &silent], 0, full_scale, &spikes, limit)
    }

    /// A slow swing with a little noise, on a grid of one.
    fn swing(amplitude: f64) -> Vec<f64> {
        let value = |k: i32| {
            let t = f64::from(k);
            amplitude * (t / 300.0).sin() + 3.0 * (12.9898 * t).sin()
        };
        (0..50_000).map(|k| value(k).round()).collect()
    }

    #[test]
    fn registers_end_where_their_bits_do() {
        for (offset, ends) in [(0.0, [-32768.0, 32767.0]), (32768.0, [0.0, 65535.0])] {
            let mut values = swing(40_000.0);
            let clipped = |v: &f64| (v + offset).clamp(ends[0], ends[1]);
            values = values.iter().map(clipped).collect();
            let at: Vec<usize> = found(&values, Some(1.0), None)
                .into_iter()
                .flatten()
                .collect();
            let at_end = (0..values.len()).filter(|&k| ends.contains(&values[k]));
            assert_eq!(at, at_end.collect::<Vec<_>>());
            assert!(at.len() > 1000);
        }
    }

    #[test]
    fn spikes_to_a_common_value_are_an_end_of_the_range() {
        let mut values = swing(1000.0);
        for k in [100, 101, 900, 2500] {
            values[k] = 2500.0;
        }
        values[3000] = -2501.0;
        assert_eq!(
            found(&values, Some(1.0), None),
            [100..102, 900..901, 2500..2501, 3000..3001]
        );
    }

    #[test]
    fn what_a_smooth_motion_reaches_is_no_end() {
        assert!(found(&swing(1000.0), Some(1.0), None).is_empty());
        // A plateau without noise, reached by a ramp.
        let ramp = |k: i32| f64::from(k.min(600 - k).clamp(0, 100)) * 0.1;
        let values: Vec<f64> = (0..600).map(ramp).collect();
        assert!(found(&values, Some(0.1), None).is_empty());
    }

    #[test]
    fn a_stated_full_scale_ends_the_range_on_both_sides() {
        let mut values = swing(1000.0);
        values[7] = 2000.0;
        values[9] = -1999.0;
        values[11] = 1998.0;
        assert_eq!(found(&values, Some(1.0), Some(2000.0)), [7..8, 9..10]);
    }

    const CLIPPED_ROWS: usize = 3000;

    /// Turns by hand on a grid of one: smooth, of all axes at once, up to these values, with pauses between them.
    fn by_hand(largest: [f64; 3], at_rest: f64) -> [Vec<f64>; 3] {
        [0, 1, 2].map(|axis| {
            let value = |k: usize| {
                let t = k as f64;
                let turn = (t / 500.0 * std::f64::consts::TAU).sin().max(0.0).powi(2);
                let hand = 1.0 + 0.2 * (t / (7.0 + axis as f64)).sin();
                (at_rest + largest[axis] * turn * hand).round()
            };
            (0..CLIPPED_ROWS).map(value).collect()
        })
    }

    fn clipped_of(triad: &[Vec<f64>; 3], step: f64) -> [[bool; 2]; 3] {
        [0, 1, 2].map(|axis| pinned_of(triad, axis, step).map(|found| found.is_some()))
    }

    fn pinned_of(triad: &[Vec<f64>; 3], axis: usize, step: f64) -> [Option<f64>; 2] {
        let facts = facts(triad);
        let axes: [Axis; 3] = std::array::from_fn(|k| Axis::of(&triad[k], &facts[k], step, false));
        let limit = Limit::of_rows(triad[0].len());
        axes[axis]
            .extremes()
            .map(|end| pinned(axes.each_ref(), axis, end, limit))
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

    const HELD_ROWS: usize = 18_000;
    /// A third of the recording at this level.
    const HIGH: Range<usize> = 6_000..12_000;

    /// Three axes on a grid of one, with noise of these σ where the first is high and elsewhere.
    fn triad(level: f64, sigma: f64, there: [f64; 3]) -> [Vec<f64>; 3] {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        [0, 1, 2].map(|axis| {
            let mut row = |k: usize| {
                let (mean, sigma) = if HIGH.contains(&k) {
                    (if axis == 0 { level } else { 300.0 }, there[axis])
                } else {
                    (100.0, sigma)
                };
                let normal: f64 = StandardNormal.sample(&mut random);
                (mean + sigma * normal).round()
            };
            (0..HELD_ROWS).map(&mut row).collect()
        })
    }

    fn held_by(triad: &[Vec<f64>; 3]) -> [Option<f64>; 2] {
        pinned_of(triad, 0, 1.0)
    }

    #[test]
    fn an_axis_clipped_while_it_rests_is_held_however_far_the_truth_is_beyond() {
        for beyond in [0.5, 1.0, 50.0] {
            let mut triad = triad(1000.0 + 3.0 * beyond, 3.0, [3.0; 3]);
            for value in &mut triad[0] {
                *value = value.min(1000.0);
            }
            let [low, high] = held_by(&triad);
            assert_eq!(low, None);
            assert!((high.unwrap() - 3.0).abs() < 0.5, "{beyond} {high:?}");
        }
    }

    #[test]
    fn an_extreme_that_noise_reaches_holds_nothing() {
        assert_eq!(held_by(&triad(1000.0, 3.0, [3.0; 3])), [None; 2]);
        assert_eq!(held_by(&triad(1000.0, 0.3, [0.3; 3])), [None; 2]);
        assert_eq!(held_by(&triad(1000.0, 0.0, [0.0; 3])), [None; 2]);
    }

    #[test]
    fn where_all_axes_are_more_silent_the_same_value_again_is_no_end() {
        assert_eq!(held_by(&triad(1000.0, 3.0, [0.1; 3])), [None; 2]);
        assert!(held_by(&triad(1000.0, 3.0, [0.1, 3.0, 3.0]))[1].is_some());
    }
}
