//! Axes that stand still while others go on.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use statrs::function::erf::erf;

use super::chance::Limit;
use crate::recording::ColumnFacts;

/// What a column is judged by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column<'a> {
    pub values: &'a [f64],
    pub facts: &'a ColumnFacts,
    /// What values differ by at least; zero if they are all the same.
    pub step: f64,
    /// Whether values are whole pulses, what is left over being carried into the next.
    pub pulses: bool,
    /// What the instrument's data sheet says.
    pub full_scale: Option<f64>,
}

/// Rows in which noise is measured at one level.
const BLOCK: usize = 64;
/// Part of the blocks that may be quieter than noise at rest: axes stuck for long.
const STUCK_PART: f64 = 0.1;
/// Rows whose sum is hardly rounded.
const SUM: usize = 4;
/// Rows next to a run.
const NEXT: usize = 4 * SUM;
/// σ within which a value is one of a level's.
const OF_LEVEL: f64 = 3.0;
/// Parts of the record in which repeats of repeats are counted.
const PARTS: usize = 32;

impl Column<'_> {
    /// The rows that repeat the one before them so long that a sound axis would not, the first of
    /// equal values left out.
    ///
    /// A sound axis repeats its value because its noise stays within a step of the grid, so that
    /// it has to be improbable in one of three ways, each whatever the rate was meanwhile or wherever
    /// it was just before and after: by the noise that the axis always has, by the level on which it
    /// is, or by the motion that goes on across.
    pub fn stuck(&self, limit: Limit) -> Vec<Range<usize>> {
        if self.step <= 0.0 {
            return Vec::new();
        }
        let probability = self.repeat_probability(self.noise_at_rest(self.blocks()));
        let by_noise = limit.nats / probability.recip().ln();
        let mut stuck = runs(self.values);
        stuck.retain(|run| {
            run.len() as f64 > by_noise
                || self.leaves_its_level(run, limit)
                || self.interrupts_a_motion(run, limit)
        });
        stuck
    }
}

