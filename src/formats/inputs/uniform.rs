//! The uniform clock behind stamps that are rounded, jitter, come late and lack rows.

mod following;
mod late;
mod wander;

use std::path::Path;

use crate::formats::error::{FileError, Place};
use crate::recording::nanoseconds;
use crate::statistics::median;
pub use following::Following;
pub use late::REACH;
use late::punctual;
use wander::Knots;
pub use wander::Wander;

/// The uniform clock of stamps that do not go back.
#[derive(Debug, Clone, PartialEq)]
pub struct Uniform {
    /// Due time of the first sample, s.
    pub first: f64,
    /// s
    pub period: f64,
    /// The number of each row's sample; the first is 0. None where they were given out one by one.
    pub numbers: Vec<usize>,
    /// Stamps against due times, s; where samples wander, against when they are.
    pub jitter_rms: f64,
    pub jitter_max: f64,
    /// The period over the one that was given less one, where stamps contradict that.
    pub off_given: Option<f64>,
    /// When samples are, where that is not as due within half a sample.
    pub wander: Option<Wander>,
}

/// σ that one sound record in ten thousand exceeds.
const BY_CHANCE: f64 = 3.89;
/// Part of a stamp's difference by which the phase of the clock follows it: little, so that jitter
/// averages out …
const PHASE: f64 = 0.02;
/// … and its period, which makes the loop well damped.
const PERIOD: f64 = 0.5 * PHASE * PHASE;
/// A first stamp this near its due time is it, and stamps jitter by no less, s.
const EXACT: f64 = 1e-9;
/// Stamps that give the first phase.
const FIRST: usize = 50;

impl Uniform {
    /// Finds the number of each sample, and the clock that all stamps share. A given period is that of the clock
    /// unless the stamps contradict it. There must be at least two stamps.
    pub fn new(file: &Path, stamps: &[(f64, u64)], given: Option<f64>) -> Result<Self, FileError> {
        Self::counted(file, stamps, given).map(|(clock, _)| clock)
    }

    fn counted(
        file: &Path,
        stamps: &[(f64, u64)],
        given: Option<f64>,
    ) -> Result<(Self, Counting), FileError> {
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
        let clock = |about, given| {
            let gap = |row: usize| gap(file, stamps[row - 1].0, stamps[row]);
            let (clock, counting) = Self::likeliest(stamps, about, given).map_err(gap)?;
            match clock.wander.as_ref().and_then(Wander::stops) {
                Some(number) => {
                    let row = clock.numbers.partition_point(|&of_row| of_row < number);
                    let line = stamps
                        .get(row)
                        .map_or(Place::File, |stamp| Place::Line(stamp.1));
                    Err(not_forward(file, line))
                }
                None => Ok((clock, counting)),
            }
        };
        if let Some(period) = given
            && let Ok((free, counting)) = clock(found, false)
            && free.contradicts(period)
        {
            let off_given = Some(free.period / period - 1.0);
            return Ok((Self { off_given, ..free }, counting));
        }
        clock(given.unwrap_or(found), given.is_some())
    }

    /// Whether stamps drift from a clock of another period, over all of them, by more than jitter makes
    /// a line through them drift, if they are independent, and by more than any of them jitters, if not.
    fn contradicts(&self, period: f64) -> bool {
        let last = self.numbers.last().map_or(0.0, |&last| last as f64);
        let count = self.numbers.len() as f64;
        let drift = (self.period - period).abs() * last;
        let sigma = self.jitter_rms * (12.0 / count).sqrt();
        drift > self.jitter_max.max(BY_CHANCE * sigma).max(EXACT)
    }

