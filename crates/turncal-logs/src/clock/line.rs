//! The line through all stamps of a log, which is the uniform clock of its samples.

use std::path::{Path, PathBuf};

use super::count::{Counter, Counting, mean_step, punctual};
use super::wander::{Knots, Wander};
use turncal_input::units::nanoseconds;
use turncal_input::{FileError, Place};

/// The uniform clock of non-decreasing stamps.
#[derive(Debug, Clone, PartialEq)]
pub struct Uniform {
    /// Due time of the first sample, s.
    pub first: f64,
    /// Sample period, s.
    pub period: f64,
    /// Sample number of each row, from 0. Empty if the sample numbers were returned one by one.
    pub numbers: Vec<usize>,
    /// Deviations of the stamps from the due times, s; for drifting samples, from their own times.
    pub jitter_rms: f64,
    /// Largest deviation from uniform times, s.
    pub jitter_max: f64,
    /// Fitted period divided by the given period, minus one, if the stamps contradict the given period.
    pub off_given: Option<f64>,
    /// Sample times, if they deviate from the due times by more than half a sample.
    pub wander: Option<Wander>,
}

/// σ limit that one flawless recording in ten thousand exceeds.
const BY_CHANCE: f64 = 3.89;
/// A first stamp this close to its due time equals it, and jitter is at least this, s.
const EXACT: f64 = 1e-9;

impl Uniform {
    /// Finds the number of each sample and the common clock of all stamps. A given period is used unless the stamps
    /// contradict it. At least two stamps are required.
    pub fn new(file: &Path, stamps: &[(f64, u64)], given: Option<f64>) -> Result<Self, FileError> {
        let (line, numbers) = Line::new(file, stamps, given)?;
        let clock = line.finish()?;
        Ok(Self { numbers, ..clock })
    }

    /// Time from the due time of the first sample to this sample, s; the sample number may be fractional.
    pub fn time(&self, number: f64) -> f64 {
        let time = self.wander.as_ref().map(|wander| wander.time(number));
        time.unwrap_or(number) * self.period
    }

    /// Sample number at this time after the due time of the first sample, s.
    pub fn number(&self, time: f64) -> f64 {
        let time = time / self.period;
        let number = self.wander.as_ref().map(|wander| wander.number(time));
        number.unwrap_or(time)
    }

    /// Deviation of the stamps from a uniform clock, in a sentence.
    pub fn uneven(&self) -> Option<String> {
        let ms = |time: f64| format!("{:.3} ms", 1e3 * time);
        let sample = ms(self.period);
        if let Some(wander) = &self.wander {
            return Some(format!(
                "The time stamps drift by up to {} from a uniform clock of {sample} per sample. turncal resampled \
                    the data to that clock by integration.",
                ms(wander.largest() * self.period),
            ));
        }
        (self.jitter_max > self.period).then(|| {
            format!(
                "The time stamps jitter by up to {}, more than the sample period of {sample}. turncal fitted a \
                 uniform clock to the time stamps.",
                ms(self.jitter_max),
            )
        })
    }
}

/// Follows stamps one by one and finally returns their common clock.
#[derive(Debug, Clone)]
pub struct Line {
    file: PathBuf,
    given: Option<f64>,
    counter: Counter,
    /// Stamps are relative to the first one and to a clock of about their period.
    origin: f64,
    about: f64,
    /// Period of the first stamps, s.
    period: f64,
    last: f64,
    /// Sums over the unchanged stamps.
    stamps: Sums,
    /// Sums over the stamps, with late rows at the time allowed by the following rows.
    placed: Sums,
    knots: Knots,
    /// Candidates for the stamps farthest below and above a line.
    hulls: [Vec<[f64; 2]>; 2],
}

/// Sums over stamps: n is the sample number, x its deviation, s.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: f64,
    n: f64,
    nn: f64,
    x: f64,
    xn: f64,
    xx: f64,
}

