//! The clock of a log: stamps in any unit, counters, or none.

use super::error::FileError;
use super::fields::Fields;
use super::rows::LogRows;
use super::uniform::REACH;
use crate::recording::nanoseconds;

/// What the numbers of a time column are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TimeUnit {
    /// This many of them are a second.
    PerSecond(f64),
    /// Samples are counted.
    Count,
}

impl TimeUnit {
    /// The words for it in `run.toml`.
    pub const WORDS: [(&'static str, Self); 5] = [
        ("s", Self::PerSecond(1.0)),
        ("ms", Self::PerSecond(1e3)),
        ("us", Self::PerSecond(1e6)),
        ("ns", Self::PerSecond(1e9)),
        ("count", Self::Count),
    ];
}

/// What `run.toml` says of a log's time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock<'a> {
    /// None where rows just follow one another.
    pub column: Option<&'a str>,
    /// A column of nanoseconds beside one of whole seconds.
    pub nanoseconds: Option<&'a str>,
    pub unit: TimeUnit,
    /// s
    pub period: Option<f64>,
    /// Whether nothing but these rows is told by their times, so that it does no harm if the clock is set.
    pub alone: bool,
}

impl<'a> Clock<'a> {
    /// Reads `time_unit` and `sample_period_s` of a log's table, and `time` of its columns.
    pub fn of_fields(fields: &Fields<'a>, columns: &Fields<'a>) -> Result<Self, FileError> {
        let unit = match fields.get("time_unit") {
            Some(field) => field.choice(&TimeUnit::WORDS)?,
            None => TimeUnit::PerSecond(1.0),
        };
        let period = fields.get("sample_period_s");
        if unit == TimeUnit::Count && period.is_none() {
            return Err(fields.missing("sample_period_s", "what a count lasts"));
        }
        let (column, nanoseconds) = match columns.get("time") {
            None => (None, None),
            Some(field) => match field.texts().as_deref() {
                Ok(&[seconds, nanoseconds]) => (Some(seconds), Some(nanoseconds)),
                _ => (Some(field.text()?), None),
            },
        };
        if let (Some(_), Some(field)) = (nanoseconds, fields.get("time_unit")) {
            field.choice(&[("s", ())])?;
        }
        Ok(Self {
            column,
            nanoseconds,
            unit,
            period: period.map(|field| field.positive()).transpose()?,
            alone: false,
        })
    }

    /// Begins to read a file.
    pub fn start(&self, csv: &mut LogRows) -> Result<Stamps, FileError> {
        Ok(Stamps {
            column: self.column.map(|name| csv.column(name)).transpose()?,
            nanoseconds: self.nanoseconds.map(|name| csv.column(name)).transpose()?,
            unit: self.unit,
            period: self.period.unwrap_or(1.0),
            alone: self.alone,
            number: None,
            first: None,
            longest: 0.0,
            ahead: 0.0,
            wraps_at: None,
            begun_anew: Vec::new(),
            of_rows: Vec::new(),
            let_go: 0,
        })
    }
}

/// A row's stamp against that of the row before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stamp {
    Later,
    Same,
}

/// The stamps of a file so far.
pub(super) struct Stamps {
    column: Option<usize>,
    nanoseconds: Option<usize>,
    unit: TimeUnit,
    /// s a count
    period: f64,
    alone: bool,
    /// The number in the row before.
    number: Option<f64>,
    first: Option<f64>,
    /// The longest step forward.
    longest: f64,
    /// By how much the time of a row is ahead of its number: counters wrap, clocks are set.
    ahead: f64,
    /// The size of a counter that wrapped.
    wraps_at: Option<f64>,
    /// Where the record begins anew, in some sentences each.
    begun_anew: Vec<String>,
    /// Time in s and line of each row taken and not let go …
    pub of_rows: Vec<(f64, u64)>,
    /// … and how many were before them.
    let_go: usize,
}

