//! The clock of a log: stamps in any unit, counters, or none.

mod stamps;
mod wraps;

use super::error::FileError;
use super::fields::Fields;
pub(super) use stamps::{Stamp, Stamps};

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

/// What times of rows may do but go on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Breaks {
    /// Nothing: rows of another file are put beside these.
    None,
    /// Pause for as long as they like.
    Pauses,
    /// Begin anew where the clock was set: nothing else is told by them.
    Settings,
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
    pub breaks: Breaks,
}

impl<'a> Clock<'a> {
    /// Reads `time_unit` and `sample_period_s` of a log's table, and `time` of its columns.
    pub fn of_fields(fields: &Fields<'a>, columns: &Fields<'a>) -> Result<Self, FileError> {
        let unit = match fields.get("time_unit") {
            Some(field) if field.text().is_ok() => field.choice(&TimeUnit::WORDS)?,
            // Ticks of a clock of its own.
            Some(field) => TimeUnit::PerSecond(field.positive()?.recip()),
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
            breaks: Breaks::None,
        })
    }
}