impl Sums {
    fn add(&mut self, n: f64, x: f64) {
        self.count += 1.0;
        self.n += n;
        self.nn += n * n;
        self.x += x;
        self.xn += x * n;
        self.xx += x * x;
    }

    /// Mean square of the distances from a line.
    fn about(&self, level: f64, slope: f64) -> f64 {
        let of_line =
            level * level * self.count + 2.0 * level * slope * self.n + slope * slope * self.nn;
        let squares = self.xx - 2.0 * (level * self.x + slope * self.xn) + of_line;
        squares.max(0.0) / self.count
    }
}

impl Line {
    /// Starts with the clock of the first stamps and returns their sample numbers.
    pub fn new(
        file: &Path,
        stamps: &[(f64, u64)],
        given: Option<f64>,
    ) -> Result<(Self, Vec<usize>), FileError> {
        let found = mean_step(stamps);
        if let Some(period) = given
            && (found - period).abs() > 0.5 * period
        {
            return Err(FileError::new(
                file,
                Place::Line(stamps[0].1),
                format_args!("a time step of {} s between rows", nanoseconds(found)),
                format_args!("{period} s (sample_period_s in run.toml)"),
                "Correct sample_period_s, time_unit or the time column.",
            ));
        }
        let clock = |about, fixed| {
            let gap = |row: usize| gap(file, stamps[row - 1].0, stamps[row]);
            let likeliest = Self::likeliest(stamps, about, fixed).map_err(gap);
            let (line, numbers) = likeliest?;
            let mut line = Self {
                file: file.to_owned(),
                given,
                ..line
            };
            let clock = line.clone().finish()?;
            // Later stamps are counted from the clock that all of these share.
            (line.period, line.counter.period) = (clock.period, clock.period);
            line.counter.due = clock.first + clock.time(line.counter.number as f64);
            Ok(((line, numbers), clock.off_given))
        };
        if given.is_some()
            && let Ok((free, Some(_))) = clock(found, false)
        {
            return Ok(free);
        }
        clock(given.unwrap_or(found), given.is_some()).map(|(line, _)| line)
    }

    /// The most likely count: rows missing according to the stamps, or none. Each gap must raise the likelihood by the
    /// cost of encoding its place among all rows (minimum description length). `Err` is the row after too long a gap.
    fn likeliest(
        stamps: &[(f64, u64)],
        about: f64,
        fixed: bool,
    ) -> Result<(Self, Vec<usize>), usize> {
        let counted = |counting| -> Result<(Self, Vec<usize>), usize> {
            let (line, numbers) = Self::through(stamps, about, fixed, counting)?;
            // With a period distorted by jitter and gaps, the count may have been off once or twice.
            if fixed {
                Ok((line, numbers))
            } else {
                Self::through(stamps, line.free_period(), false, counting)
            }
        };
        let jitter = |line: &Self| line.knots.clone().finish().jitter().0;
        let by_stamps = match counted(Counting::ByStamps) {
            Ok(line) => line,
            // Jitter of a sample and more may be counted as gaps without end.
            Err(row) => {
                let line = counted(Counting::ByRows)?;
                let is_near = jitter(&line.0) < line.0.about;
                return is_near.then_some(line).ok_or(row);
            }
        };
        let pairs = by_stamps.1.windows(2);
        let gaps = pairs.filter(|pair| pair[1] > pair[0] + 1).count() as f64;
        if gaps > 0.0 {
            let by_rows = counted(Counting::ByRows)?;
            let [of_rows, of_stamps] =
                [&by_rows.0, &by_stamps.0].map(|line| jitter(line).max(EXACT));
            let count = stamps.len() as f64;
            if count * (of_rows / of_stamps).ln() < gaps * count.ln() {
                return Ok(by_rows);
            }
        }
        Ok(by_stamps)
    }

