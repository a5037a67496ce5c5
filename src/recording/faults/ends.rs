//! Samples at the end of an axis' range: registers that end where their bits do, spikes to a common value, motions that
//! stop there and go back, axes that an end holds at rest, and motions that it cuts off.

use std::ops::Range;

use super::chance::Limit;
use super::stuck::{Column, runs};
use crate::statistics::median;

/// Registers that a column may come from. The extreme of a column is at the end of these by chance once in
/// 2¹⁵ columns or less; those of shorter ones are values as any other.
const BITS: [i32; 3] = [16, 24, 32];

/// The ends of an axis' range.
pub(super) struct Ends<'a> {
    column: Column<'a>,
    /// Rows that stand out from both sides.
    spikes: &'a [usize],
    /// Rows that repeat the one before them.
    stuck: &'a [Range<usize>],
    /// σ of the noise of an axis that the smallest value holds at rest, and the largest.
    held: [Option<f64>; 2],
    /// Whether the smallest value cuts a motion off, and the largest.
    clipped: [bool; 2],
}

impl<'a> Ends<'a> {
    /// Of an axis of a triad.
    pub fn of(
        triad: [&Column<'a>; 3],
        axis: usize,
        spikes: &'a [usize],
        stuck: &'a [Range<usize>],
        limit: Limit,
    ) -> Self {
        Self {
            column: *triad[axis],
            spikes,
            stuck,
            held: held(triad, axis, limit),
            clipped: clipped(triad, axis, limit),
        }
    }

    /// Rows whose value is at the end of the range, or beyond.
    pub fn saturated(&self) -> Vec<Range<usize>> {
        let Some(full) = self.column.full_scale else {
            let ends = self.values();
            return self.rows(|value| ends.contains(&value));
        };
        // Registers go a step further down than up.
        let (zero, step) = (self.zero(), self.step());
        self.rows(|value| (value - zero).abs() >= (full - step) * (1.0 - 1e-9))
    }

    /// The step of its grid; zero if there is none.
    fn step(&self) -> f64 {
        self.column.facts.step.unwrap_or(0.0)
    }

    /// The ends of the range, if rows are there that only an end explains.
    fn values(&self) -> Vec<f64> {
        let extremes = self.column.extremes();
        let sure: [bool; 2] = std::array::from_fn(|k| {
            let end = extremes[k];
            self.held[k].is_some()
                || self.clipped[k]
                || self.is_register_end(end)
                || self.is_reached_by_spikes(end)
                || self.stops_motion(end)
        });
        // The range is symmetric, but for a step.
        let [smallest, largest] = extremes;
        let slack = 1.5 * self.step() + 1e-9 * largest.abs();
        let mirrored = (smallest + largest).abs() <= slack;
        (0..2)
            .filter(|&k| sure[k] || (mirrored && sure[1 - k]))
            .map(|k| extremes[k])
            .collect()
    }

    /// What a register says at zero: the middle of its range if it has no sign.
    fn zero(&self) -> f64 {
        let [smallest, largest] = self.column.extremes();
        let unsigned = |bits: i32| {
            let half = 2f64.powi(bits - 1);
            let around = (0.5 * half..=1.5 * half).contains(&self.median()?);
            (smallest >= 0.0 && largest < 2.0 * half && around).then_some(half)
        };
        let whole = self
            .column
            .facts
            .step
            .is_some_and(|step| step.fract() == 0.0);
        let zero = BITS.into_iter().filter(|_| whole).find_map(unsigned);
        zero.unwrap_or(0.0)
    }

    fn is_register_end(&self, end: f64) -> bool {
        let Some(step) = self.column.facts.step else {
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
            // A grid that is known from rounded digits is known to its last step.
            let is = |register: f64| (end / step - register).abs() < 0.5;
            [half - 1.0, 1.0 - half, -half].into_iter().any(is)
                || ([0.0, 2.0 * half - 1.0].into_iter().any(is) && offset())
        })
    }

