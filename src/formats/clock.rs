//! The clock of a log: stamps in any unit, counters, or none.

mod count;
mod line;
mod stamps;
mod wander;

pub use count::REACH;
pub use line::{Line, Uniform};
pub use stamps::{Stamp, Stamps};
pub use wander::Wander;

/// What the numbers of a time column are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeUnit {
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
pub enum Breaks {
    /// Nothing: rows of another file are put beside these.
    None,
    /// Pause for as long as they like.
    Pauses,
    /// Start over where the clock was set: nothing else goes by them.
    Settings,
}

/// What `run.toml` says of a log's time.
#[derive(Debug, Clone, Copy)]
pub struct Clock<'a> {
    /// None where rows just follow one another.
    pub column: Option<&'a str>,
    /// A column of nanoseconds beside one of whole seconds.
    pub nanoseconds: Option<&'a str>,
    pub unit: TimeUnit,
    /// s
    pub period: Option<f64>,
    pub breaks: Breaks,
}