    /// Counts stamps with a clock of this period; `Err` is the row after a gap longer than all rows together.
    fn through(
        stamps: &[(f64, u64)],
        about: f64,
        fixed: bool,
        counting: Counting,
    ) -> Result<(Self, Vec<usize>), usize> {
        let placed = punctual(stamps, about);
        let mut line = Self {
            file: PathBuf::new(),
            given: None,
            counter: Counter::new(&placed, about, fixed, counting),
            origin: stamps[0].0,
            about,
            period: about,
            last: stamps[0].0,
            stamps: Sums::default(),
            placed: Sums::default(),
            knots: Knots::default(),
            hulls: [const { Vec::new() }; 2],
        };
        line.add(stamps[0], placed[0]);
        let mut numbers = vec![0];
        for row in 1..stamps.len() {
            if line.counter.next(&placed[row..]) > 2.0 * stamps.len() as f64 {
                return Err(row);
            }
            line.add(stamps[row], placed[row]);
            numbers.push(line.counter.number);
        }
        Ok((line, numbers))
    }

    /// Sample numbers of the next `count` rows; the stamps of the following rows show whether one is late.
    pub fn numbers(
        &mut self,
        stamps: &[(f64, u64)],
        count: usize,
    ) -> Result<Vec<usize>, FileError> {
        let placed = punctual(stamps, self.about);
        let rows = stamps.iter().enumerate().take(count);
        rows.map(|(row, &stamp)| {
            let before = self.last;
            if self.counter.next(&placed[row..]) > 2.0 * self.stamps.count {
                return Err(gap(&self.file, before, stamp));
            }
            self.add(stamp, placed[row]);
            Ok(self.counter.number)
        })
        .collect()
    }

    /// Approximate sample period, s.
    pub fn period(&self) -> f64 {
        self.period
    }

    fn add(&mut self, (time, line): (f64, u64), placed: f64) {
        self.last = time;
        let n = self.counter.number as f64;
        let due = self.origin + n * self.about;
        let (off, placed) = (time - due, placed - due);
        self.stamps.add(n, off);
        self.placed.add(n, placed);
        self.knots.push(self.counter.number, placed, line);
        for (hull, side) in self.hulls.iter_mut().zip([-1.0, 1.0]) {
            let is_within = |[a, b]: [[f64; 2]; 2]| {
                side * ((b[1] - a[1]) * (n - a[0]) - (off - a[1]) * (b[0] - a[0])) <= 0.0
            };
            while hull.last_chunk().is_some_and(|&ends| is_within(ends)) {
                hull.pop();
            }
            hull.push([n, off]);
        }
    }

    /// The common clock of all stamps.
    pub fn finish(mut self) -> Result<Uniform, FileError> {
        self.knots = self.knots.finish();
        let free = self.fit(self.free_period());
        let Some(given) = self.given else {
            return free;
        };
        if let Ok(free) = free
            && self.contradicts(&free, given)
        {
            let off_given = Some(free.period / given - 1.0);
            return Ok(Uniform { off_given, ..free });
        }
        self.fit(given)
    }

    /// Whether stamps drift from a clock of a different period by more than jitter explains, both for independent
    /// jitter and compared with the largest jitter.
    fn contradicts(&self, free: &Uniform, period: f64) -> bool {
        let drift = (free.period - period).abs() * self.counter.number as f64;
        let sigma = free.jitter_rms * (12.0 / self.stamps.count).sqrt();
        drift > free.jitter_max.max(BY_CHANCE * sigma).max(EXACT)
    }

    /// The period of the line through stamps, by least squares.
    fn free_period(&self) -> f64 {
        let Sums {
            count,
            n,
            nn,
            x,
            xn,
            ..
        } = self.placed;
        self.about + (xn - x * (n / count)) / (nn - n * (n / count))
    }

