//! Detection of axes that stay at one value while the instrument is working: stuck within their range, or clipped at
//! its end.
//!
//! A working axis repeats a value only while its noise and motion stay within one step of its output. A run of equal
//! values is a fault if it is improbable. The test compares the run with the noise of the axis at rest, the level
//! on either side, the motion that crosses the run and, at an end of the range, the motion on either side.

mod ends;

use std::ops::Range;

use nalgebra::{SMatrix, SVector};
use statrs::function::erf::erf;

use super::chance::Limit;
use super::line::{mean, mean_and_slope};
use crate::recording::ColumnFacts;
use crate::statistics::median;
pub use ends::saturated;

/// Rows in which noise is measured at one level.
const BLOCK: usize = 64;
/// Fraction of blocks that may be quieter than noise at rest, for axes stuck for a long time.
const STUCK_PART: f64 = 0.1;
/// Number of rows whose sum is nearly free of rounding.
const SUM: usize = 4;
/// Number of rows next to a run that are averaged.
const NEXT: usize = 4 * SUM;
/// Number of parts of the recording in which repeats of repeats are counted.
const PARTS: usize = 32;
/// Number of rows on either side of a run that show how a motion continues.
const CLOSE: usize = 16;
/// Median magnitude of second differences of white noise over its σ: √6 times that of a normal variate.
const OF_SECOND_DIFFERENCES: f64 = 2.449_489_742_783_178 * 0.674_489_750_196_081_7;

/// A column with the statistics that its tests need.
pub struct Axis<'a> {
    values: &'a [f64],
    facts: &'a ColumnFacts,
    /// Smallest difference of values; zero if they are all equal.
    step: f64,
    /// Whether values are whole pulses, with the remainder carried into the next value.
    pulses: bool,
    /// Runs of rows equal to the previous row.
    runs: Vec<Range<usize>>,
    /// Variance of the noise at rest, steps², from rows that are not at an extreme: an axis clipped over a whole dwell
    /// shows no noise there.
    noise: f64,
    /// Fraction of repeats that are repeated again, which shows correlated noise.
    repeated: f64,
}

impl<'a> Axis<'a> {
    pub fn of(values: &'a [f64], facts: &'a ColumnFacts, step: f64, pulses: bool) -> Self {
        let ends = [facts.smallest, facts.largest];
        let is_free = |block: &&[f64]| !block.iter().any(|value| ends.contains(value));
        let blocks = values.chunks_exact(BLOCK);
        let free: Vec<f64> = blocks.filter(is_free).flatten().copied().collect();
        // An axis with few distinct values is at an extreme everywhere.
        let is_enough = free.len() as f64 > STUCK_PART * values.len() as f64;
        let free = if is_enough { &free } else { values };
        let axis = Self {
            values,
            facts,
            step,
            pulses,
            runs: runs(values),
            noise: 0.0,
            repeated: repeats_of_repeats(free),
        };
        if step > 0.0 {
            Self {
                noise: axis.noise_at_rest(free),
                ..axis
            }
        } else {
            axis
        }
    }

    /// Rows that repeat the previous value for longer than a working axis does; the first of the equal values is not
    /// included.
    pub fn stuck(&self, limit: Limit) -> Vec<Range<usize>> {
        if self.step <= 0.0 {
            return Vec::new();
        }
        let by_noise = limit.nats / self.nats(self.noise);
        let is_stuck = |run: &&Range<usize>| {
            run.len() as f64 > by_noise
                || self.leaves_its_level(run, limit)
                || self.interrupts_a_motion(run, limit)
        };
        self.runs.iter().filter(is_stuck).cloned().collect()
    }

    /// −ln of the largest probability, for any true value, that a sample repeats the previous one, with white noise of
    /// this variance, steps².
    ///
    /// With the noise at rest, a value is most likely to stay within its step if the true value is in the middle of it
    /// (Anderson's inequality). Correlated noise stays longer; this is visible in the fraction of repeated repeats.
    fn nats(&self, variance: f64) -> f64 {
        let white = repeats_at_best(variance);
        // Pulses count an angle that performs a random walk. The probability that it stays between the two edges of a
        // step is the largest eigenvalue of such a walk (Siegmund's correction of the edges: 0.5826 σ each).
        let walk = -0.5 * std::f64::consts::PI.powi(2) * variance
            / (1.0 + 1.1652 * variance.sqrt()).powi(2);
        let by_noise = if self.pulses && variance < 0.25 {
            white.min(walk.exp())
        } else {
            white
        };
        by_noise.max(self.repeated).recip().ln()
    }

