//! The clock of a log: stamps in any unit, counters, or none.

mod count;
mod line;
mod stamps;
mod wander;

use statrs::statistics::{Data, OrderStatistics};

pub use count::REACH;
pub use line::{Line, Uniform};
pub use stamps::{Stamp, Stamps};
pub use wander::Wander;

/// Meaning of the numbers in a time column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeUnit {
    /// A unit of time, given as the number of units per second.
    PerSecond(f64),
    /// A counter of samples.
    Count,
}

impl TimeUnit {
    /// Names in `run.toml`.
    pub const WORDS: [(&'static str, Self); 5] = [
        ("s", Self::PerSecond(1.0)),
        ("ms", Self::PerSecond(1e3)),
        ("us", Self::PerSecond(1e6)),
        ("ns", Self::PerSecond(1e9)),
        ("count", Self::Count),
    ];
}

/// Allowed interruptions of row times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Breaks {
    /// No interruptions, because the rows are combined with another file.
    None,
    /// Pauses of any length.
    Pauses,
    /// Restarts where the clock was set; nothing else depends on the times.
    Settings,
}

/// Time settings of a log in `run.toml`.
#[derive(Debug, Clone, Copy)]
pub struct Clock<'a> {
    /// Time column; `None` if rows are simply consecutive.
    pub column: Option<&'a str>,
    /// A nanosecond column in addition to one of whole seconds.
    pub nanoseconds: Option<&'a str>,
    /// Unit of the column.
    pub unit: TimeUnit,
    /// Sample period, s.
    pub period: Option<f64>,
    /// Interruptions that are not errors.
    pub breaks: Breaks,
}

/// The median of these numbers, which are reordered; `None` for an empty list.
fn median(values: &mut [f64]) -> Option<f64> {
    (!values.is_empty()).then(|| Data::new(values).median())
}
