//! Stamps of the rows of a log in order of arrival: late rows, wrapping counters, clock settings, pauses.

use std::path::Path;

use super::median;
use super::{Breaks, Clock, REACH, TimeUnit};
use crate::rows::LogRows;
use turncal_input::units::nanoseconds;
use turncal_input::{FileError, counted};

impl Clock<'_> {
    /// Starts reading a file.
    pub fn start(&self, csv: &mut LogRows) -> Result<Stamps, FileError> {
        Ok(Stamps {
            column: self.column.map(|name| csv.column(name)).transpose()?,
            nanoseconds: self.nanoseconds.map(|name| csv.column(name)).transpose()?,
            unit: self.unit,
            period: self.period,
            breaks: self.breaks,
            time: None,
            first: None,
            longest: 0.0,
            without_rows: 0.0,
            ahead: 0.0,
            wraps_at: None,
            pauses: Vec::new(),
            set: Vec::new(),
            set_before: None,
            out_of_order: (0, 0),
            behind: 0,
            bursts: self.unit != TimeUnit::Count,
            standing: 0,
            at_once: (0, 0),
            of_rows: Vec::new(),
            let_go: 0,
        })
    }
}

/// Position of a row by its stamp: number of kept rows before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stamp {
    /// The row is kept; this many kept rows precede it.
    New(usize),
    /// The stamp equals that of the previous row.
    Again(usize),
}

/// A pause so long that its remainder is omitted.
struct Pause {
    /// Time of the row after the pause, with shortened pauses, s.
    until: f64,
    /// Total shortening up to here, s.
    left_out: f64,
    line: u64,
}

/// The stamps of a file so far.
pub struct Stamps {
    column: Option<usize>,
    nanoseconds: Option<usize>,
    unit: TimeUnit,
    /// Sample period, s, if stated; always for counts.
    period: Option<f64>,
    breaks: Breaks,
    /// Time of the previous row as logged, s, like the following fields.
    time: Option<f64>,
    first: Option<f64>,
    /// The longest step forward.
    longest: f64,
    /// Total of steps longer than BREAK.
    without_rows: f64,
    /// Difference between row time and logged number, due to wraps, clock settings and shortened pauses.
    ahead: f64,
    /// The size of a counter that wrapped.
    wraps_at: Option<f64>,
    /// Shortened pauses.
    pauses: Vec<Pause>,
    /// Clock settings, a few sentences each.
    set: Vec<String>,
    /// Number of rows before the last clock setting.
    set_before: Option<usize>,
    /// Number of reordered rows, and the line of the first.
    out_of_order: (usize, u64),
    /// Number of rows since the latest one that belong before it.
    behind: usize,
    /// Whether rows with equal times may have different values.
    bursts: bool,
    /// Number of consecutive rows with equal times.
    standing: usize,
    /// Number of rows with the same time as another row but other values, and the line of the first.
    at_once: (usize, u64),
    /// Time in s and line of each row kept.
    pub of_rows: Vec<(f64, u64)>,
    /// Number of rows before the rows kept.
    let_go: usize,
}

impl Stamps {
    /// Returns a copy that requires unique times.
    pub fn without_bursts(self) -> Self {
        Self {
            bursts: false,
            ..self
        }
    }

    /// Accepts the row unless it duplicates a row with the same time; `is_same` compares the values.
    pub fn take(
        &mut self,
        csv: &LogRows,
        is_same: impl Fn(usize) -> bool,
    ) -> Result<Stamp, FileError> {
        let place = match self.look(csv)? {
            Stamp::New(place) => {
                self.standing = 0;
                return Ok(Stamp::New(place));
            }
            Stamp::Again(place) => place,
        };
        self.standing += 1;
        if self.standing > MOST_AT_ONCE {
            return Err(csv.error_here(
                format_args!("the same time in more than {MOST_AT_ONCE} consecutive rows"),
                "increasing times",
                "Name another time column, or omit it and set sample_period_s.",
            ));
        }
        if is_same(place - 1) {
            return Ok(Stamp::Again(place));
        }
        if !self.bursts {
            return Err(csv.error_here(
                "the same time as in the previous row, but other values",
                "a later time",
                "Remove the wrong row of the two, or log the time with more digits.",
            ));
        }
        if self.is_set_to(place, csv)? {
            return Ok(Stamp::New(self.of_rows.len() - 1));
        }
        count(&mut self.at_once, csv.line());
        let (time, _) = self.of_rows[place - 1];
        self.of_rows.insert(place, (time, csv.line()));
        Ok(Stamp::New(place))
    }

