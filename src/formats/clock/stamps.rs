//! The stamps of a log's rows as they come: rows that come late, counters that wrap, clocks that are set, pauses.

use std::path::Path;

use super::{Breaks, Clock, REACH, TimeUnit};
use crate::formats::error::FileError;
use crate::formats::rows::LogRows;
use crate::recording::nanoseconds;
use crate::statistics::median;

impl Clock<'_> {
    /// Begins to read a file.
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

/// Where a row belongs by its stamp: the number of kept rows that it is behind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stamp {
    /// It is taken.
    New(usize),
    /// The row before has it, too.
    Again(usize),
}

/// Where nothing was recorded for so long that the rest of it is left out.
struct Pause {
    /// Time of the row behind it, the pauses being short, s.
    until: f64,
    /// By how much these are too short up to here, s.
    left_out: f64,
    line: u64,
}

/// The stamps of a file so far.
pub struct Stamps {
    column: Option<usize>,
    nanoseconds: Option<usize>,
    unit: TimeUnit,
    /// s from row to row, if it is stated; always of counts
    period: Option<f64>,
    breaks: Breaks,
    /// The time of the row before by its own numbers, s, as all that follows.
    time: Option<f64>,
    first: Option<f64>,
    /// The longest step forward.
    longest: f64,
    /// In all, in steps longer than BREAK.
    without_rows: f64,
    /// By how much a row is later than its numbers: counters wrap, clocks are set, pauses are cut short.
    ahead: f64,
    /// The size of a counter that wrapped.
    wraps_at: Option<f64>,
    /// Pauses that are cut short.
    pauses: Vec<Pause>,
    /// Where the clock was set, in some sentences each.
    set: Vec<String>,
    /// Number of rows before the last such place.
    set_before: Option<usize>,
    /// Rows that were put before others, and the line of the first.
    out_of_order: (usize, u64),
    /// Rows since the latest one that come behind it.
    behind: usize,
    /// Whether rows of one time may have different values.
    bursts: bool,
    /// Rows that follow one another at one time.
    standing: usize,
    /// Rows that have another's time but not its values, and the line of the first.
    at_once: (usize, u64),
    /// Time in s and line of each row taken and not let go …
    pub of_rows: Vec<(f64, u64)>,
    /// … and how many were before them.
    let_go: usize,
}

impl Stamps {
    /// The same where no two rows may have one time.
    pub fn without_bursts(self) -> Self {
        Self {
            bursts: false,
            ..self
        }
    }

    /// Takes the row unless it is one of those at its time again, of which `is_same` compares the values.
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

    /// Looks at the stamp of the row, and takes it if it is new.
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

    /// Refuses the first two steps if they are as long as is stated in another unit than that of `run.toml`.
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

    /// The time of a row by its own numbers, s.
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

    /// Puts a row that comes late in its place, if there is one of the last: where a row is missing, or at the time of
    /// another. Those of a clock that was set back find theirs taken.
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

    /// Whether a row is missing before this place: whether the step there is nearer to two than to one of the usual ones
    /// of the last rows, of which half are no longer.
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

    /// The step that is stated, or else the longest so far; before any, a second.
    fn usual_step(&self) -> f64 {
        let longest = Some(self.longest).filter(|longest| *longest > 0.0);
        self.period.or(longest).unwrap_or(1.0)
    }

    /// Whether a counter of a known size wrapped at a step back, which is then made good.
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

    /// Whether with this step forward nothing was recorded for longer than something was.
    fn is_pause(&self, step: f64) -> bool {
        let rows = self.let_go + self.of_rows.len();
        let lasted = self.time.zip(self.first);
        let lasted = lasted.map_or(0.0, |(last, first)| last + self.ahead - first);
        let pauses = self.breaks >= Breaks::Pauses && rows > REACH && step > BREAK;
        pauses && step + 2.0 * self.without_rows > lasted
    }

    /// Takes what follows this step for a little later.
    fn cut(&mut self, step: f64) {
        self.ahead += BREAK - step;
        self.without_rows += BREAK;
    }

    /// Cuts a pause short: samples of nothing would take room.
    fn pause(&mut self, csv: &LogRows, time: f64, step: f64) {
        self.cut(step);
        let before = self.pauses.last().map_or(0.0, |pause| pause.left_out);
        self.pauses.push(Pause {
            until: time + self.ahead,
            left_out: before + step - BREAK,
            line: csv.line(),
        });
    }