    /// Lower bound for the variance of the axis' white noise, steps²: the variance that the grid can cause in a
    /// slow motion without noise is subtracted.
    fn noise_at_rest(&self, values: &[f64]) -> f64 {
        let origin = self.values[0];
        let of_block = |block: &[f64]| {
            let (mean, slope, variance) = line(block);
            let level = (mean - origin) / self.step;
            let passed = 0.5 * (slope * BLOCK as f64 / self.step).abs();
            // Values change most between two steps if the true value is midway between them.
            let nearest = ((level - 0.5).round() + 0.5 - level).abs() - passed;
            let fraction = 0.5 - nearest.max(0.0);
            variance / self.step.powi(2) - self.of_grid().max(fraction * (1.0 - fraction))
        };
        let mut variances: Vec<f64> = values.chunks_exact(BLOCK).map(of_block).collect();
        if variances.is_empty() {
            return 0.0;
        }
        let rank = (STUCK_PART * variances.len() as f64) as usize;
        let (_, variance, _) = variances.select_nth_unstable_by(rank, f64::total_cmp);
        variance.max(0.0)
    }

    /// Variance of white noise with the median second difference of these rows, steps²: the median ignores the few rows
    /// where a motion starts or ends.
    fn unrest(&self, rows: Range<usize>) -> f64 {
        let second = |three: &[f64]| (three[0] - 2.0 * three[1] + three[2]).abs();
        let mut sizes: Vec<f64> = self.values[rows].windows(3).map(second).collect();
        match median(&mut sizes) {
            Some(size) if self.step > 0.0 => (size / (OF_SECOND_DIFFERENCES * self.step)).powi(2),
            _ => 0.0,
        }
    }

    /// Variance of white noise on the quieter side of these rows, because a motion may start or end on the other side;
    /// zero at the start and the end of the recording.
    fn unrest_beside(&self, rows: &Range<usize>) -> f64 {
        let Some(before) = rows.start.checked_sub(CLOSE) else {
            return 0.0;
        };
        if rows.end + CLOSE > self.values.len() {
            return 0.0;
        }
        let before = self.unrest(before..rows.start);
        before.min(self.unrest(rows.end..rows.end + CLOSE))
    }

    /// Variance of rounding, steps².
    fn of_grid(&self) -> f64 {
        if self.pulses { 1.0 / 6.0 } else { 1.0 / 12.0 }
    }

    /// Whether both sides of a run remain at a level at which that many equal values are improbable.
    ///
    /// The rate within the run may differ from the rate next to it by as much as the latter changes in the same time. A
    /// parabola `a t²` that only touches the value differs by 0.6 of that.
    fn leaves_its_level(&self, run: &Range<usize>, limit: Limit) -> bool {
        let least = 8 * SUM;
        let most = (run.len() / 2).max(least);
        // A level may be short.
        let shorter = [least, 2 * least].into_iter().filter(|&half| half < most);
        let mut halves = shorter.chain([most]);
        halves.any(|half| self.is_off_level(run, half, limit) == Some(true))
    }