    /// Examines the stamp of the row and accepts it if new.
    fn look(&mut self, csv: &LogRows) -> Result<Stamp, FileError> {
        let end = self.of_rows.len();
        let Some(column) = self.column else {
            let time = (self.let_go + end) as f64 * self.period();
            self.of_rows.push((time, csv.line()));
            return Ok(Stamp::New(end));
        };
        let number = csv.number(column)?;
        if self.unit == TimeUnit::Count && number.fract() != 0.0 {
            return Err(csv.not(column, "a whole number of samples"));
        }
        let time = self.time_of(csv, column)?;
        if time + self.usual_step() == time {
            return Err(csv.not(column, "a time small enough to resolve one sample period"));
        }
        if let Some(before) = self.time {
            let step = time - before;
            self.is_in_unit(csv, step)?;
            if step == 0.0 {
                return Ok(Stamp::Again(end));
            }
            let is_back = step < 0.0 && !self.wraps(step);
            if is_back && let Some(late) = self.late(time + self.ahead, csv.line()) {
                self.behind += 1;
                if self.behind > REACH {
                    return Err(self.goes_back(csv, before, step));
                }
                return Ok(late);
            }
            if is_back {
                self.is_set(csv, before, step)?;
            } else if self.is_pause(step) {
                self.pause(csv, time, step);
            } else {
                self.longest = self.longest.max(step);
                if step > BREAK {
                    self.without_rows += step;
                }
            }
        }
        self.go_on(time, csv.line());
        Ok(Stamp::New(end))
    }

    /// Refuses the first two steps if they match the stated period only in a different unit.
    fn is_in_unit(&self, csv: &LogRows, step: f64) -> Result<(), FileError> {
        let (TimeUnit::PerSecond(own), Some(period)) = (self.unit, self.period) else {
            return Ok(());
        };
        let (Some(last), Some(first), 2, 0) =
            (self.time, self.first, self.of_rows.len(), self.let_go)
        else {
            return Ok(());
        };
        let is_period = |step: f64| (step - period).abs() < 0.5 * period;
        let fits = |&&(_, unit): &&(&str, TimeUnit)| match unit {
            TimeUnit::PerSecond(many) if many != own => {
                is_period((last - first) * own / many) && is_period(step * own / many)
            }
            _ => false,
        };
        match TimeUnit::WORDS.iter().find(fits) {
            None => Ok(()),
            Some((unit, _)) => Err(csv.error_here(
                format_args!("a time step of {} between rows", nanoseconds(step * own)),
                format_args!("{period} s (sample_period_s in run.toml)"),
                format!("Set time_unit = \"{unit}\", or correct sample_period_s."),
            )),
        }
    }

    /// Logged time of a row, s.
    fn time_of(&self, csv: &LogRows, column: usize) -> Result<f64, FileError> {
        let number = csv.number(column)?;
        let nanoseconds = self.nanoseconds.map(|column| csv.number(column));
        Ok(match self.unit {
            TimeUnit::PerSecond(many) => {
                (number + 1e-9 * nanoseconds.transpose()?.unwrap_or(0.0)) / many
            }
            TimeUnit::Count => number * self.period(),
        })
    }

    fn go_on(&mut self, time: f64, line: u64) {
        self.behind = 0;
        self.time = Some(time);
        self.first.get_or_insert(time);
        self.of_rows.push((time + self.ahead, line));
    }

    /// Inserts a late row at its position among the last rows: where a row is missing, or at the time of another row.
    /// After a clock was set back, these positions are occupied.
    fn late(&mut self, time: f64, line: u64) -> Option<Stamp> {
        let last = self.of_rows.len().saturating_sub(REACH);
        let place = last + self.of_rows[last..].partition_point(|(other, _)| *other <= time);
        if place == last {
            return None;
        }
        if self.of_rows[place - 1].0 == time {
            return Some(Stamp::Again(place));
        }
        if !self.misses_a_row(place) {
            return None;
        }
        count(&mut self.out_of_order, line);
        self.of_rows.insert(place, (time, line));
        Some(Stamp::New(place))
    }

