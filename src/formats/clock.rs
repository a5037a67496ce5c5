//! The clock of a log: stamps in any unit, counters, or none.

use super::error::FileError;
use super::fields::Fields;
use super::rows::LogRows;
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
        })
    }

    /// Begins to read a file.
    pub fn start(&self, csv: &mut LogRows) -> Result<Stamps, FileError> {
        Ok(Stamps {
            column: self.column.map(|name| csv.column(name)).transpose()?,
            nanoseconds: self.nanoseconds.map(|name| csv.column(name)).transpose()?,
            unit: self.unit,
            period: self.period.unwrap_or(1.0),
            number: None,
            unwrapped: 0.0,
            wraps_at: None,
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
    /// The number in the row before.
    number: Option<f64>,
    /// What wraps of a counter add up to.
    unwrapped: f64,
    /// The size of a counter that wrapped.
    wraps_at: Option<f64>,
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
        let step = number - self.number.unwrap_or(f64::NEG_INFINITY);
        if step == 0.0 {
            return Ok(Stamp::Same);
        }
        if step < 0.0 {
            let wrap = match self.unit {
                TimeUnit::Count => wrap(step),
                TimeUnit::PerSecond(_) => None,
            };
            let Some(wrap) = wrap else {
                let of = |number: f64| match self.unit {
                    TimeUnit::PerSecond(many) => format!("{} s", nanoseconds(number / many)),
                    TimeUnit::Count => format!("count {number}"),
                };
                return Err(csv.error_here(
                    format_args!(
                        "time going back from {} to {}",
                        of(number - step),
                        of(number)
                    ),
                    "times that increase",
                    match self::wrap(step) {
                        Some(size) => format!(
                            "A counter of {size} that wraps? Add that to what follows, or say time_unit = \
                             \"count\" if it counts samples. Else put the rows in order, or split the file \
                             where the clock was set."
                        ),
                        None => "Put the rows in order, or split the file where the clock was set."
                            .to_owned(),
                    },
                ));
            };
            self.unwrapped += wrap;
            self.wraps_at = Some(wrap);
        }
        self.number = Some(number);
        let time = match self.unit {
            TimeUnit::PerSecond(many) => number / many,
            TimeUnit::Count => (number + self.unwrapped) * self.period,
        };
        self.of_rows.push((time, csv.line()));
        Ok(Stamp::Later)
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

    /// What a counter that wraps leaves open where so many samples lack their rows, in a sentence.
    pub fn lost_count(&self, missing: usize) -> Option<String> {
        let size = self.wraps_at.filter(|_| missing > 0)?;
        Some(format!(
            "Rows are missing, and the counter wraps every {size} samples, {} s: as many more may be missing at \
             each place, or several times as many, and all after it be as much too early. Give a time that does \
             not wrap, or split the record there.",
            nanoseconds(size * self.period)
        ))
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

/// The size of a counter that wrapped: the smallest that makes the step forward a small one.
fn wrap(step: f64) -> Option<f64> {
    let sizes = [8, 16, 24, 32].map(|bits| 2f64.powi(bits));
    sizes
        .into_iter()
        .find(|size| (0.0..=0.25 * size).contains(&(size + step)) && step + size > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_wraps_at_the_smallest_size_that_makes_a_small_step() {
        assert_eq!(wrap(-255.0), Some(256.0));
        assert_eq!(wrap(-250.0), Some(256.0));
        assert_eq!(wrap(-65535.0), Some(65536.0));
        assert_eq!(wrap(-65530.0), Some(65536.0));
        assert_eq!(wrap(3.0 - 4_294_967_295.0), Some(4_294_967_296.0));
        assert_eq!(wrap(-256.0), None, "the same count");
        assert_eq!(wrap(-50.0), None, "rows out of order");
    }
}