    /// The clock that stamps tell best, rows missing where they say so or none at all. Each place where rows are
    /// missing has to make stamps likelier by as much as it takes to name it among all rows (minimum description
    /// length). Err is the row behind a gap that is too long.
    fn likeliest(
        stamps: &[(f64, u64)],
        about: f64,
        given: bool,
    ) -> Result<(Self, Counting), usize> {
        let by_rows = || Self::with_period(stamps, about, given, Counting::ByRows);
        let by_stamps = match Self::with_period(stamps, about, given, Counting::ByStamps) {
            Ok(clock) => clock,
            // Jitter of a sample and more may be counted as gaps without end.
            Err(row) => {
                let clock = by_rows()?;
                let is_near = clock.jitter(stamps) < clock.period;
                return is_near.then_some((clock, Counting::ByRows)).ok_or(row);
            }
        };
        let pairs = by_stamps.numbers.windows(2);
        let gaps = pairs.filter(|pair| pair[1] > pair[0] + 1).count() as f64;
        if gaps > 0.0 {
            let by_rows = by_rows()?;
            let jitter = |clock: &Self| clock.jitter(stamps).max(EXACT);
            let gain = stamps.len() as f64 * (jitter(&by_rows) / jitter(&by_stamps)).ln();
            if gain < gaps * (stamps.len() as f64).ln() {
                return Ok((by_rows, Counting::ByRows));
            }
        }
        Ok((by_stamps, Counting::ByStamps))
    }

    /// RMS of stamps about those near by, s.
    fn jitter(&self, stamps: &[(f64, u64)]) -> f64 {
        let placed = punctual(stamps, self.period);
        self.knots(&placed).jitter().0
    }

    /// How far stamps are off their due times.
    fn knots(&self, times: &[f64]) -> Knots {
        let rows = times.iter().zip(&self.numbers);
        Knots::of(rows.map(|(&time, &number)| (number, time - self.due(number))))
    }

    fn due(&self, number: usize) -> f64 {
        self.first + number as f64 * self.period
    }

    fn with_period(
        stamps: &[(f64, u64)],
        about: f64,
        given: bool,
        counting: Counting,
    ) -> Result<Self, usize> {
        let mut placed = punctual(stamps, about);
        let mut numbers = numbers(&placed, about, given, counting)?;
        let (mut first, mut period) = fit(&placed, &numbers, about, given);
        // A period that jitter and gaps falsified may have lost count once or twice.
        if !given {
            placed = punctual(stamps, period);
            numbers = self::numbers(&placed, period, false, counting)?;
            (first, period) = fit(&placed, &numbers, period, false);
        }

        // Where nothing is rounded the fit must not be.
        if (first - stamps[0].0).abs() < EXACT {
            first = stamps[0].0;
        }
        let mut clock = Self {
            first,
            period,
            numbers,
            jitter_rms: 0.0,
            jitter_max: 0.0,
            off_given: None,
            wander: None,
        };
        let knots = clock.knots(&placed);
        clock.wander = knots.wander(0.0, 0.0, period);
        (clock.jitter_rms, clock.jitter_max) = match clock.wander {
            Some(_) => knots.jitter(),
            None => {
                let rows = stamps.iter().zip(&clock.numbers);
                let offs = rows.map(|(&(time, _), &number)| (time - clock.due(number)).abs());
                let (squares, largest) = offs.fold((0.0, 0.0f64), |(squares, largest), off| {
                    (squares + off * off, largest.max(off))
                });
                ((squares / stamps.len() as f64).sqrt(), largest)
            }
        };
        Ok(clock)
    }

    /// When a sample is after the first is due, s; it need not be a whole one.
    pub fn time(&self, number: f64) -> f64 {
        let time = self.wander.as_ref().map(|wander| wander.time(number));
        time.unwrap_or(number) * self.period
    }

    /// The sample of a time after the first is due, s.
    pub fn number(&self, time: f64) -> f64 {
        let time = time / self.period;
        let number = self.wander.as_ref().map(|wander| wander.number(time));
        number.unwrap_or(time)
    }

    /// What stamps do that no uniform clock does, in a sentence.
    pub fn uneven(&self) -> Option<String> {
        let ms = |time: f64| format!("{:.3} ms", 1e3 * time);
        let sample = ms(self.period);
        if let Some(wander) = &self.wander {
            return Some(format!(
                "By their stamps samples wander by up to {} against an even clock of {sample} a sample: they are \
                 integrated over its samples.",
                ms(wander.largest() * self.period),
            ));
        }
        (self.jitter_max > self.period).then(|| {
            format!(
                "Stamps are late or early by up to {}, more than a sample of {sample}: later ones tell when it was \
                 taken.",
                ms(self.jitter_max),
            )
        })
    }
}

/// By what samples are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Counting {
    ByStamps,
    ByRows,
}

/// Counts samples by steps from row to row, with a clock that follows the stamps slowly.
#[derive(Debug, Clone)]
struct Counter {
    counting: Counting,
    number: usize,
    period: f64,
    due: f64,
    /// Whether the period stays as it is.
    given: bool,
    /// By how much rows at later stamps have to be nearer to them to be missing others, in samples.
    price: f64,
}