    /// The time at which samples are that were given this one, the pauses being short.
    pub fn told(&self, time: f64) -> f64 {
        // Samples begin about where their stamps are.
        let behind = |pause: &Pause| pause.until - 0.5 * BREAK <= time;
        let behind = self.pauses.partition_point(behind);
        let pause = self.pauses[..behind].last();
        time + pause.map_or(0.0, |pause| pause.left_out)
    }

    /// Takes what follows for a part of its own, a little later.
    fn is_set(&mut self, csv: &LogRows, before: f64, step: f64) -> Result<(), FileError> {
        // Where rows come behind later ones, or it happens again and again, a time that steps back is of no clock.
        let row = self.let_go + self.of_rows.len();
        let again = self.set_before.is_some_and(|before| row - before < REACH);
        if self.breaks < Breaks::Settings || self.behind > 0 || again {
            return Err(self.goes_back(csv, before, step));
        }
        self.set_before = Some(row);
        self.cut(step);
        self.set.push(format!(
            "line {}: the time jumps from {} to {} because the clock was set, so the length of the gap is unknown. \
                turncal treats the rest as a separate stretch and shifts its times by {} s.",
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
            "Sort the rows, name another time column, or split the file where the clock was set.",
        )
    }

    fn words(&self, time: f64) -> String {
        match self.unit {
            TimeUnit::PerSecond(_) => format!("{} s", nanoseconds(time)),
            TimeUnit::Count => format!("count {}", (time / self.period()).round()),
        }
    }

    /// Whether the row at the time of another, many rows back and none missing there, is the first one of a clock that
    /// was set; it is then taken.
    fn is_set_to(&mut self, place: usize, csv: &LogRows) -> Result<bool, FileError> {
        if place == self.of_rows.len() || self.misses_a_row(place) {
            return Ok(false);
        }
        let time = self.column.map(|column| self.time_of(csv, column));
        let (Some(time), Some(before)) = (time.transpose()?, self.time) else {
            return Ok(false);
        };
        // Those before it that a set clock put back may have had the same values.
        self.behind = 0;
        self.is_set(csv, before, time - before)?;
        self.go_on(time, csv.line());
        Ok(true)
    }

    /// Lets go of the first rows' stamps.
    pub fn let_go(&mut self, rows: usize) {
        self.of_rows.drain(..rows);
        self.of_rows.shrink_to(2 * self.of_rows.len());
        self.let_go += rows;
    }

    /// What was made of numbers that step back, and what that leaves open where this number of samples lack their rows.
    pub fn notes(&self, file: &Path, missing: usize) -> Vec<String> {
        let file = file.display();
        let set = self.set.iter();
        let mut notes: Vec<String> = set.map(|what| format!("{file}, {what}")).collect();
        let ends = self.pauses.first().zip(self.pauses.last());
        notes.extend(ends.map(|(first, last)| {
            format!(
                "{file}: recording paused {} time(s), first before line {}, for longer in total than it ran. turncal \
                    counts {BREAK} s of each pause as missing rows and ignores the other {} s.",
                self.pauses.len(),
                first.line,
                nanoseconds(last.left_out)
            )
        }));
        let (same, line) = self.at_once;
        notes.extend((same > 0).then(|| {
            format!(
                "{same} row(s) of {file} repeat the previous time with other values, the first in line {line}. Each \
                    counts as a sample."
            )
        }));
        let (late, line) = self.out_of_order;
        notes.extend((late > 0).then(|| {
            format!(
                "{late} row(s) of {file} are out of order, the first in line {line}. turncal sorted them by time."
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
                        or more of these periods, and all later times too early by as much. Use a time that does not \
                        wrap, or split the recording at the gaps.",
                    (size / self.period()).round(),
                    nanoseconds(size)
                )
            }),
        }));
        notes
    }
}

/// Counts a row of its kind; the line of the first is kept.
fn count((count, first): &mut (usize, u64), line: u64) {
    *count += 1;
    if *count == 1 {
        *first = line;
    }
}

/// At one time, a minute and more of any rows are no burst: the time stands still.
const MOST_AT_ONCE: usize = 1 << 16;
/// How long nothing is taken to have been recorded where nobody knows, and the rest of a long pause, s: more than
/// is ever interpolated.
const BREAK: f64 = 1.0;

/// Sizes of counters of samples.
const COUNTERS: [f64; 4] = [256.0, 65_536.0, 16_777_216.0, 4_294_967_296.0];
/// The seconds after which clocks start over: registers of milliseconds and microseconds, a day, a week of satellites.
const CLOCKS: [f64; 7] = [
    65.536,
    16.777_216,
    16_777.216,
    4_294.967_296,
    4_294_967.296,
    86_400.0,
    604_800.0,
];

/// The first of these sizes of a counter that makes its step back one forward that is no longer than usual.
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
