//! Determines the sample number of each row from stamps with jitter, delays, bursts and missing rows.

use std::collections::VecDeque;

use super::median;

/// Number of later rows that can reveal that a row is late. No burst is longer, and an approximate period suffices over
/// so few rows.
pub const REACH: usize = 128;
/// Fraction of the difference of a stamp by which the clock phase follows it, small enough to average jitter …
const PHASE: f64 = 0.02;
/// … and fraction for the period, for a well-damped loop.
const PERIOD: f64 = 0.5 * PHASE * PHASE;
/// Number of stamps for the initial phase.
const FIRST: usize = 50;
/// Stamp differences that differ by less count as equal, because of rounding, in samples.
const ALIKE: f64 = 1e-6;
/// Number of rows that decide whether rows are missing before them.
const WITNESSES: usize = 32;

/// Method of counting samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Counting {
    ByStamps,
    ByRows,
}

/// Counts samples by the time steps between rows, with a clock that slowly follows the stamps.
#[derive(Debug, Clone)]
pub struct Counter {
    counting: Counting,
    /// Whether the period is fixed.
    fixed: bool,
    pub number: usize,
    pub period: f64,
    pub due: f64,
    /// Required reduction of the distance to later stamps if rows are missing, in samples: logarithm of the number of
    /// candidate rows times the jitter scale (median deviation of the steps).
    price: f64,
}

impl Counter {
    /// Starts at the first of these times.
    pub fn new(times: &[f64], period: f64, fixed: bool, counting: Counting) -> Self {
        let off = |pair: &[f64]| ((pair[1] - pair[0]) / period - 1.0).abs();
        let mut off: Vec<f64> = times.windows(2).map(off).collect();
        Self {
            counting,
            fixed,
            number: 0,
            period,
            due: times[0] + phase(times, period),
            price: median(&mut off).unwrap_or(0.0) * (times.len() as f64).ln(),
        }
    }

    /// Sample number of the first of these times of consecutive rows; it may be beyond all others.
    pub fn next(&mut self, times: &[f64]) -> f64 {
        let step = match self.counting {
            Counting::ByStamps => 1.0 + self.missing(times),
            Counting::ByRows => 1.0,
        };
        let next = self.number as f64 + step;
        self.number = next as usize;
        self.due += step * self.period;
        let off = times[0] - self.due;
        self.due += PHASE * off;
        if !self.fixed {
            self.period += PERIOD * off / step;
        }
        next
    }

    /// Missing samples before the first of these times: the number that matches most rows with their times.
    ///
    /// Rows that are off by more than a sample are only counted; for Laplacian jitter, the other distances give the
    /// likelihood.
    fn missing(&self, times: &[f64]) -> f64 {
        let rows = times.iter().take(WITNESSES).zip(1..);
        let late = rows.map(|(time, row)| (time - self.due) / self.period - f64::from(row));
        let late: Vec<f64> = match late.clone().next() {
            Some(first) if first >= 0.5 => late.collect(),
            _ => return 0.0,
        };
        let distance = |late: f64, missing: f64| (late - missing).abs().min(1.0);
        let mut some: Vec<f64> = late.iter().map(|late| late.round()).collect();
        some.retain(|&missing| missing > 0.0);
        some.sort_by(f64::total_cmp);
        some.dedup();
        some.into_iter().fold(0.0, |likeliest, missing| {
            let price = if likeliest == 0.0 { self.price } else { 0.0 };
            let gains = late.iter().scan(0.0, |gain, &late| {
                *gain += distance(late, likeliest) - distance(late, missing);
                Some(*gain)
            });
            let gains: Vec<f64> = gains.collect();
            // If only later rows indicate a gap, it is before those rows, not here.
            let from_here_on = gains.iter().all(|&gain| gain > -ALIKE);
            match gains.last() {
                Some(&gain) if from_here_on && gain > price + ALIKE => missing,
                _ => likeliest,
            }
        })
    }
}

/// Offset from the first stamp to its due time, from the circular mean of the first phases (not affected by gaps).
fn phase(times: &[f64], period: f64) -> f64 {
    let turn = std::f64::consts::TAU / period;
    let (sin, cos) = times
        .iter()
        .take(FIRST)
        .map(|&time| ((time - times[0]) * turn).sin_cos())
        .fold((0.0, 0.0), |(s, c), (sin, cos)| (s + sin, c + cos));
    f64::atan2(sin, cos) / turn
}

/// Row times, in which late rows are moved to the latest time that the following rows allow.
///
/// Each row was sampled one period before the next. A stamp that contradicts this by more than a period, beyond jitter
/// and rounding, is due to a busy logger or a burst.
pub fn punctual(stamps: &[(f64, u64)], period: f64) -> Vec<f64> {
    let mut times: Vec<f64> = stamps.iter().map(|&(time, _)| time).collect();
    // Time relative to a clock without gaps. `behind`: later rows that are each earlier than all rows between them and
    // this one.
    let against = |row: usize| stamps[row].0 - stamps[0].0 - row as f64 * period;
    let mut behind: VecDeque<usize> = VecDeque::new();
    for row in (0..stamps.len()).rev() {
        while behind
            .front()
            .is_some_and(|&next| against(next) >= against(row))
        {
            behind.pop_front();
        }
        behind.push_front(row);
        while behind.back().is_some_and(|&last| last > row + REACH) {
            behind.pop_back();
        }
        let late = behind
            .back()
            .map_or(0.0, |&last| against(row) - against(last));
        if late > period {
            times[row] -= late;
        }
    }
    times
}

/// Number of rows over which steps are compared: more rows average jitter, fewer rows are more often without a gap. It
/// is doubled as often as bursts require.
const SPAN: usize = 8;
/// Spans without a gap differ from their median by less than this, in samples.
const NO_GAP: f64 = 0.8;

/// Mean time step without missing rows, unaffected by the rounding of single printed times.
pub fn mean_step(stamps: &[(f64, u64)]) -> f64 {
    let rows = stamps.len() - 1;
    // Missing rows make this step longer, never shorter.
    let longest = (stamps[rows].0 - stamps[0].0) / rows as f64;
    let mut span = SPAN;
    while span < rows {
        let steps = |stamps: &[(f64, u64)]| (stamps[span].0 - stamps[0].0) / span as f64;
        let mut sorted: Vec<f64> = stamps.windows(span + 1).map(steps).collect();
        let all = sorted.len();
        let median = median(&mut sorted).unwrap_or(f64::NAN);
        let within = NO_GAP / span as f64 * median;
        sorted.retain(|step| (step - median).abs() <= within);
        if 2 * sorted.len() > all && median - within <= longest {
            return sorted.iter().sum::<f64>() / sorted.len() as f64;
        }
        span *= 2;
    }
    longest
}
