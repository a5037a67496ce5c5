//! A file that contains streams of samples.

use super::bytes::Broken;

/// A column of a stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Name in the file.
    pub name: String,
    /// Unit in the spelling of `run.toml`; empty if not stated.
    pub unit: &'static str,
}

impl Column {
    /// A column of this name and unit.
    pub fn new(name: impl Into<String>, unit: &'static str) -> Self {
        Self {
            name: name.into(),
            unit,
        }
    }
}

/// Samples of one kind from one source.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Stream {
    /// Name in `run.toml`.
    pub name: String,
    /// Columns; empty until the first sample if only that sample defines them.
    pub columns: Vec<Column>,
    /// Remarks on the values of the stream, one sentence each.
    pub remarks: Vec<String>,
    /// Whether the stream may belong to an instrument, according to the format.
    pub is_inertial: bool,
    /// Name of the body axes of the stream, if the format has a convention.
    pub axes: Option<&'static str>,
}

/// A file that provides streams of samples, read sequentially.
pub trait Log {
    /// The streams found so far.
    fn streams(&self) -> &[Stream];

    /// Advances to the next sample of any stream and returns the stream; `None` at the end of the file.
    fn advance(&mut self) -> Result<Option<usize>, Broken>;

    /// The values of the sample, one for each column of its stream; NaN for missing numbers.
    fn values(&mut self, row: &mut Vec<f64>) -> Result<(), Broken>;

    /// The exact whole number in a column of the current sample, if it has more digits than its value.
    fn whole(&self, _column: usize) -> Option<i128> {
        None
    }

    /// Offset of the sample in the file, bytes.
    fn offset(&self) -> u64;
}
