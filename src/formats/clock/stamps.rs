//! The stamps of a log's rows as they come: rows that come late, counters that wrap, clocks that are set, pauses.

use std::path::Path;

use super::super::error::FileError;
use super::super::rows::LogRows;
use super::{Breaks, Clock, REACH, TimeUnit};
use crate::recording::nanoseconds;

impl Clock<'_> {
    /// Begins to read a file.
    pub fn start(&self, csv: &mut LogRows) -> Result<Stamps, FileError> {
        Ok(Stamps {
            column: self.column.map(|name| csv.column(name)).transpose()?,
            nanoseconds: self.nanoseconds.map(|name| csv.column(name)).transpose()?,
            unit: self.unit,
            period: self.period,
            breaks: self.breaks,
            number: None,
            first: None,
            longest: 0.0,
            without_rows: 0.0,
            ahead: 0.0,
            wraps_at: None,
            pauses: Vec::new(),
            set: Vec::new(),
            set_before: None,
            out_of_order: None,
            behind: 0,
            of_rows: Vec::new(),
            let_go: 0,
        })
    }
}

/// Where a row belongs by its stamp: behind so many of those that are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::formats) enum Stamp {
    /// No other has it, and it is taken.
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
pub(in crate::formats) struct Stamps {
    column: Option<usize>,
    nanoseconds: Option<usize>,
    unit: TimeUnit,
    /// s from row to row, if it is stated; always of counts
    period: Option<f64>,
    breaks: Breaks,
    /// The number in the row before.
    number: Option<f64>,
    first: Option<f64>,
    /// The longest step forward.
    longest: f64,
    /// How far numbers have gone on without rows, in steps longer than BREAK.
    without_rows: f64,
    /// By how much the time of a row is ahead of its number: counters wrap, clocks are set, pauses are cut short.
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
    out_of_order: Option<(usize, u64)>,
    /// Rows since the latest one that come behind it.
    behind: usize,
    /// Time in s and line of each row taken and not let go …
    pub of_rows: Vec<(f64, u64)>,
    /// … and how many were before them.
    let_go: usize,
}

impl Stamps {
    /// Looks at the stamp of the row, and takes it if it is new.
    pub fn look(&mut self, csv: &LogRows) -> Result<Stamp, FileError> {
        let end = self.of_rows.len();
        let Some(column) = self.column else {
            let time = (self.let_go + end) as f64 * self.period();
            self.of_rows.push((time, csv.line()));
            return Ok(Stamp::New(end));
        };
        let number = self.number_of(csv, column)?;
        if self.unit == TimeUnit::Count && number.fract() != 0.0 {
            return Err(csv.not(column, "a whole number of samples"));
        }
        if number + self.usual_step() == number {
            return Err(csv.not(
                column,
                "a time, not a number so large that the next row would have the same",
            ));
        }
        if let Some(before) = self.number {
            let step = number - before;
            if let Some(unit) = self.other_unit(step) {
                return Err(csv.error_here(
                    format_args!("times that go on by {step} from row to row"),
                    format_args!("{} s, as sample_period_s says", self.period()),
                    format!("Give time_unit = \"{unit}\", or correct sample_period_s."),
                ));
            }
            if step == 0.0 {
                return Ok(Stamp::Again(end));
            }
            let is_back = step < 0.0 && !self.wraps(step);
            if is_back && let Some(late) = self.late(self.time(number), csv.line()) {
                self.behind += 1;
                if self.behind > REACH {
                    return Err(self.goes_back(csv, before, step));
                }
                return Ok(late);
            }
            if is_back {
                self.is_set(csv, before, step)?;
            } else if self.is_pause(step) {
                self.pause(csv, number, step);
            } else {
                self.longest = self.longest.max(step);
                if step > self.cut_to() {
                    self.without_rows += step;
                }
            }
        }
        self.go_on(number, csv.line());
        Ok(Stamp::New(end))
    }

