//! The uniform clock behind stamps that are rounded, jitter and lack rows.

mod following;

use std::path::Path;

use super::error::{FileError, Place};
use crate::recording::nanoseconds;
use crate::statistics::median;
pub(super) use following::Following;

/// The uniform clock of increasing stamps.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Uniform {
    /// Due time of the first sample, s.
    pub first: f64,
    /// s
    pub period: f64,
    /// The number of each row's sample; the first is 0. None where they were given out one by one.
    pub numbers: Vec<usize>,
    /// Stamps against due times, s.
    pub jitter_rms: f64,
    pub jitter_max: f64,
    /// The period over the one that was given less one, where stamps contradict that.
    pub off_given: Option<f64>,
}

/// σ that one sound record in ten thousand exceeds.
const BY_CHANCE: f64 = 3.89;
/// Part of a stamp's difference by which the phase of the clock follows it: little, so that jitter
/// averages out …
const PHASE: f64 = 0.02;
/// … and its period, which makes the loop well damped.
const PERIOD: f64 = 0.5 * PHASE * PHASE;
/// A first stamp this near its due time is it, s.
const EXACT: f64 = 1e-9;
/// Stamps that give the first phase.
const FIRST: usize = 50;

impl Uniform {
    /// Finds the number of each sample, and the clock that all stamps share within half a period. A
    /// given period is that of the clock unless the stamps contradict it. There must be at least two
    /// stamps.
    pub fn new(file: &Path, stamps: &[(f64, u64)], given: Option<f64>) -> Result<Self, FileError> {
        let first = stamps[0];
        let found = mean_step(stamps);
        if let Some(period) = given
            && (found - period).abs() > 0.5 * period
        {
            return Err(FileError::new(
                file,
                Place::Line(first.1),
                format_args!("steps of {} s from row to row", nanoseconds(found)),
                format_args!("sample_period_s = {period} as in run.toml"),
                "Correct sample_period_s, time_unit or the time column.",
            ));
        }
        if let Some(period) = given
            && let Ok(free) = Self::with_period(file, stamps, found, false)
            && free.contradicts(period)
        {
            let off_given = Some(free.period / period - 1.0);
            return Ok(Self { off_given, ..free });
        }
        Self::with_period(file, stamps, given.unwrap_or(found), given.is_some())
    }

    /// Whether stamps drift from a clock of another period, over all of them, by more than jitter makes
    /// a line through them drift, if they are independent, and by more than any of them jitters, if not.
    fn contradicts(&self, period: f64) -> bool {
        let last = self.numbers.last().map_or(0.0, |&last| last as f64);
        let count = self.numbers.len() as f64;
        let drift = (self.period - period).abs() * last;
        let sigma = self.jitter_rms * (12.0 / count).sqrt();
        drift > self.jitter_max.max(BY_CHANCE * sigma)
    }

    fn with_period(
        file: &Path,
        stamps: &[(f64, u64)],
        about: f64,
        given: bool,
    ) -> Result<Self, FileError> {
        let gap = |row: usize| gap(file, stamps[row - 1].0, stamps[row]);

        let mut numbers = numbers(stamps, about, given).map_err(gap)?;
        let (mut first, mut period) = fit(stamps, &numbers, about, given);
        // A period that jitter and gaps falsified may have lost count once or twice.
        if !given {
            numbers = self::numbers(stamps, period, false).map_err(gap)?;
            (first, period) = fit(stamps, &numbers, period, false);
        }

        // Where nothing is rounded the fit must not be.
        if (first - stamps[0].0).abs() < EXACT {
            first = stamps[0].0;
        }
        let (mut squares, mut largest) = (0.0, 0.0f64);
        for (&(time, line), &number) in stamps.iter().zip(&numbers) {
            let due = first + number as f64 * period;
            let off = (time - due).abs();
            if off > 0.5 * period {
                return Err(not_uniform(file, (time, line), number, (due, period)));
            }
            squares += off * off;
            largest = largest.max(off);
        }
        Ok(Self {
            first,
            period,
            numbers,
            jitter_rms: (squares / stamps.len() as f64).sqrt(),
            jitter_max: largest,
            off_given: None,
        })
    }
}

/// Counts samples by steps from row to row, with a clock that follows the stamps slowly.
#[derive(Debug, Clone)]
struct Counter {
    number: usize,
    period: f64,
    due: f64,
    /// Whether the period stays as it is.
    given: bool,
}

impl Counter {
    /// The number of the sample of a stamp, which may be beyond any.
    fn next(&mut self, time: f64) -> f64 {
        let step = ((time - self.due) / self.period).round().max(1.0);
        let next = self.number as f64 + step;
        self.number = next as usize;
        self.due += step * self.period;
        let off = time - self.due;
        self.due += PHASE * off;
        if !self.given {
            self.period += PERIOD * off / step;
        }
        next
    }
}

/// Number of each sample; the row after a gap longer than all rows together if there is one.
fn numbers(stamps: &[(f64, u64)], about: f64, given: bool) -> Result<Vec<usize>, usize> {
    let most = 2 * stamps.len();
    let mut numbers = Vec::with_capacity(stamps.len());
    numbers.push(0);
    let mut counter = Counter {
        number: 0,
        period: about,
        due: stamps[0].0 + phase(stamps, about),
        given,
    };
    for (row, &(time, _)) in stamps.iter().enumerate().skip(1) {
        if counter.next(time) > most as f64 {
            return Err(row);
        }
        numbers.push(counter.number);
    }
    Ok(numbers)
}