impl Stamps {
    /// Looks at the stamp of the row, which must not be before that of the row before; a later one is
    /// taken.
    pub fn look(&mut self, csv: &LogRows) -> Result<Stamp, FileError> {
        let Some(column) = self.column else {
            let time = (self.let_go + self.of_rows.len()) as f64 * self.period;
            self.of_rows.push((time, csv.line()));
            return Ok(Stamp::Later);
        };
        let mut number = csv.number(column)?;
        if let Some(column) = self.nanoseconds {
            number += 1e-9 * csv.number(column)?;
        }
        if self.unit == TimeUnit::Count && number.fract() != 0.0 {
            return Err(csv.not(column, "a whole number of samples"));
        }
        if let Some(before) = self.number {
            let step = number - before;
            if step == 0.0 {
                return Ok(Stamp::Same);
            }
            let is_back = step < 0.0 && !self.wraps(step);
            if is_back || self.is_pause(step) {
                self.begin_anew(csv, before, step)?;
            } else {
                self.longest = self.longest.max(step);
            }
        }
        self.number = Some(number);
        self.first.get_or_insert(number);
        let time = match self.unit {
            TimeUnit::PerSecond(many) => (number + self.ahead) / many,
            TimeUnit::Count => (number + self.ahead) * self.period,
        };
        self.of_rows.push((time, csv.line()));
        Ok(Stamp::Later)
    }

    /// What numbers go on by in a second.
    fn a_second(&self) -> f64 {
        match self.unit {
            TimeUnit::PerSecond(many) => many,
            TimeUnit::Count => self.period.recip(),
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

    /// Whether nothing was recorded for longer than there is a record before it.
    fn is_pause(&self, step: f64) -> bool {
        let rows = self.let_go + self.of_rows.len();
        self.alone && rows > REACH && step > self.lasted().max(BREAK * self.a_second())
    }

    /// Takes what follows for a part of its own, a little later.
    fn begin_anew(&mut self, csv: &LogRows, before: f64, step: f64) -> Result<(), FileError> {
        let of = |number: f64| match self.unit {
            TimeUnit::PerSecond(many) => format!("{} s", nanoseconds(number / many)),
            TimeUnit::Count => format!("count {number}"),
        };
        let (from, to) = (of(before), of(before + step));
        let usual = self.lasted() / (self.let_go + self.of_rows.len()) as f64;
        // Rows out of order are not that far from their place.
        if step < 0.0 && (!self.alone || -step <= REACH as f64 * usual) {
            return Err(csv.error_here(
                format_args!("time going back from {from} to {to}"),
                "times that increase",
                "Put the rows in order, or split the file where the clock was set.",
            ));
        }
        let second = self.a_second();
        self.ahead += BREAK * second - step;
        let what = match step < 0.0 {
            true => {
                "Time goes back: the clock was set, and nobody knows how long nothing was recorded"
            }
            false => "Nothing was recorded for longer than there is a record before it",
        };
        let by = nanoseconds(self.ahead.abs() / second);
        self.begun_anew.push(format!(
            "In line {} time goes from {from} to {to}. {what}. What follows begins anew; its times are taken {by} s {}.",
            csv.line(),
            if self.ahead > 0.0 { "later" } else { "earlier" }
        ));
        Ok(())
    }

    /// Takes the stamp of the row before for this one, too.
    pub fn again(&mut self, csv: &LogRows) {
        if let Some(&(time, _)) = self.of_rows.last() {
            self.of_rows.push((time, csv.line()));
        }
    }

    /// Whether rows are counted, each with a number of its own.
    pub fn is_count(&self) -> bool {
        self.unit == TimeUnit::Count
    }

    /// Lets go of the first rows' stamps.
    pub fn let_go(&mut self, rows: usize) {
        self.of_rows.drain(..rows);
        self.let_go += rows;
    }

    /// What was made of numbers that step back, and what that leaves open where so many samples lack their rows.
    pub fn notes(&self, missing: usize) -> Vec<String> {
        let mut notes = self.begun_anew.clone();
        notes.extend(self.wraps_at.and_then(|size| match self.unit {
            TimeUnit::PerSecond(many) => Some(format!(
                "The time wraps every {} s and is taken to go on.",
                nanoseconds(size / many)
            )),
            TimeUnit::Count => (missing > 0).then(|| {
                format!(
                    "Rows are missing, and the counter wraps every {size} samples, {} s: as many more may be missing \
                     at each place, or several times as many, and all after it be as much too early. Give a time that \
                     does not wrap, or split the record there.",
                    nanoseconds(size * self.period)
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
/// How long nothing is taken to have been recorded where nobody knows, or for long, s: more than is ever interpolated.
const BREAK: f64 = 1.0;

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
