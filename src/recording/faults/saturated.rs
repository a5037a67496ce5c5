//! Samples at the end of an axis' range.

use std::ops::Range;

use crate::statistics::median;

/// Registers that a column may come from. The extreme of a column is at the end of these by chance once in
/// 2¹⁵ columns or less; those of shorter ones are values as any other.
const BITS: [i32; 3] = [16, 24, 32];

/// What is known of a column.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column<'a> {
    pub values: &'a [f64],
    pub smallest: f64,
    pub largest: f64,
    /// The step of its grid.
    pub step: Option<f64>,
    /// What the instrument's data sheet says.
    pub full_scale: Option<f64>,
    /// Rows that stand out from both sides.
    pub spikes: &'a [usize],
    /// Rows that repeat the one before them.
    pub stuck: &'a [Range<usize>],
    /// σ of the noise of an axis that the smallest value holds at rest, and the largest.
    pub held: [Option<f64>; 2],
    /// Whether the smallest value cuts a motion off, and the largest.
    pub clipped: [bool; 2],
}

impl Column<'_> {
    /// Rows whose value is at the end of the range, or beyond.
    pub fn saturated(&self) -> Vec<Range<usize>> {
        let step = self.step.unwrap_or(0.0);
        let is_end: Box<dyn Fn(f64) -> bool> = match self.full_scale {
            // Registers go a step further down than up.
            Some(full) => {
                let zero = self.zero();
                Box::new(move |value: f64| (value - zero).abs() >= (full - step) * (1.0 - 1e-9))
            }
            None => {
                let ends = self.ends();
                if ends.is_empty() {
                    return Vec::new();
                }
                Box::new(move |value| ends.contains(&value))
            }
        };
        self.rows(is_end)
    }

    /// The ends of the range, if rows are there that only an end explains.
    fn ends(&self) -> Vec<f64> {
        let extremes = [self.smallest, self.largest];
        let sure: [bool; 2] = std::array::from_fn(|k| {
            let end = extremes[k];
            self.held[k].is_some()
                || self.clipped[k]
                || self.is_register_end(end)
                || self.is_reached_by_spikes(end)
                || self.stops_motion(end)
        });
        // The range is symmetric, but for a step.
        let slack = 1.5 * self.step.unwrap_or(0.0) + 1e-9 * self.largest.abs();
        let mirrored = (self.smallest + self.largest).abs() <= slack;
        (0..2)
            .filter(|&k| sure[k] || (mirrored && sure[1 - k]))
            .map(|k| extremes[k])
            .collect()
    }

    /// What a register says at zero: the middle of its range if it has no sign.
    fn zero(&self) -> f64 {
        let unsigned = |bits: i32| {
            let half = 2f64.powi(bits - 1);
            let around = (0.5 * half..=1.5 * half).contains(&self.median()?);
            (self.smallest >= 0.0 && self.largest < 2.0 * half && around).then_some(half)
        };
        let whole = self.step.is_some_and(|step| step.fract() == 0.0);
        let zero = BITS.into_iter().filter(|_| whole).find_map(unsigned);
        zero.unwrap_or(0.0)
    }

    fn is_register_end(&self, end: f64) -> bool {
        let Some(step) = self.step else {
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
            .filter(|&&k| self.values[k] == end)
            .count()
            >= 2
    }

    /// Whether an axis is stuck there, with a truth that comes from one side and goes back to it.
    fn stops_motion(&self, end: f64) -> bool {
        let at_end = |run: &&Range<usize>| self.values[run.start] == end;
        self.stuck
            .iter()
            .filter(at_end)
            .any(|run| !is_level(self.values, run, self.step.unwrap_or(0.0)))
    }

    /// Rows at an end. Where it is one that holds the axis at rest, with the rows between that noise takes from
    /// beyond it into the range, for their mean is off; and without those that noise takes to it from within.
    fn rows(&self, is_end: impl Fn(f64) -> bool) -> Vec<Range<usize>> {
        let noise = self.held.into_iter().flatten().reduce(f64::max);
        let is_cut = |rows: Range<usize>| {
            let end = self.values[rows.end];
            let near = |value: &f64| noise.is_some_and(|sigma| (value - end).abs() <= FAR * sigma);
            rows.len() <= APART && self.values[rows].iter().all(near)
        };
        let mut rows: Vec<(Range<usize>, usize)> = Vec::new();
        for (k, _) in self.values.iter().enumerate().filter(|(_, v)| is_end(**v)) {
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

#[cfg(test)]
mod tests {
    use super::super::chance::Limit;
    use super::super::spikes::spikes;
    use super::*;

    fn saturated(values: &[f64], step: Option<f64>, full_scale: Option<f64>) -> Vec<Range<usize>> {
        let rest = vec![0.0; values.len()];
        let mut columns = [rest.as_slice(); 6];
        columns[0] = values;
        let limit = Limit::of_rows(values.len());
        let [spikes, ..] = spikes(&columns, &[step.unwrap_or(0.0); 6], limit);
        let column = Column {
            spikes: &spikes,
            stuck: &[],
            held: [None; 2],
            clipped: [false; 2],
            values,
            smallest: values.iter().copied().fold(f64::INFINITY, f64::min),
            largest: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            step,
            full_scale,
        };
        column.saturated()
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
}