impl Counter {
    /// The number of the sample of the first of these times, those of rows that follow one another; it may be beyond
    /// any.
    fn next(&mut self, times: &[f64]) -> f64 {
        let step = match self.counting {
            Counting::ByStamps => 1.0 + self.missing(times),
            Counting::ByRows => 1.0,
        };
        let next = self.number as f64 + step;
        self.number = next as usize;
        self.due += step * self.period;
        let off = times[0] - self.due;
        self.due += PHASE * off;
        if !self.given {
            self.period += PERIOD * off / step;
        }
        next
    }

    /// Samples before the first of these times that have no row: so many as put most rows at their times.
    ///
    /// Rows off by more than a sample do not say by how much; of a Laplacian jitter the distances that are left are
    /// the likelihood.
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
            // What only rows further on ask for is missing before those.
            let from_here_on = gains.iter().all(|&gain| gain > -ALIKE);
            match gains.last() {
                Some(&gain) if from_here_on && gain > price + ALIKE => missing,
                _ => likeliest,
            }
        })
    }
}

/// Distances of stamps that differ by less are the same, whatever rounding says, in samples.
const ALIKE: f64 = 1e-6;
/// Rows that tell whether some are missing before them.
const WITNESSES: usize = 32;

/// What it takes to name a row among so many, in samples of stamps' distances: the logarithm, by the scale of their
/// jitter, which is about what steps are off by as often as not.
fn price(times: &[f64], period: f64) -> f64 {
    let off = |pair: &[f64]| ((pair[1] - pair[0]) / period - 1.0).abs();
    let mut off: Vec<f64> = times.windows(2).map(off).collect();
    median(&mut off).unwrap_or(0.0) * (times.len() as f64).ln()
}

/// Number of each sample; the row after a gap longer than all rows together if there is one.
fn numbers(
    times: &[f64],
    about: f64,
    given: bool,
    counting: Counting,
) -> Result<Vec<usize>, usize> {
    let most = 2 * times.len();
    let mut numbers = Vec::with_capacity(times.len());
    numbers.push(0);
    let mut counter = Counter {
        counting,
        number: 0,
        period: about,
        due: times[0] + phase(times, about),
        given,
        price: price(times, about),
    };
    for row in 1..times.len() {
        if counter.next(&times[row..]) > most as f64 {
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

fn not_forward(file: &Path, place: Place) -> FileError {
    FileError::new(
        file,
        place,
        "times that do not go on from here",
        "times that increase from row to row",
        "Correct the time column or leave out the rows, or name another time column in run.toml.",
    )
}

/// Rows over which steps are compared: more hide jitter, fewer are seldom without a gap. Twice as many, as often as
/// needed, where rows come in bursts.
const SPAN: usize = 8;
/// Spans without a gap are within this of their median, in samples.
const NO_GAP: f64 = 0.8;

/// Mean step where no row is missing. It is free of the rounding that a single printed step keeps.
fn mean_step(stamps: &[(f64, u64)]) -> f64 {
    let rows = stamps.len() - 1;
    // Rows that are missing make this longer, never shorter.
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

/// From the first stamp to its due time by the circular mean of the first stamps' phases, which gaps
/// do not disturb.
fn phase(times: &[f64], period: f64) -> f64 {
    let turn = std::f64::consts::TAU / period;
    let (sin, cos) = times
        .iter()
        .take(FIRST)
        .map(|&time| ((time - times[0]) * turn).sin_cos())
        .fold((0.0, 0.0), |(s, c), (sin, cos)| (s + sin, c + cos));
    f64::atan2(sin, cos) / turn
}

/// First due time and period by least squares of stamps on sample numbers; with a given period the
/// first alone.
fn fit(times: &[f64], numbers: &[usize], about: f64, given: bool) -> (f64, f64) {
    let origin = times[0];
    let count = times.len() as f64;
    let mean = numbers.iter().map(|&n| n as f64).sum::<f64>() / count;
    let off = |time: f64, number: usize| time - origin - number as f64 * about;
    let (mut level, mut slope, mut spread) = (0.0, 0.0, 0.0);
    for (&time, &number) in times.iter().zip(numbers) {
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