    /// Whether a row is missing before this position: whether the step is closer to two than to one median step of the
    /// last rows.
    fn misses_a_row(&self, place: usize) -> bool {
        let step = |rows: &[(f64, u64)]| rows[1].0 - rows[0].0;
        let last = &self.of_rows[self.of_rows.len().saturating_sub(REACH)..];
        let mut steps: Vec<f64> = last.windows(2).map(step).collect();
        let usual = median(&mut steps).unwrap_or(0.0);
        let ends = self.of_rows.get(place - 1..=place);
        ends.is_some_and(|ends| step(ends) > 1.5 * usual)
    }

    fn period(&self) -> f64 {
        self.period.unwrap_or(1.0)
    }

    /// The stated step, otherwise the longest so far, initially one second.
    fn usual_step(&self) -> f64 {
        let longest = Some(self.longest).filter(|longest| *longest > 0.0);
        self.period.or(longest).unwrap_or(1.0)
    }

    /// Whether a counter of known size wrapped at a backward step, which is then corrected.
    fn wraps(&mut self, step: f64) -> bool {
        let size = match self.unit {
            TimeUnit::Count => wrap(step, COUNTERS.map(|size| size * self.period()), |size| {
                0.25 * size
            }),
            TimeUnit::PerSecond(_) => wrap(step, CLOCKS, |_| 2.0 * self.longest),
        };
        self.ahead += size.unwrap_or(0.0);
        self.wraps_at = size.or(self.wraps_at);
        size.is_some()
    }

    /// Whether, with this forward step, pauses are longer than the recorded time.
    fn is_pause(&self, step: f64) -> bool {
        let rows = self.let_go + self.of_rows.len();
        let lasted = self.time.zip(self.first);
        let lasted = lasted.map_or(0.0, |(last, first)| last + self.ahead - first);
        let pauses = self.breaks >= Breaks::Pauses && rows > REACH && step > BREAK;
        pauses && step + 2.0 * self.without_rows > lasted
    }

    /// Shifts the following rows to slightly later.
    fn cut(&mut self, step: f64) {
        self.ahead += BREAK - step;
        self.without_rows += BREAK;
    }

    /// Shortens a pause, to save memory.
    fn pause(&mut self, csv: &LogRows, time: f64, step: f64) {
        self.cut(step);
        let before = self.pauses.last().map_or(0.0, |pause| pause.left_out);
        self.pauses.push(Pause {
            until: time + self.ahead,
            left_out: before + step - BREAK,
            line: csv.line(),
        });
    }

    /// Sample time for this logged time, after pauses have been shortened.
    pub fn told(&self, time: f64) -> f64 {
        // Samples begin about where their stamps are.
        let behind = |pause: &Pause| pause.until - 0.5 * BREAK <= time;
        let behind = self.pauses.partition_point(behind);
        let pause = self.pauses[..behind].last();
        time + pause.map_or(0.0, |pause| pause.left_out)
    }

    /// Treats the following rows as a separate part, slightly later.
    fn is_set(&mut self, csv: &LogRows, before: f64, step: f64) -> Result<(), FileError> {
        // If rows are out of order, or if the time steps back again and again, it is not the time of a clock.
        let row = self.let_go + self.of_rows.len();
        let again = self.set_before.is_some_and(|before| row - before < REACH);
        if self.breaks < Breaks::Settings || self.behind > 0 || again {
            return Err(self.goes_back(csv, before, step));
        }
        self.set_before = Some(row);
        self.cut(step);
        self.set.push(format!(
            "line {}: the time jumps from {} to {} because the clock was set, so the length of the gap is unknown. \
             turncal treats the following rows as a separate stretch and shifts their times by {} s.",
            csv.line(),
            self.words(before),
            self.words(before + step),
            nanoseconds(BREAK - step),
        ));
        Ok(())
    }

    fn goes_back(&self, csv: &LogRows, before: f64, step: f64) -> FileError {
        let (from, to) = (self.words(before), self.words(before + step));
        csv.error_here(
            format_args!("a time that steps back from {from} to {to}"),
            "increasing times",
            "Sort the rows, name another time column, or split the file at the line where the clock was set.",
        )
    }

    fn words(&self, time: f64) -> String {
        match self.unit {
            TimeUnit::PerSecond(_) => format!("{} s", nanoseconds(time)),
            TimeUnit::Count => format!("count {}", (time / self.period()).round()),
        }
    }

