//! What is wrong with a log's rows, and what was done about it.

use std::ops::Range;

use crate::imu::Sensor;

/// Samples of a record that are not what the instrument sensed.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// What is wrong.
    pub kind: FaultKind,
    /// Triad and body axis (right, front, up); none where whole rows are concerned.
    pub axis: Option<(Sensor, usize)>,
    /// The samples; for a duplicate the one that the file has twice.
    pub samples: Range<usize>,
    /// Line of the file: of the first sample, of the second of two equal rows, or of the last row
    /// before missing ones.
    pub line: u64,
    /// Whether the samples can be used: filled in with an error that [`Bridge`] knows, or dropped.
    pub bridged: bool,
}

/// What can be wrong with samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FaultKind {
    /// The file lacks the rows.
    Missing,
    /// The row before again, stamp and all.
    Duplicate,
    /// At the end of the axis' range, so that the truth may be beyond.
    Saturated,
    /// The same value again and again, while others change.
    Stuck,
}

impl FaultKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Missing, Self::Duplicate, Self::Saturated, Self::Stuck];

    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Missing => "missing",
            Self::Duplicate => "duplicate",
            Self::Saturated => "saturated",
            Self::Stuck => "stuck",
        }
    }
}

/// Samples of one axis that were interpolated.
#[derive(Debug, Clone, PartialEq)]
pub struct Bridge {
    /// Which triad.
    pub sensor: Sensor,
    /// Body axis: right, front, up.
    pub axis: usize,
    /// The samples.
    pub samples: Range<usize>,
    /// Variance that interpolation adds to the integral of the normalised output over all of them,
    /// rad² or (m/s)².
    pub variance: f64,
}