    /// Whether the value of a run differs from the level on both sides, with two halves of this many rows on either
    /// side.
    fn is_off_level(&self, run: &Range<usize>, half: usize, limit: Limit) -> Option<bool> {
        let first = run.start - 1;
        let before = &self.values[first.checked_sub(2 * half)?..first];
        let after = self.values.get(run.end..run.end + 2 * half)?;
        let value = self.values[first];
        let halves = [
            &before[..half],
            &before[half..],
            &after[..half],
            &after[half..],
        ];
        let means = halves.map(mean);
        let off = (value - 0.5 * (means[1] + means[2])).abs() / self.step;
        let (length, beside) = (run.len() as f64, half as f64);
        let least = 1.0 / length + 1.0 / beside;
        // The first of the equal values was correct, so it belongs to the level.
        let has = |side: &[f64]| {
            side.iter().any(|&other| other >= value) && side.iter().any(|&other| other <= value)
        };
        if off <= least || !has(halves[1]) || !has(halves[2]) {
            return Some(false);
        }
        // If a motion reached or left the value, the rows next to the run are part of that motion.
        let next = [&before[2 * half - NEXT..], &after[..NEXT]].map(mean);
        let all = || means.into_iter().chain(next);
        let spread = all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min);
        // Sums of pulses are accurate to one step, so means may differ by this amount without a change.
        let rounded = if self.pulses {
            1.0 / beside + 1.0 / NEXT as f64
        } else {
            0.0
        };
        let change = (spread / self.step - rounded).max(0.0);
        // Rounding averages out in sums; noise and the rest of the motion remain.
        let sums = |side: &[f64]| {
            let sums = side.chunks_exact(SUM).map(|rows| rows.iter().sum());
            variance(&sums.collect::<Vec<f64>>())
        };
        let variance =
            halves.map(sums).iter().sum::<f64>() / (4.0 * SUM as f64 * self.step.powi(2));
        let variance = variance.max(self.of_grid() / SUM as f64);
        let noise = (variance * (1.0 / length + 0.5 / beside)).sqrt();
        let freedom = 4.0 * ((half / SUM) as f64 - 1.0);
        Some(off > change + least + limit.of_student(freedom) * noise)
    }

    /// Whether a motion continues across a run as if the run were not there.
    fn interrupts_a_motion(&self, run: &Range<usize>, limit: Limit) -> bool {
        let value = self.values[run.start];
        let resumes = self.values.get(run.end).map(|next| (next - value).abs());
        // Otherwise at most two steps are lost.
        if resumes.is_none_or(|off| off * run.len() as f64 <= 4.0 * self.step) {
            return false;
        }
        let mut points = [8, 16, 32, 64]
            .into_iter()
            .filter(|points| run.len() <= *points);
        points.any(|points| self.is_crossed(run, points, limit) == Some(true))
    }

    /// The side of the run's value to which lines through the rows before and through those after extrapolate, if they
    /// agree. This inexpensive test excludes most runs of a working axis.
    fn led_past(&self, run: &Range<usize>, points: usize, limit: Limit) -> Option<f64> {
        let (count, length) = (points as f64, run.len() as f64);
        let apart = 0.5 * (count + length);
        let lost = |rows: Option<&[f64]>, forth: f64| {
            let (mean, slope, variance) = line(rows?);
            let off = (mean - self.values[run.start] + forth * slope * apart) / self.step;
            let variance = (variance / self.step.powi(2)).max(self.of_grid());
            let spread = count.recip() + 12.0 * apart * apart / count.powi(3);
            // Variances of the extrapolated line and of the rows.
            let variance = variance * length * (spread * length + 1.0);
            is_lost(length * off.abs(), variance, limit).then_some(off.signum())
        };
        let before = run.start.checked_sub(points);
        let before = before.and_then(|begin| self.values.get(begin..run.start));
        let after = self.values.get(run.end..run.end + points);
        lost(before, 1.0).filter(|side| lost(after, -1.0) == Some(*side))
    }

    /// Whether a cubic through both sides of a run is more likely than two parabolas that end and start at its value.
    fn is_crossed(&self, run: &Range<usize>, points: usize, limit: Limit) -> Option<bool> {
        let side = self.led_past(run, points, limit)?;
        let before = run.start.checked_sub(points)?..run.start;
        let after = run.end..run.end + points;
        let value = self.values[run.start];
        let in_steps = |k: usize| (self.values[k] - value) / self.step;
        let middle = 0.5 * (run.start + run.end) as f64;
        let scale = (points as f64 + 0.5 * run.len() as f64).recip();
        let powers = |k: usize, from: f64| {
            let t = (k as f64 - from) * scale;
            [t, t * t, t * t * t]
        };
        let cubic = |k: usize| {
            let [x, y, z] = powers(k, middle);
            SVector::from([1.0, x, y, z])
        };
        let from = |from: usize| move |k| SVector::from(powers(k, from as f64));
        // The last sample before the run is also correct.
        let last = run.start - 1;
        let others = (before.start..last).chain(after.clone());
        let (factors, left_over) = fit(others, cubic, in_steps)?;
        let off = factors.dot(&cubic(last));
        let count = 2.0 * points as f64;
        let rounding = self.of_grid() * count;
        if off.abs() > limit.sigmas * (left_over.max(rounding) / (count - 1.0)).sqrt() {
            return Some(false);
        }
        let crossed = (left_over + off * off).max(rounding);
        let (_, stopped) = fit(before, from(last), in_steps)?;
        let (_, started) = fit(after, from(run.end - 1), in_steps)?;
        let ratio = points as f64 * ((stopped + started).max(rounding) / crossed).ln();
        let lost: f64 = run.clone().map(|k| factors.dot(&cubic(k))).sum();
        let noise = crossed / count * run.len() as f64;
        Some(ratio > limit.nats && is_lost(lost * side, noise, limit))
    }
}