    /// Whether a row with the time of a much earlier row, where none is missing, is the first after a clock setting; it
    /// is then accepted.
    fn is_set_to(&mut self, place: usize, csv: &LogRows) -> Result<bool, FileError> {
        if place == self.of_rows.len() || self.misses_a_row(place) {
            return Ok(false);
        }
        let time = self.column.map(|column| self.time_of(csv, column));
        let (Some(time), Some(before)) = (time.transpose()?, self.time) else {
            return Ok(false);
        };
        // Earlier rows, before the clock was set back, may have had the same values.
        self.behind = 0;
        self.is_set(csv, before, time - before)?;
        self.go_on(time, csv.line());
        Ok(true)
    }

    /// Releases the stamps of the first rows.
    pub fn let_go(&mut self, rows: usize) {
        self.of_rows.drain(..rows);
        self.of_rows.shrink_to(2 * self.of_rows.len());
        self.let_go += rows;
    }

    /// Notes on times that step back, and on the resulting ambiguity if the rows of this number of samples are missing.
    pub fn notes(&self, file: &Path, missing: usize) -> Vec<String> {
        let file = file.display();
        let set = self.set.iter();
        let mut notes: Vec<String> = set.map(|what| format!("{file}, {what}")).collect();
        let ends = self.pauses.first().zip(self.pauses.last());
        notes.extend(ends.map(|(first, last)| {
            format!(
                "{file}: the recording paused {}, first before line {}, and the pauses are longer in total than the \
                 recording. turncal counts {BREAK} s of each pause as missing rows and ignores the other {} s.",
                counted(self.pauses.len(), "time"),
                first.line,
                nanoseconds(last.left_out)
            )
        }));
        let (same, line) = self.at_once;
        notes.extend((same > 0).then(|| {
            format!(
                "{file}: {} with the same time as the previous row but other values, the first in line {line}. Each \
                 counts as a sample.",
                counted(same, "row")
            )
        }));
        let (late, line) = self.out_of_order;
        notes.extend((late > 0).then(|| {
            format!(
                "{file}: {} out of order, the first in line {line}. turncal sorted all rows by time.",
                counted(late, "row")
            )
        }));
        notes.extend(self.wraps_at.and_then(|size| match self.unit {
            TimeUnit::PerSecond(_) => Some(format!(
                "{file}: the time counter wraps every {} s. turncal unwrapped it.",
                nanoseconds(size)
            )),
            TimeUnit::Count => (missing > 0).then(|| {
                format!(
                    "Rows are missing, and the counter wraps every {} samples ({} s). Each gap may be longer by one \
                     or more of these periods; all later times would then be too early by the same amount. Use a time \
                     that does not wrap, or split the recording at the gaps.",
                    (size / self.period()).round(),
                    nanoseconds(size)
                )
            }),
        }));
        notes
    }
}

/// Counts a row of this kind and keeps the line of the first.
fn count((count, first): &mut (usize, u64), line: u64) {
    *count += 1;
    if *count == 1 {
        *first = line;
    }
}

/// More rows than a burst can have with one time (a minute or more): the time has stopped.
const MOST_AT_ONCE: usize = 1 << 16;
/// Assumed gap if the true one is unknown, and the length of a shortened pause, s; longer than any interpolation.
const BREAK: f64 = 1.0;

/// Sizes of counters of samples.
const COUNTERS: [f64; 4] = [256.0, 65_536.0, 16_777_216.0, 4_294_967_296.0];
/// Periods after which clocks restart, s: millisecond and microsecond registers, a day, a satellite week.
const CLOCKS: [f64; 7] = [
    65.536,
    16.777_216,
    16_777.216,
    4_294.967_296,
    4_294_967.296,
    86_400.0,
    604_800.0,
];

/// The first counter size that turns the backward step into a forward step of usual length.
fn wrap<const N: usize>(step: f64, sizes: [f64; N], longest: impl Fn(f64) -> f64) -> Option<f64> {
    let forward = |size: &f64| step + size > 0.0 && step + size <= longest(*size);
    sizes.into_iter().find(forward)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_wraps_at_the_smallest_size_that_makes_a_small_step() {
        let wrap = |step| wrap(step, COUNTERS, |size| 0.25 * size);
        assert_eq!(wrap(-255.0), Some(256.0));
        assert_eq!(wrap(-250.0), Some(256.0));
        assert_eq!(wrap(-65535.0), Some(65536.0));
        assert_eq!(wrap(-65530.0), Some(65536.0));
        assert_eq!(wrap(3.0 - 4_294_967_295.0), Some(4_294_967_296.0));
        assert_eq!(wrap(-256.0), None, "the same count");
        assert_eq!(wrap(-50.0), None, "rows out of order");
    }
}