/// Stretches of rows each equal to the one before.
pub(super) fn runs(column: &[f64]) -> Vec<Range<usize>> {
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

impl Column<'_> {
    /// The smallest value and the largest.
    pub fn extremes(&self) -> [f64; 2] {
        [self.facts.smallest, self.facts.largest]
    }

    /// The probability that noise of this variance, steps², repeats a value in the middle of its step.
    pub fn repeats_at_best(variance: f64) -> f64 {
        erf((8.0 * variance).sqrt().recip())
    }

    /// Rows in which noise is measured.
    pub fn blocks(&self) -> impl Iterator<Item = &[f64]> {
        self.values.chunks_exact(BLOCK)
    }

    /// The largest probability that a sample repeats the one before, wherever the true value lies, with white
    /// noise of this variance, steps².
    ///
    /// By the noise at rest a value stays within its step most probably if the truth is in the middle
    /// of it (Anderson's inequality). Noise that is correlated stays longer; it shows in how often
    /// repeats are repeated.
    pub fn repeat_probability(&self, variance: f64) -> f64 {
        let white = Self::repeats_at_best(variance);
        // Pulses count an angle that walks: it stays between two edges of a step with the largest
        // eigenvalue of such a walk (Siegmund's correction of the edges: 0.5826 σ each).
        let walk = -0.5 * std::f64::consts::PI.powi(2) * variance
            / (1.0 + 1.1652 * variance.sqrt()).powi(2);
        let by_noise = match self.pulses && variance < 0.25 {
            true => white.min(walk.exp()),
            false => white,
        };
        by_noise.max(self.repeats_of_repeats())
    }

    /// Variance of white noise that the axis always has, steps², not more than it is: what the grid can
    /// make of a slow motion without noise is taken off.
    pub fn noise_at_rest<'b>(&self, blocks: impl Iterator<Item = &'b [f64]>) -> f64 {
        let origin = self.values[0];
        let of_block = |block: &[f64]| {
            let (mean, slope, variance) = line(block);
            let level = (mean - origin) / self.step;
            let passed = 0.5 * (slope * BLOCK as f64 / self.step).abs();
            // The middle between two steps is where values change between them most.
            let nearest = ((level - 0.5).round() + 0.5 - level).abs() - passed;
            let fraction = 0.5 - nearest.max(0.0);
            variance / self.step.powi(2) - self.of_grid().max(fraction * (1.0 - fraction))
        };
        let mut variances: Vec<f64> = blocks.map(of_block).collect();
        if variances.is_empty() {
            return 0.0;
        }
        let rank = (STUCK_PART * variances.len() as f64) as usize;
        let (_, variance, _) = variances.select_nth_unstable_by(rank, f64::total_cmp);
        variance.max(0.0)
    }

    /// Variance that rounding adds to noise, steps².
    fn of_grid(&self) -> f64 {
        if self.pulses { 1.0 / 6.0 } else { 1.0 / 12.0 }
    }

    /// Of all repeats those that are repeated, in the parts of the record where most are; the longest run
    /// of each part is left out, for the axis may be stuck there.
    fn repeats_of_repeats(&self) -> f64 {
        let part = self.values.len().div_ceil(PARTS).max(BLOCK);
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
        let mut parts: Vec<f64> = self.values.chunks(part).map(of_part).collect();
        let rank = ((1.0 - STUCK_PART) * parts.len() as f64) as usize;
        *parts.select_nth_unstable_by(rank, f64::total_cmp).1
    }

    /// Whether both sides of a run stay on a level on which so many equal values are improbable.
    ///
    /// The rate within may be off from that beside as much as that beside changes in the same time: one
    /// that only touches the value, `a t²` off, is off by 0.6 of that.
    fn leaves_its_level(&self, run: &Range<usize>, limit: Limit) -> bool {
        let least = 8 * SUM;
        let most = (run.len() / 2).max(least);
        // A level may be short.
        let shorter = [least, 2 * least].into_iter().filter(|&half| half < most);
        shorter
            .chain([most])
            .any(|half| self.is_off_level(run, half, limit))
    }

    /// The same with two halves of so many rows on either side.
    fn is_off_level(&self, run: &Range<usize>, half: usize, limit: Limit) -> bool {
        let first = run.start - 1;
        let Some(far_before) = first.checked_sub(2 * half) else {
            return false;
        };
        let Some(after) = self.values.get(run.end..run.end + 2 * half) else {
            return false;
        };
        let before = &self.values[far_before..first];
        let value = self.values[first];
        let halves = [
            &before[..half],
            &before[half..],
            &after[..half],
            &after[half..],
        ];
        // Most values are near the level, and the means of both sides are all that it takes to see that.
        let [left, right] = [halves[1], halves[2]].map(mean);
        let level = 0.5 * (left + right);
        let off = (value - level).abs() / self.step;
        let (length, beside) = (run.len() as f64, half as f64);
        let least = 1.0 / length + 1.0 / beside;
        if off <= least {
            return false;
        }
        // The value was sound when it came, so that it is one of the level's.
        let holds = |side: &[f64], mean: f64| {
            (value - mean).abs() <= self.step + OF_LEVEL * variance(side, mean).sqrt()
                && side.iter().any(|&other| other >= value)
                && side.iter().any(|&other| other <= value)
        };
        if !holds(halves[1], left) || !holds(halves[2], right) {
            return false;
        }
        // Where a motion came to the value or left it, the rows next to the run are on their way.
        let next = [&before[2 * half - NEXT..], &after[..NEXT]].map(mean);
        let pairs = [
            (left, mean(halves[0]), beside),
            (right, mean(halves[3]), beside),
            (left, right, beside),
            (left, next[0], NEXT as f64),
            (right, next[1], NEXT as f64),
        ];
        // Sums of pulses are right to a step, so that means may differ by as much without a change.
        let changes = pairs.map(|(one, other, rows)| {
            let rounded = 1.0 / beside + 1.0 / rows;
            (one - other).abs() / self.step - if self.pulses { rounded } else { 0.0 }
        });
        let change = changes.into_iter().fold(0.0, f64::max);
        // Rounding averages out in sums, which leaves noise and what is left of the motion.
        let sums = |side: &[f64]| {
            let sums: Vec<f64> = side
                .chunks_exact(SUM)
                .map(|rows| rows.iter().sum())
                .collect();
            variance(&sums, mean(&sums))
        };
        let variance =
            halves.map(sums).iter().sum::<f64>() / (4.0 * SUM as f64 * self.step.powi(2));
        let variance = variance.max(self.of_grid() / SUM as f64);
        let noise = (variance * (1.0 / length + 0.5 / beside)).sqrt();
        let freedom = 4.0 * ((half / SUM) as f64 - 1.0);
        off > change + least + limit.of_student(freedom) * noise
    }

    /// Whether a motion goes on across a run as if the run were not there, by the likelihood ratio of a
    /// cubic through both sides and of two parabolas that stop at the run's value and start from it.
    fn interrupts_a_motion(&self, run: &Range<usize>, limit: Limit) -> bool {
        let value = self.values[run.start];
        let resumes = self.values.get(run.end).map(|next| (next - value).abs());
        // Otherwise at most two steps are lost.
        if resumes.is_none_or(|off| off * run.len() as f64 <= 4.0 * self.step) {
            return false;
        }
        [8, 16, 32, 64]
            .into_iter()
            .filter(|&points| run.len() <= points)
            .any(|points| self.is_crossed(run, points, limit) == Some(true))
    }

    fn is_crossed(&self, run: &Range<usize>, points: usize, limit: Limit) -> Option<bool> {
        let value = self.values[run.start];
        let before = run.start.checked_sub(points)?..run.start;
        let after = run.end..run.end + points;
        self.values.get(after.clone())?;
        let in_steps = |k: usize| (self.values[k] - value) / self.step;
        let (count, length) = (points as f64, run.len() as f64);
        // Each side by itself must lead away from the run's value, to where the cubic is. Few sides of a sound
        // axis do, and a line costs least.
        let apart = 0.5 * (count + length);
        let led = |rows: Range<usize>, forth: f64| {
            let values: Vec<f64> = rows.map(in_steps).collect();
            let (mean, slope, variance) = line(&values);
            let spread = count.recip() + 12.0 * apart * apart / count.powi(3);
            let lost = length * (mean + forth * slope * apart);
            (lost, variance.max(self.of_grid()) * spread)
        };
        // In steps, what rounding and what the lines and the cubic leave over allow.
        let is_lost = |lost: f64, variance: f64, noise: f64| {
            lost > 2.0 + limit.sigmas * (variance * length * length + noise * length).sqrt()
        };
        let to = led(before.clone(), 1.0);
        let sign = to.0.signum();
        let leads_away = |(lost, variance): (f64, f64)| is_lost(lost * sign, variance, 0.0);
        if !leads_away(to) {
            return Some(false);
        }
        let from = led(after.clone(), -1.0);
        if !leads_away(from) {
            return Some(false);
        }
        let middle = 0.5 * (run.start + run.end) as f64;
        let scale = (points as f64 + 0.5 * run.len() as f64).recip();
        let time = |k: usize| (k as f64 - middle) * scale;
        let sides: Vec<usize> = before.clone().chain(after.clone()).collect();
        let cubic = |k: usize| [1.0, time(k), time(k).powi(2), time(k).powi(3)];
        // The last sample before the run is sound, too.
        let last = points - 1;
        let others: Vec<usize> = sides
            .iter()
            .copied()
            .filter(|&k| k != before.end - 1)
            .collect();
        let across = fit(&others, cubic, in_steps)?;
        let at = |k: usize| {
            let terms = cubic(k).into_iter().zip(across.0.iter());
            terms.map(|(term, factor)| term * factor).sum::<f64>()
        };
        let rounding = self.of_grid() * sides.len() as f64;
        let left_over = across.1.max(rounding);
        let off = in_steps(sides[last]) - at(sides[last]);
        if off.abs() > limit.sigmas * (left_over / others.len() as f64).sqrt() {
            return Some(false);
        }
        let lost: f64 = run.clone().map(at).sum();
        let crossed = (left_over + off * off).max(rounding);
        let (stop, start) = (time(before.end - 1), time(run.end - 1));
        let powers = |t: f64| [t, t * t, t * t * t];
        let stops = |k: usize| powers(time(k) - stop);
        let starts = |k: usize| powers(time(k) - start);
        let stopped = fit(&before.clone().collect::<Vec<_>>(), stops, in_steps)?.1
            + fit(&after.clone().collect::<Vec<_>>(), starts, in_steps)?.1;
        let ratio = points as f64 * (stopped.max(rounding) / crossed).ln();
        let noise = crossed / sides.len() as f64;
        let mut all = [to, from, (lost, 0.0)].into_iter();
        Some(ratio > limit.nats && all.all(|(lost, of)| is_lost(lost * sign, of, noise)))
    }
}