    /// The line of this period through stamps.
    fn fit(&self, period: f64) -> Result<Uniform, FileError> {
        let slope = period - self.about;
        let mut level = (self.placed.x - slope * self.placed.n) / self.placed.count;
        // If the stamps are not rounded, the fit must not round either.
        if level.abs() < EXACT {
            level = 0.0;
        }
        let wander = self.knots.wander(level, slope, period);
        let wander = wander.map_err(|line| not_forward(&self.file, line))?;
        let off = |&[n, off]: &[f64; 2]| (off - level - slope * n).abs();
        let (jitter_rms, jitter_max) = match wander {
            Some(_) => self.knots.jitter(),
            None => (
                self.stamps.about(level, slope).sqrt(),
                self.hulls.iter().flatten().map(off).fold(0.0, f64::max),
            ),
        };
        Ok(Uniform {
            first: self.origin + level,
            period,
            numbers: Vec::new(),
            jitter_rms,
            jitter_max,
            off_given: None,
            wander,
        })
    }
}

fn gap(file: &Path, before: f64, (time, line): (f64, u64)) -> FileError {
    FileError::new(
        file,
        Place::Line(line),
        format_args!("a gap in time from {before} s to {time} s"),
        "fewer missing rows than recorded rows",
        "Correct the clock, or split the recording at this gap.",
    )
}

fn not_forward(file: &Path, line: u64) -> FileError {
    FileError::new(
        file,
        Place::Line(line),
        "times that stop increasing here",
        "times that increase from row to row",
        "Correct the time column, remove these rows, or name another time column in run.toml.",
    )
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

    fn stamps(count: usize, period: f64) -> Vec<(f64, u64)> {
        let there = |k: &usize| k % 41 != 7;
        let jitter = |k: usize| 0.3 * ((k as f64 * 0.618_033_988_749_895).fract() - 0.5);
        let kept = (0..count).filter(there);
        kept.map(|k| (3.0 + period * (k as f64 + jitter(k)), 2 + k as u64))
            .collect()
    }

    #[test]
    fn a_clock_that_is_followed_is_the_one_of_all_stamps() {
        let file = Path::new("imu.csv");
        for given in [None, Some(0.01), Some(0.010_001)] {
            let stamps = stamps(60_000, 0.01);
            let at_once = Uniform::new(file, &stamps, given).unwrap();
            let (mut line, mut numbers) = Line::new(file, &stamps[..20_000], given).unwrap();
            let rest = &stamps[20_000..];
            numbers.extend(line.numbers(rest, rest.len()).unwrap());
            let followed = line.finish().unwrap();
            assert_eq!(numbers, at_once.numbers);
            assert_eq!(followed.off_given.is_some(), at_once.off_given.is_some());
            assert!((followed.first - at_once.first).abs() < 1e-9);
            assert!((followed.period - at_once.period).abs() < 1e-13);
            assert!((followed.jitter_rms / at_once.jitter_rms - 1.0).abs() < 1e-6);
            assert!((followed.jitter_max / at_once.jitter_max - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_clock_that_changes_its_rate_later_wanders() {
        let mut stamps = stamps(60_000, 0.01);
        for (time, line) in &mut stamps {
            *time += 3e-6 * line.saturating_sub(40_000) as f64;
        }
        let file = Path::new("imu.csv");
        let at_once = Uniform::new(file, &stamps, None).unwrap();
        let (mut line, mut numbers) = Line::new(file, &stamps[..20_000], None).unwrap();
        let rest = &stamps[20_000..];
        numbers.extend(line.numbers(rest, rest.len()).unwrap());
        let followed = line.finish().unwrap();
        assert_eq!(numbers, at_once.numbers);
        for clock in [&followed, &at_once] {
            for number in [1e3, 3e4, 39_000.0, 41_000.0, 5e4, 59_000.0] {
                let time = clock.first + clock.time(number);
                let true_time = 3.0 + 0.01 * number + 3e-6 * (number - 39_998.0).max(0.0);
                assert!(
                    (time - true_time).abs() < 1e-3,
                    "{number} {}",
                    time - true_time
                );
                assert!((clock.number(clock.time(number)) - number).abs() < 1e-6);
            }
        }
    }
}
