//! The uniform clock of a log too long to keep its stamps.

use std::path::{Path, PathBuf};

use super::{BY_CHANCE, Counter, EXACT, Knots, Uniform, Wander, gap, not_forward, price, punctual};
use crate::formats::error::{FileError, Place};

/// Rows of which the earliest and the latest stamp are kept.
const BUCKET: usize = 4096;

/// Follows stamps as they come, and says at the end what clock they shared.
#[derive(Debug)]
pub struct Following {
    file: PathBuf,
    given: Option<f64>,
    counter: Counter,
    /// Stamps are referred to the first of them and to a clock of about their period.
    origin: f64,
    about: f64,
    last: f64,
    sums: Sums,
    knots: Knots,
    ends: Vec<[Stamp; 2]>,
}

/// A stamp off the clock that stamps are referred to, s.
#[derive(Debug, Clone, Copy)]
struct Stamp {
    off: f64,
    number: usize,
}

/// Sums over stamps, of which n is the number of the sample and x how far it is off.
#[derive(Debug, Default)]
struct Sums {
    count: usize,
    n: f64,
    nn: f64,
    x: f64,
    xn: f64,
    xx: f64,
}

impl Following {
    /// Takes up the clock of the first stamps, and gives the numbers of their samples.
    pub fn new(
        file: &Path,
        stamps: &[(f64, u64)],
        given: Option<f64>,
    ) -> Result<(Self, Vec<usize>), FileError> {
        let (clock, counting) = Uniform::counted(file, stamps, given)?;
        let number = clock.numbers.last().copied().unwrap_or(0);
        let due = clock.first + clock.time(number as f64);
        let Uniform {
            period,
            numbers,
            off_given,
            ..
        } = clock;
        let placed = punctual(stamps, period);
        let mut following = Self {
            file: file.to_owned(),
            given,
            counter: Counter {
                counting,
                number,
                period,
                due,
                given: given.is_some() && off_given.is_none(),
                price: price(&placed, period),
            },
            origin: stamps[0].0,
            about: period,
            last: stamps[0].0,
            sums: Sums::default(),
            knots: Knots::default(),
            ends: Vec::new(),
        };
        for ((&(time, _), placed), &number) in stamps.iter().zip(placed).zip(&numbers) {
            following.add(time, placed, number);
        }
        Ok((following, numbers))
    }

    /// The numbers of the samples of the next so many rows, of which as many more should be given as tell whether a
    /// row is late.
    pub fn numbers(
        &mut self,
        stamps: &[(f64, u64)],
        count: usize,
    ) -> Result<Vec<usize>, FileError> {
        let placed = punctual(stamps, self.about);
        let rows = stamps.iter().enumerate().take(count);
        rows.map(|(row, &stamp)| {
            let before = self.last;
            if self.counter.next(&placed[row..]) > 2.0 * self.sums.count as f64 {
                return Err(gap(&self.file, before, stamp));
            }
            let number = self.counter.number;
            self.add(stamp.0, placed[row], number);
            Ok(number)
        })
        .collect()
    }

    /// About how long a sample is, s.
    pub fn period(&self) -> f64 {
        self.about
    }

    fn add(&mut self, time: f64, placed: f64, number: usize) {
        self.last = time;
        let n = number as f64;
        let due = self.origin + n * self.about;
        let stamp = Stamp {
            off: time - due,
            number,
        };
        let off = placed - due;
        self.knots.push(number, off);
        let Sums {
            count,
            n: sum_n,
            nn,
            x,
            xn,
            xx,
        } = &mut self.sums;
        if count.is_multiple_of(BUCKET) {
            self.ends.push([stamp; 2]);
        }
        if let Some([earliest, latest]) = self.ends.last_mut() {
            if stamp.off < earliest.off {
                *earliest = stamp;
            }
            if stamp.off > latest.off {
                *latest = stamp;
            }
        }
        *count += 1;
        *sum_n += n;
        *nn += n * n;
        *x += off;
        *xn += off * n;
        *xx += off * off;
    }

    /// The clock that all stamps shared, as [`Uniform::new`] finds it.
    pub fn finish(mut self) -> Result<Uniform, FileError> {
        self.knots = self.knots.finish();
        let clock = self.clock();
        match clock.wander.as_ref().and_then(Wander::stops) {
            Some(_) => Err(not_forward(&self.file, Place::File)),
            None => Ok(clock),
        }
    }

    fn clock(&self) -> Uniform {
        let free = self.fit(self.about, false);
        let Some(given) = self.given else {
            return free;
        };
        let drift = (free.period - given).abs() * self.counter.number as f64;
        let sigma = free.jitter_rms * (12.0 / self.sums.count as f64).sqrt();
        if drift > free.jitter_max.max(BY_CHANCE * sigma) {
            return Uniform {
                off_given: Some(free.period / given - 1.0),
                ..free
            };
        }
        self.fit(given, true)
    }

    /// The line through stamps, or the one with this period.
    fn fit(&self, period: f64, given: bool) -> Uniform {
        let Sums {
            count,
            n,
            nn,
            x,
            xn,
            xx,
        } = self.sums;
        let count = count as f64;
        let (mean, level) = (n / count, x / count);
        let spread = nn - n * mean;
        let slope = match given {
            true => period - self.about,
            false => (xn - x * mean) / spread,
        };
        let mut first = self.origin + level - slope * mean;
        if (first - self.origin).abs() < EXACT {
            first = self.origin;
        }
        let period = self.about + slope;
        let wander = self.knots.wander(first - self.origin, slope, period);
        let (jitter_rms, jitter_max) = match wander {
            Some(_) => self.knots.jitter(),
            None => {
                // Off a line through their mean, and that off the clock.
                let covariance = xn - x * mean;
                let about_line = xx - x * level - 2.0 * slope * covariance + slope * slope * spread;
                let line_off = self.origin + level - slope * mean - first;
                let off = |stamp: &Stamp| {
                    (self.origin - first + stamp.number as f64 * -slope + stamp.off).abs()
                };
                let largest = self.ends.iter().flatten().map(off).fold(0.0, f64::max);
                let rms = (about_line.max(0.0) / count + line_off * line_off).sqrt();
                (rms, largest)
            }
        };
        Uniform {
            first,
            period,
            numbers: Vec::new(),
            jitter_rms,
            jitter_max,
            off_given: None,
            wander,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            let (mut following, mut numbers) =
                Following::new(file, &stamps[..20_000], given).unwrap();
            let rest = &stamps[20_000..];
            numbers.extend(following.numbers(rest, rest.len()).unwrap());
            let followed = following.finish().unwrap();
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
        let (mut following, mut numbers) = Following::new(file, &stamps[..20_000], None).unwrap();
        let rest = &stamps[20_000..];
        numbers.extend(following.numbers(rest, rest.len()).unwrap());
        let followed = following.finish().unwrap();
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