fn gap(file: &Path, before: f64, (time, line): (f64, u64)) -> FileError {
    FileError::new(
        file,
        Place::Line(line),
        format_args!("a gap in time from {before} s to {time} s"),
        "fewer rows missing than there are",
        "Correct the clock, or split the record there.",
    )
}

fn not_uniform(
    file: &Path,
    (time, line): (f64, u64),
    number: usize,
    (due, period): (f64, f64),
) -> FileError {
    FileError::new(
        file,
        Place::Line(line),
        format_args!("time {time} s at sample {}", number + 1),
        format_args!("{} s at {period} s a sample", nanoseconds(due)),
        "Correct sample_period_s, or resample the record to a uniform clock.",
    )
}

/// Rows over which steps are compared: more hide jitter, fewer are seldom without a gap.
const SPAN: usize = 8;
/// Spans without a gap are within this part of their median.
const NO_GAP: f64 = 0.8 / SPAN as f64;

/// Mean step where no row is missing. It is free of the rounding that a single printed step keeps.
fn mean_step(stamps: &[(f64, u64)]) -> f64 {
    let span = SPAN.min(stamps.len() - 1);
    let steps = |stamps: &[(f64, u64)]| (stamps[span].0 - stamps[0].0) / span as f64;
    let mut sorted: Vec<f64> = stamps.windows(span + 1).map(steps).collect();
    let median = median(&mut sorted).unwrap_or(f64::NAN);
    sorted.retain(|step| (step - median).abs() <= NO_GAP * median);
    sorted.iter().sum::<f64>() / sorted.len() as f64
}

/// From the first stamp to its due time by the circular mean of the first stamps' phases, which gaps
/// do not disturb.
fn phase(stamps: &[(f64, u64)], period: f64) -> f64 {
    let turn = std::f64::consts::TAU / period;
    let (sin, cos) = stamps
        .iter()
        .take(FIRST)
        .map(|&(time, _)| ((time - stamps[0].0) * turn).sin_cos())
        .fold((0.0, 0.0), |(s, c), (sin, cos)| (s + sin, c + cos));
    f64::atan2(sin, cos) / turn
}

/// First due time and period by least squares of stamps on sample numbers; with a given period the
/// first alone.
fn fit(stamps: &[(f64, u64)], numbers: &[usize], about: f64, given: bool) -> (f64, f64) {
    let origin = stamps[0].0;
    let count = stamps.len() as f64;
    let mean = numbers.iter().map(|&n| n as f64).sum::<f64>() / count;
    let off = |time: f64, number: usize| time - origin - number as f64 * about;
    let (mut level, mut slope, mut spread) = (0.0, 0.0, 0.0);
    for (&(time, _), &number) in stamps.iter().zip(numbers) {
        let from_mean = number as f64 - mean;
        level += off(time, number) / count;
        slope += off(time, number) * from_mean;
        spread += from_mean * from_mean;
    }
    let correction = if given { 0.0 } else { slope / spread };
    (origin + level - correction * mean, about + correction)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uniform(times: impl IntoIterator<Item = f64>) -> Uniform {
        let stamps: Vec<_> = times.into_iter().zip(2..).collect();
        Uniform::new(Path::new("imu.csv"), &stamps, None).unwrap()
    }

    /// An even spread of fractions without a pattern.
    fn scatter(k: usize) -> f64 {
        (k as f64 * 0.618_033_988_749_895).fract()
    }

    #[test]
    fn stamps_rounded_to_milliseconds_keep_their_rate() {
        let period = 1.0 / 204.8;
        let clock = uniform((0..20_000).map(|k| (f64::from(k) * period * 1e3).round() / 1e3));
        assert_eq!(clock.numbers, (0..20_000).collect::<Vec<_>>());
        assert!((clock.period / period - 1.0).abs() < 1e-6);
        assert!((clock.jitter_rms - 1e-3 / 12f64.sqrt()).abs() < 1e-5);
    }

    #[test]
    fn a_given_period_holds_within_jitter_and_yields_to_stamps_beyond() {
        let jitter = |k: usize| 0.3 * (scatter(k) - 0.5);
        let stamps: Vec<_> = (0..20_000)
            .map(|k| (7.0 + 0.01 * (k as f64 + jitter(k)), 2 + k as u64))
            .collect();
        for (given, off) in [
            (0.01, None),
            (0.010_001, Some(-1e-4)),
            (0.0099, Some(0.01 / 0.0099 - 1.0)),
        ] {
            let clock = Uniform::new(Path::new("imu.csv"), &stamps, Some(given)).unwrap();
            assert_eq!(clock.numbers, (0..20_000).collect::<Vec<_>>());
            assert!((clock.period / 0.01 - 1.0).abs() < 1e-7);
            assert_eq!(clock.off_given.is_some(), off.is_some(), "{given}");
            let found = clock.off_given.unwrap_or(0.0);
            assert!((found - off.unwrap_or(0.0)).abs() < 1e-6, "{given} {found}");
        }
    }

    #[test]
    fn rows_are_missing_where_stamps_say_so_in_spite_of_jitter() {
        let there = |k: &usize| !(k % 37 == 5 || (700..900).contains(k));
        let kept: Vec<usize> = (0..5000).filter(there).collect();
        let jitter = |k: usize| 0.9 * (scatter(k) - 0.5);
        let clock = uniform(kept.iter().map(|&k| 7.0 + 0.01 * (k as f64 + jitter(k))));
        assert_eq!(clock.numbers, kept);
        assert!((clock.period - 0.01).abs() < 1e-6, "{}", clock.period);
        assert!((clock.first - 7.0).abs() < 2e-4, "{}", clock.first);
    }
}
