//! The uniform clock of a log too long to keep its stamps.

use std::path::{Path, PathBuf};

use super::{BY_CHANCE, Counter, EXACT, Uniform, gap, not_uniform};
use crate::formats::error::FileError;

/// Rows of which the earliest and the latest stamp are kept.
const BUCKET: usize = 4096;

/// Follows stamps as they come, and says at the end what clock they shared.
#[derive(Debug)]
pub(in crate::formats) struct Following {
    file: PathBuf,
    given: Option<f64>,
    counter: Counter,
    /// Stamps are referred to the first of them and to a clock of about their period.
    origin: f64,
    about: f64,
    last: f64,
    sums: Sums,
    ends: Vec<[Stamp; 2]>,
}

/// A stamp off the clock that stamps are referred to, s.
#[derive(Debug, Clone, Copy)]
struct Stamp {
    off: f64,
    number: usize,
    line: u64,
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
        let Uniform {
            first,
            period,
            numbers,
            off_given,
            ..
        } = Uniform::new(file, stamps, given)?;
        let number = numbers.last().copied().unwrap_or(0);
        let mut following = Self {
            file: file.to_owned(),
            given,
            counter: Counter {
                number,
                period,
                due: first + number as f64 * period,
                given: given.is_some() && off_given.is_none(),
            },
            origin: stamps[0].0,
            about: period,
            last: stamps[0].0,
            sums: Sums::default(),
            ends: Vec::new(),
        };
        for (&stamp, &number) in stamps.iter().zip(&numbers) {
            following.add(stamp, number);
        }
        Ok((following, numbers))
    }

    /// The number of the next row's sample.
    pub fn number(&mut self, stamp: (f64, u64)) -> Result<usize, FileError> {
        let before = self.last;
        if self.counter.next(stamp.0) > 2.0 * self.sums.count as f64 {
            return Err(gap(&self.file, before, stamp));
        }
        let number = self.counter.number;
        self.add(stamp, number);
        Ok(number)
    }

    /// About how long a sample is, s.
    pub fn period(&self) -> f64 {
        self.about
    }

    fn add(&mut self, (time, line): (f64, u64), number: usize) {
        self.last = time;
        let n = number as f64;
        let off = time - self.origin - n * self.about;
        let Sums {
            count,
            n: sum_n,
            nn,
            x,
            xn,
            xx,
        } = &mut self.sums;
        let stamp = Stamp { off, number, line };
        if count.is_multiple_of(BUCKET) {
            self.ends.push([stamp; 2]);
        }
        if let Some([earliest, latest]) = self.ends.last_mut() {
            if off < earliest.off {
                *earliest = stamp;
            }
            if off > latest.off {
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
    pub fn finish(self) -> Result<Uniform, FileError> {
        let free = self.fit(self.about, false)?;
        let Some(given) = self.given else {
            return Ok(free);
        };
        let drift = (free.period - given).abs() * self.counter.number as f64;
        let sigma = free.jitter_rms * (12.0 / self.sums.count as f64).sqrt();
        if drift > free.jitter_max.max(BY_CHANCE * sigma) {
            return Ok(Uniform {
                off_given: Some(free.period / given - 1.0),
                ..free
            });
        }
        self.fit(given, true)
    }

    /// The line through stamps, or the one with this period.
    fn fit(&self, period: f64, given: bool) -> Result<Uniform, FileError> {
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
        // Off a line through their mean, and that off the clock.
        let covariance = xn - x * mean;
        let about_line = xx - x * level - 2.0 * slope * covariance + slope * slope * spread;
        let line_off = self.origin + level - slope * mean - first;
        let mut largest = 0.0f64;
        for stamp in self.ends.iter().flatten() {
            let n = stamp.number as f64;
            let time = self.origin + n * self.about + stamp.off;
            let due = first + n * period;
            let off = (time - due).abs();
            if off > 0.5 * period {
                let stamp = (time, stamp.line);
                return Err(not_uniform(&self.file, stamp, n as usize, (due, period)));
            }
            largest = largest.max(off);
        }
        Ok(Uniform {
            first,
            period,
            numbers: Vec::new(),
            jitter_rms: (about_line.max(0.0) / count + line_off * line_off).sqrt(),
            jitter_max: largest,
            off_given: None,
        })
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
            for &stamp in &stamps[20_000..] {
                numbers.push(following.number(stamp).unwrap());
            }
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
    fn a_clock_that_changes_its_rate_later_is_refused_where_it_is_off() {
        let mut stamps = stamps(60_000, 0.01);
        for (time, line) in &mut stamps {
            *time += 3e-6 * line.saturating_sub(40_000) as f64;
        }
        let file = Path::new("imu.csv");
        let (mut following, _) = Following::new(file, &stamps[..20_000], None).unwrap();
        for &stamp in &stamps[20_000..] {
            following.number(stamp).unwrap();
        }
        let error = following.finish().unwrap_err().to_string();
        assert!(
            error.contains("line") && error.contains("at sample"),
            "{error}"
        );
    }
}