    /// Single samples that no motion leads to differ from one another, unless they are where the range
    /// ends.
    fn is_reached_by_spikes(&self, end: f64) -> bool {
        self.spikes
            .iter()
            .filter(|&&k| self.column.values[k] == end)
            .count()
            >= 2
    }

    /// Whether an axis is stuck there, with a truth that comes from one side and goes back to it.
    fn stops_motion(&self, end: f64) -> bool {
        let at_end = |run: &&Range<usize>| self.column.values[run.start] == end;
        self.stuck
            .iter()
            .filter(at_end)
            .any(|run| !is_level(self.column.values, run, self.step()))
    }

    /// Rows at an end. Where it is one that holds the axis at rest, with the rows between that noise takes from
    /// beyond it into the range, for their mean is off; and without those that noise takes to it from within.
    fn rows(&self, is_end: impl Fn(f64) -> bool) -> Vec<Range<usize>> {
        let noise = self.held.into_iter().flatten().reduce(f64::max);
        let is_cut = |rows: Range<usize>| {
            let end = self.column.values[rows.end];
            let near = |value: &f64| noise.is_some_and(|sigma| (value - end).abs() <= FAR * sigma);
            rows.len() <= APART && self.column.values[rows].iter().all(near)
        };
        let mut rows: Vec<(Range<usize>, usize)> = Vec::new();
        for (k, _) in self
            .column
            .values
            .iter()
            .enumerate()
            .filter(|(_, v)| is_end(**v))
        {
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
        median(&mut self.column.values.to_vec())
    }
}

/// σ of noise that takes no row so far from where the truth is.
const FAR: f64 = 5.0;
/// Noise that takes one row in so many to an end takes the mean from the truth by less than the hundredth part of its
/// σ, where it is cut off there.
const SELDOM: usize = 64;
/// Rows between two at an end. Were it fewer, chance would part rows that are SELDOM apart on average, and what is left
/// of noise would be chosen by its sign.
const APART: usize = 8 * SELDOM;

/// Rows beside a run whose mean is compared with it.
const BESIDE: usize = 16;
/// σ within which they agree: a steady turn has its axis at the end of what the record holds as well.
const AGREE: f64 = 3.0;

/// Whether a run lies on a level that goes on beside it, as that of a steady turn; at the end of a range
/// the truth comes from one side and goes back there.
fn is_level(values: &[f64], run: &Range<usize>, step: f64) -> bool {
    let value = values[run.start];
    let before = &values[run.start.saturating_sub(1 + BESIDE)..run.start - 1];
    let after = &values[run.end..values.len().min(run.end + BESIDE)];
    [before, after].into_iter().all(|side| {
        let count = side.len().max(1) as f64;
        let off = side.iter().map(|other| value - other).sum::<f64>() / count;
        // Half of the squared changes from row to row is the variance of white noise, whatever the level.
        let changes = side.windows(2).map(|pair| (pair[1] - pair[0]).powi(2));
        let variance = 0.5 * changes.sum::<f64>() / count + step * step / 12.0;
        off * off <= AGREE * AGREE * variance
    })
}

// An axis that is clipped over whole dwells has its extreme there again and again, so often that the most silent part
// of its rows has no noise by which a repeat would be improbable. Noise is therefore measured where axes are not at
// their extremes. Where one is, its noise is as much smaller as that of the triad's other axes, which tell whether all
// is more silent there.

/// σ of the noise of a triad's axis, where an extreme of it comes in a row more often than chance makes it: by the
/// smallest value, and by the largest. `None` where it does not, or where no noise is to be seen.
fn held(triad: [&Column; 3], axis: usize, limit: Limit) -> [Option<f64>; 2] {
    let extremes = triad.map(Column::extremes);
    let longest = extremes[axis].map(|end| longest(triad[axis].values, end));
    if longest == [0; 2] {
        return [None; 2];
    }
    let column = triad[axis];
    // Block by block.
    let at = [0, 1, 2].map(|k| {
        let has = |block: &[f64], end| block.contains(&extremes[k][end]);
        let blocks = triad[k].blocks();
        Vec::from_iter(blocks.map(|block| [0, 1].map(|end| has(block, end))))
    });
    let is_free = |k: usize, block: usize| at[k][block] == [false; 2];
    let noise = |of: usize, among: &dyn Fn(usize) -> bool| {
        let blocks = triad[of].blocks().enumerate();
        let blocks = blocks.filter(|(block, _)| among(*block));
        triad[of].noise_at_rest(blocks.map(|(_, block)| block))
    };
    let elsewhere = column.blocks().enumerate();
    let elsewhere = elsewhere.filter(|(block, _)| is_free(axis, *block));
    let elsewhere: Vec<f64> = elsewhere.flat_map(|(_, rows)| rows).copied().collect();
    let elsewhere = Column {
        values: &elsewhere,
        ..*column
    };
    let usual = noise(axis, &|block| is_free(axis, block));
    [0, 1].map(|end| {
        let variance = usual
            * quietest(axis, |other| {
                let there = |block: usize| at[axis][block][end] && is_free(other, block);
                let elsewhere = |block: usize| is_free(axis, block) && is_free(other, block);
                (noise(other, &there), noise(other, &elsewhere))
            });
        if variance == 0.0 {
            return None;
        }
        let probability = elsewhere.repeat_probability(variance);
        let is_held = longest[end] as f64 > limit.nats / probability.recip().ln();
        is_held.then(|| variance.sqrt() * column.step)
    })
}

/// By how much the quietest other axis of a triad is quieter than usual, by its variances there and elsewhere.
fn quietest(axis: usize, of: impl Fn(usize) -> (f64, f64)) -> f64 {
    let others = (0..3).filter(|&other| other != axis).map(of);
    let quieter = others.map(|(there, usual)| match usual {
        // It tells nothing.
        0.0 => 0.0,
        _ => (there / usual).min(1.0),
    });
    quieter.fold(1.0, f64::min)
}

/// How often a value repeats itself in a row.
fn longest(values: &[f64], value: f64) -> usize {
    let runs = runs(values).into_iter();
    let of_value = runs.filter(|run| values[run.start] == value);
    of_value.map(|run| run.len()).max().unwrap_or(0)
}

// A motion that is beyond the range leaves the same value row after row, while the other axes of the triad go on. How
// much an axis changes from row to row by itself is seen beside these rows, and how much less all of them may do so
// within is seen on the others: at rest, and in a turn as even as a table's, these are as silent as it is.

/// Rows on either side that tell how a motion goes on.
const CLOSE: usize = 16;
/// Median magnitude of second differences of white noise over its σ: √6 times that of a normal variate.
const OF_SECOND_DIFFERENCES: f64 = 2.449_489_742_783_178 * 0.674_489_750_196_081_7;

/// Whether the smallest value of a triad's axis, and the largest, comes in a row more often than its motion lets it.
fn clipped(triad: [&Column; 3], axis: usize, limit: Limit) -> [bool; 2] {
    let values = triad[axis].values;
    let runs = runs(values);
    let at = |end: f64| runs.iter().filter(move |run| values[run.start] == end);
    let extremes = triad[axis].extremes();
    extremes.map(|end| at(end).any(|run| is_improbable(triad, axis, run, limit)))
}

/// Whether so many repeats are, of a motion that goes on as beside them.
fn is_improbable(triad: [&Column; 3], axis: usize, repeats: &Range<usize>, limit: Limit) -> bool {
    let within = repeats.start - 1..repeats.end;
    let Some(before) = within.start.checked_sub(CLOSE) else {
        return false;
    };
    if within.end + CLOSE > triad[axis].values.len() {
        return false;
    }
    let sides = [before..within.start, within.end..within.end + CLOSE];
    // The quieter side, for the other may be where the motion begins or ends.
    let beside = |of: usize| {
        let of_side = |side: &Range<usize>| triad[of].unrest(side);
        sides.iter().map(of_side).fold(f64::INFINITY, f64::min)
    };
    let quieter = quietest(axis, |other| (triad[other].unrest(&within), beside(other)));
    let probability = Column::repeats_at_best(beside(axis) * quieter);
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
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::super::spikes::spikes;
    use super::*;
    use crate::recording::ColumnFacts;

    fn facts(triad: &[Vec<f64>; 3]) -> [ColumnFacts; 3] {
        triad
            .each_ref()
            .map(|values| ColumnFacts::of("", values, 1.0))
    }

    fn columns<'a>(
        triad: &'a [Vec<f64>; 3],
        facts: &'a [ColumnFacts; 3],
        step: f64,
    ) -> [Column<'a>; 3] {
        std::array::from_fn(|k| Column {
            values: &triad[k],
            facts: &facts[k],
            step,
            pulses: false,
            full_scale: None,
        })
    }

