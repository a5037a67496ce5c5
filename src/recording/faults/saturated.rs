//! Samples at the end of an axis' range.

use std::ops::Range;

use crate::statistics::median;

/// Registers that a column of whole numbers may come from. Shorter ones are left to the spikes, for
/// their ends are values as any other.
const BITS: [i32; 3] = [16, 24, 32];
/// A spike is no longer than this many rows.
const LONGEST_SPIKE: usize = 20;
/// Rows on either side with which it is compared.
const AROUND: usize = 8;
/// It stands out by more than this many times the largest change from row to row there.
const STANDS_OUT: f64 = 8.0;

/// Less than this part of the whole range is no change: the last digits of a number.
const LEAST: f64 = 1e-6;

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
        let sure = extremes.map(|end| self.is_register_end(end) || self.is_reached_by_spikes(end));
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
        let whole = self.step.is_some_and(|step| step.fract() == 0.0) && end.fract() == 0.0;
        whole
            && BITS.into_iter().any(|bits| {
                let half = 2f64.powi(bits - 1);
                // Raw registers have their zero in the middle.
                let offset = || {
                    let middle = 0.5 * half..=1.5 * half;
                    self.median().is_some_and(|median| middle.contains(&median))
                };
                [half - 1.0, 1.0 - half, -half].contains(&end)
                    || ([0.0, 2.0 * half - 1.0].contains(&end) && offset())
            })
    }

    fn is_reached_by_spikes(&self, end: f64) -> bool {
        let runs = self.rows(|value| value == end);
        let count: usize = runs.iter().map(Range::len).sum();
        let spikes = runs.iter().filter(|run| self.is_spike(run));
        let in_spikes: usize = spikes.map(Range::len).sum();
        in_spikes >= 2 && 2 * in_spikes >= count
    }

    /// Whether the values on both sides change far less among themselves than from them to these.
    fn is_spike(&self, run: &Range<usize>) -> bool {
        let end = self.values[run.start];
        let before = &self.values[run.start.saturating_sub(AROUND)..run.start];
        let after = &self.values[run.end..self.values.len().min(run.end + AROUND)];
        let (Some(last), Some(first)) = (before.last(), after.first()) else {
            return false;
        };
        let changes = [before, after].into_iter().flat_map(|side| side.windows(2));
        let largest = changes
            .filter(|pair| pair[0] != end && pair[1] != end)
            .map(|pair| (pair[1] - pair[0]).abs())
            .fold(self.step.unwrap_or(0.0), f64::max)
            .max(LEAST * (self.largest - self.smallest));
        let out = (end - last).abs().min((end - first).abs());
        run.len() <= LONGEST_SPIKE && out > STANDS_OUT * largest
    }

    fn rows(&self, is_end: impl Fn(f64) -> bool) -> Vec<Range<usize>> {
        let mut rows: Vec<Range<usize>> = Vec::new();
        for (k, _) in self.values.iter().enumerate().filter(|(_, v)| is_end(**v)) {
            match rows.last_mut() {
                Some(last) if last.end == k => last.end += 1,
                _ => rows.push(k..k + 1),
            }
        }
        rows
    }

    fn median(&self) -> Option<f64> {
        median(&mut self.values.to_vec())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saturated(values: &[f64], step: Option<f64>, full_scale: Option<f64>) -> Vec<Range<usize>> {
        let column = Column {
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
        (0..5000).map(|k| value(k).round()).collect()
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