/// Whether the lost steps exceed rounding and an error of this variance.
fn is_lost(lost: f64, variance: f64, limit: Limit) -> bool {
    lost > 2.0 + limit.sigmas * variance.sqrt()
}

/// Stretches of rows that are each equal to the previous row.
fn runs(column: &[f64]) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = 1;
    for k in 1..=column.len() {
        if k == column.len() || column[k] != column[k - 1] {
            if k > start {
                runs.push(start..k);
            }
            start = k + 1;
        }
    }
    runs
}

/// The probability that noise of this variance, steps², repeats a value in the middle of its step.
fn repeats_at_best(variance: f64) -> f64 {
    erf((8.0 * variance).sqrt().recip())
}

/// Fraction of repeats that are repeated again, in the parts of the recording with most of them; the longest run
/// of each part is excluded, because the axis may be stuck there.
fn repeats_of_repeats(values: &[f64]) -> f64 {
    let part = values.len().div_ceil(PARTS).max(BLOCK);
    let of_part = |values: &[f64]| {
        let lengths: Vec<usize> = runs(values).iter().map(Range::len).collect();
        let repeats = lengths.iter().sum::<usize>() - lengths.iter().max().unwrap_or(&0);
        let runs = lengths.len().saturating_sub(1);
        if repeats > 0 {
            (repeats - runs) as f64 / repeats as f64
        } else {
            0.0
        }
    };
    let mut parts: Vec<f64> = values.chunks(part).map(of_part).collect();
    let rank = ((1.0 - STUCK_PART) * parts.len() as f64) as usize;
    *parts.select_nth_unstable_by(rank, f64::total_cmp).1
}

/// Coefficients of the terms by least squares, and the residual sum of squares.
fn fit<const N: usize>(
    rows: impl Iterator<Item = usize> + Clone,
    terms: impl Fn(usize) -> SVector<f64, N>,
    value: impl Fn(usize) -> f64,
) -> Option<(SVector<f64, N>, f64)> {
    let (mut normal, mut right) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
    for k in rows.clone() {
        normal += terms(k) * terms(k).transpose();
        right += terms(k) * value(k);
    }
    let factors = normal.cholesky()?.solve(&right);
    let off = |k: usize| (value(k) - terms(k).dot(&factors)).powi(2);
    Some((factors, rows.map(off).sum()))
}

/// Mean and slope of a line through values, and the variance about it.
fn line(values: &[f64]) -> (f64, f64, f64) {
    let (mean, slope) = mean_and_slope(values);
    let middle = 0.5 * (values.len() as f64 - 1.0);
    let off = |(k, value): (usize, &f64)| (value - mean - slope * (k as f64 - middle)).powi(2);
    let squares: f64 = values.iter().enumerate().map(off).sum();
    (mean, slope, squares / values.len() as f64)
}

/// Variance about the mean.
fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    squares / (values.len() as f64 - 1.0)
}

#[cfg(test)]
mod tests;