    /// The unit in which the first two steps are as long as is stated, if that is not the one of `run.toml`.
    fn other_unit(&self, step: f64) -> Option<&'static str> {
        let (TimeUnit::PerSecond(_), Some(period)) = (self.unit, self.period) else {
            return None;
        };
        let first = self
            .first
            .zip(self.number)
            .map(|(first, last)| last - first);
        let [second, first] = match self.let_go == 0 && self.of_rows.len() == 2 {
            true => [step, first?],
            false => return None,
        };
        let fits = |&(_, unit): &(&str, TimeUnit)| match unit {
            TimeUnit::PerSecond(many) if unit != self.unit => {
                let is_period = |step: f64| (step / many - period).abs() < 0.5 * period;
                is_period(first) && is_period(second)
            }
            _ => false,
        };
        TimeUnit::WORDS
            .iter()
            .find(|word| fits(word))
            .map(|word| word.0)
    }

    fn number_of(&self, csv: &LogRows, column: usize) -> Result<f64, FileError> {
        let nanoseconds = self.nanoseconds.map(|column| csv.number(column));
        Ok(csv.number(column)? + 1e-9 * nanoseconds.transpose()?.unwrap_or(0.0))
    }

    fn go_on(&mut self, number: f64, line: u64) {
        self.behind = 0;
        self.number = Some(number);
        self.first.get_or_insert(number);
        self.of_rows.push((self.time(number), line));
    }

    /// s
    fn time(&self, number: f64) -> f64 {
        match self.unit {
            TimeUnit::PerSecond(many) => (number + self.ahead) / many,
            TimeUnit::Count => (number + self.ahead) * self.period(),
        }
    }

    /// Behind which row one of this time belongs that comes late, if that is one of the last.
    fn place(&self, time: f64) -> Option<usize> {
        let last = self.of_rows.len().saturating_sub(REACH);
        let place = last + self.of_rows[last..].partition_point(|(other, _)| *other <= time);
        (place > last).then_some(place)
    }

    /// Puts a row that comes late in its place, if there is one: where a row is missing, or at the time of another.
    /// Those of a clock that was set back find theirs taken.
    fn late(&mut self, time: f64, line: u64) -> Option<Stamp> {
        let place = self.place(time)?;
        if self.of_rows[place - 1].0 == time {
            return Some(Stamp::Again(place));
        }
        if !self.misses_a_row(place) {
            return None;
        }
        let first = self.out_of_order.map_or(line, |(_, first)| first);
        let count = self.out_of_order.map_or(0, |(count, _)| count);
        self.out_of_order = Some((count + 1, first));
        self.of_rows.insert(place, (time, line));
        Some(Stamp::New(place))
    }

    /// Whether a row is missing before this place: whether the step there is nearer to two than to one of the usual ones
    /// of the last rows, of which half are no longer.
    fn misses_a_row(&self, place: usize) -> bool {
        let step = |rows: &[(f64, u64)]| rows[1].0 - rows[0].0;
        let last = &self.of_rows[self.of_rows.len().saturating_sub(REACH)..];
        let mut steps: Vec<f64> = last.windows(2).map(step).collect();
        let half = steps.len() / 2;
        let usual = match steps.is_empty() {
            true => 0.0,
            false => *steps.select_nth_unstable_by(half, f64::total_cmp).1,
        };
        let ends = self.of_rows.get(place - 1..=place);
        ends.is_some_and(|ends| step(ends) > 1.5 * usual)
    }

    fn period(&self) -> f64 {
        self.period.unwrap_or(1.0)
    }

    /// The step that is stated, or else the longest so far; before any, that of a second.
    fn usual_step(&self) -> f64 {
        match self.period {
            Some(period) => period * self.a_second(),
            None if self.longest > 0.0 => self.longest,
            None => self.a_second(),
        }
    }

    /// What numbers go on by in a second.
    fn a_second(&self) -> f64 {
        match self.unit {
            TimeUnit::PerSecond(many) => many,
            TimeUnit::Count => self.period().recip(),
        }
    }

    /// How far numbers have gone on so far.
    fn lasted(&self) -> f64 {
        let ends = self.first.zip(self.number);
        ends.map_or(0.0, |(first, last)| last + self.ahead - first)
    }

    /// Whether a counter of a known size wrapped at a step back, which is then made good.
    fn wraps(&mut self, step: f64) -> bool {
        let size = match self.unit {
            TimeUnit::Count => wrap(step, COUNTERS, |size| 0.25 * size),
            TimeUnit::PerSecond(many) => wrap(step, CLOCKS.map(|seconds| seconds * many), |_| {
                2.0 * self.longest
            }),
        };
        self.ahead += size.unwrap_or(0.0);
        self.wraps_at = size.or(self.wraps_at);
        size.is_some()
    }

    /// How long a pause is that was cut short, or of which nobody knows how long it was.
    fn cut_to(&self) -> f64 {
        BREAK * self.a_second()
    }

    /// Whether with this step forward nothing was recorded for longer than something was.
    fn is_pause(&self, step: f64) -> bool {
        let rows = self.let_go + self.of_rows.len();
        let pauses = self.breaks >= Breaks::Pauses && rows > REACH && step > self.cut_to();
        pauses && step + 2.0 * self.without_rows > self.lasted()
    }

    /// Cuts a pause short: samples of nothing would take room.
    fn pause(&mut self, csv: &LogRows, number: f64, step: f64) {
        self.ahead += self.cut_to() - step;
        self.without_rows += self.cut_to();
        let before = self.pauses.last().map_or(0.0, |pause| pause.left_out);
        self.pauses.push(Pause {
            until: self.time(number),
            left_out: before + (step - self.cut_to()) / self.a_second(),
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
        let (from, to) = (self.words(before), self.words(before + step));
        self.ahead += self.cut_to() - step;
        self.without_rows += self.cut_to();
        let later = nanoseconds(BREAK - step / self.a_second());
        self.set.push(format!(
            "line {}: time goes from {from} to {to}: the clock was set, and nobody knows how long nothing was \
             recorded. What follows begins anew; its times are taken {later} s later.",
            csv.line(),
        ));
        Ok(())
    }

    fn goes_back(&self, csv: &LogRows, before: f64, step: f64) -> FileError {
        let (from, to) = (self.words(before), self.words(before + step));
        csv.error_here(
            format_args!("time going back from {from} to {to}"),
            "times that increase",
            "Put the rows in order, name another time column, or split the file where the clock was set.",
        )
    }

    fn words(&self, number: f64) -> String {
        match self.unit {
            TimeUnit::PerSecond(many) => format!("{} s", nanoseconds(number / many)),
            TimeUnit::Count => format!("count {number}"),
        }
    }

    /// Takes the row for another one at the time of the row before this place; if that is one of many rows back and no
    /// row is missing there, for the first one of a clock that was set. Behind how many of the rows it is then.
    pub fn again(&mut self, place: usize, csv: &LogRows) -> Result<usize, FileError> {
        let end = self.of_rows.len();
        if place < end && !self.misses_a_row(place) {
            let number = self.column.map(|column| self.number_of(csv, column));
            if let (Some(number), Some(before)) = (number.transpose()?, self.number) {
                // Those before it that a set clock put back may have had the same values.
                self.behind = 0;
                self.is_set(csv, before, number - before)?;
                self.go_on(number, csv.line());
                return Ok(end);
            }
        }
        let before = place.checked_sub(1).and_then(|row| self.of_rows.get(row));
        if let Some(&(time, _)) = before {
            self.of_rows.insert(place, (time, csv.line()));
        }
        Ok(place)
    }

    /// Whether rows are counted, each with a number of its own.
    pub fn is_count(&self) -> bool {
        self.unit == TimeUnit::Count
    }

    /// Lets go of the first rows' stamps.
    pub fn let_go(&mut self, rows: usize) {
        self.of_rows.drain(..rows);
        self.of_rows.shrink_to(2 * self.of_rows.len());
        self.let_go += rows;
    }

    /// What was made of numbers that step back, and what that leaves open where so many samples lack their rows.
    pub fn notes(&self, file: &Path, missing: usize) -> Vec<String> {
        let file = file.display();
        let set = self.set.iter();
        let mut notes: Vec<String> = set.map(|what| format!("{file}, {what}")).collect();
        let ends = self.pauses.first().zip(self.pauses.last());
        notes.extend(ends.map(|(first, last)| {
            format!(
                "{file}: nothing was recorded in {} pause(s), the first before line {}, for longer in all than \
                 something was. {BREAK} s of each counts as missing rows, {} s more do not.",
                self.pauses.len(),
                first.line,
                nanoseconds(last.left_out)
            )
        }));
        notes.extend(self.out_of_order.map(|(count, line)| {
            format!(
                "{count} row(s) of {file} come behind later ones, the first in line {line}: they are put in their place."
            )
        }));
        notes.extend(self.wraps_at.and_then(|size| match self.unit {
            TimeUnit::PerSecond(many) => Some(format!(
                "{file}: the time wraps every {} s and is taken to go on.",
                nanoseconds(size / many)
            )),
            TimeUnit::Count => (missing > 0).then(|| {
                format!(
                    "Rows are missing, and the counter wraps every {size} samples, {} s: as many more may be missing \
                     at each place, or several times as many, and all after it be as much too early. Give a time that \
                     does not wrap, or split the record there.",
                    nanoseconds(size * self.period())
                )
            }),
        }));
        notes
    }

    /// The error of a row that has the stamp of the row before, but other values.
    pub fn same(csv: &LogRows) -> FileError {
        csv.error_here(
            "the time of the row before again, a duplicate with other values",
            "a later time",
            "Remove the wrong one of both rows, or print times with more digits.",
        )
    }
}

/// How long nothing is taken to have been recorded where nobody knows, and what is left of a long pause, s: more than
/// is ever interpolated.
const BREAK: f64 = 1.0;

/// Sizes of counters of samples.
const COUNTERS: [f64; 4] = [256.0, 65_536.0, 16_777_216.0, 4_294_967_296.0];
/// After so many seconds clocks begin again: registers of milliseconds and microseconds, a day, a week of satellites.
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