    fn saturated(values: &[f64], step: Option<f64>, full_scale: Option<f64>) -> Vec<Range<usize>> {
        let rest = vec![0.0; values.len()];
        let mut columns = [rest.as_slice(); 6];
        columns[0] = values;
        let limit = Limit::of_rows(values.len());
        let [spikes, ..] = spikes(&columns, &[step.unwrap_or(0.0); 6], limit);
        let facts = ColumnFacts {
            step,
            ..ColumnFacts::of("", values, 1.0)
        };
        let column = Column {
            values,
            facts: &facts,
            step: step.unwrap_or(0.0),
            pulses: false,
            full_scale,
        };
        let ends = Ends {
            column,
            spikes: &spikes,
            stuck: &[],
            held: [None; 2],
            clipped: [false; 2],
        };
        ends.saturated()
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
            let found: Vec<usize> = saturated(&values, Some(1.0), None)
                .into_iter()
                .flatten()
                .collect();
            let at_end = (0..values.len()).filter(|&k| ends.contains(&values[k]));
            assert_eq!(found, at_end.collect::<Vec<_>>());
            assert!(found.len() > 1000);
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
            saturated(&values, Some(1.0), None),
            [100..102, 900..901, 2500..2501, 3000..3001]
        );
    }

    #[test]
    fn what_a_smooth_motion_reaches_is_no_end() {
        assert!(saturated(&swing(1000.0), Some(1.0), None).is_empty());
        // A plateau without noise, reached by a ramp.
        let ramp = |k: i32| f64::from(k.min(600 - k).clamp(0, 100)) * 0.1;
        let values: Vec<f64> = (0..600).map(ramp).collect();
        assert!(saturated(&values, Some(0.1), None).is_empty());
    }

    #[test]
    fn a_stated_full_scale_ends_the_range_on_both_sides() {
        let mut values = swing(1000.0);
        values[7] = 2000.0;
        values[9] = -1999.0;
        values[11] = 1998.0;
        assert_eq!(saturated(&values, Some(1.0), Some(2000.0)), [7..8, 9..10]);
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
        let facts = facts(triad);
        let columns = columns(triad, &facts, step);
        let columns = columns.each_ref();
        [0, 1, 2].map(|axis| clipped(columns, axis, Limit::of_rows(CLIPPED_ROWS)))
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
    /// A third of the record at this level.
    const HIGH: Range<usize> = 6_000..12_000;

    /// Three axes on a grid of one, with noise of these σ where the first is high and elsewhere.
    fn triad(level: f64, sigma: f64, there: [f64; 3]) -> [Vec<f64>; 3] {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        [0, 1, 2].map(|axis| {
            let mut row = |k: usize| {
                let (mean, sigma) = match HIGH.contains(&k) {
                    true => (if axis == 0 { level } else { 300.0 }, there[axis]),
                    false => (100.0, sigma),
                };
                let normal: f64 = StandardNormal.sample(&mut random);
                (mean + sigma * normal).round()
            };
            (0..HELD_ROWS).map(&mut row).collect()
        })
    }

    fn held_by(triad: &[Vec<f64>; 3]) -> [Option<f64>; 2] {
        let facts = facts(triad);
        let columns = columns(triad, &facts, 1.0);
        held(columns.each_ref(), 0, Limit::of_rows(HELD_ROWS))
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