/// Factors of the terms by least squares and the sum of squares left over.
fn fit<const N: usize>(
    rows: &[usize],
    terms: impl Fn(usize) -> [f64; N],
    value: impl Fn(usize) -> f64,
) -> Option<(DVector<f64>, f64)> {
    let design = DMatrix::from_fn(rows.len(), N, |row, term| terms(rows[row])[term]);
    let values = DVector::from_fn(rows.len(), |row, _| value(rows[row]));
    let normal = design.tr_mul(&design).cholesky()?;
    let factors = normal.solve(&design.tr_mul(&values));
    let left_over = (values - design * &factors).norm_squared();
    Some((factors, left_over))
}

/// Mean and slope of a line through values, and the variance about it.
fn line(values: &[f64]) -> (f64, f64, f64) {
    let count = values.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let mean = values.iter().sum::<f64>() / count;
    let moments = values.iter().enumerate();
    let moment: f64 = moments.map(|(k, value)| (k as f64 - middle) * value).sum();
    let slope = moment * 12.0 / (count * (count * count - 1.0));
    let off = |(k, value): (usize, &f64)| (value - mean - slope * (k as f64 - middle)).powi(2);
    let squares: f64 = values.iter().enumerate().map(off).sum();
    (mean, slope, squares / count)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// About a mean that was measured.
fn variance(values: &[f64], mean: f64) -> f64 {
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    squares / (values.len() as f64 - 1.0)
}

#[cfg(test)]
mod tests;
