//! What a log looks like, before anything is made of it.

use crate::imu::PerSensor;

/// The instrument's file in figures, in its own units.
#[derive(Debug, Clone, PartialEq)]
pub struct LogFacts {
    /// Rows in the file.
    pub rows: usize,
    /// RMS of stamps against the uniform clock, s.
    pub jitter_rms: f64,
    /// The largest of these differences, s.
    pub jitter_max: f64,
    /// The columns that hold each triad's body axes right, front, up, as they stand in the file.
    pub columns: PerSensor<[ColumnFacts; 3]>,
    /// The temperature column, if there is one.
    pub temperature: Option<TemperatureFacts>,
}

/// One column of samples.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ColumnFacts {
    /// Its name in the file.
    pub name: String,
    /// The smallest value …
    pub smallest: f64,
    /// … and how many rows have it.
    pub at_smallest: usize,
    /// The largest value …
    pub largest: f64,
    /// … and how many rows have it.
    pub at_largest: usize,
    /// The step of the grid on which all values lie, if they do.
    pub step: Option<f64>,
}

/// A column of temperatures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TemperatureFacts {
    /// The smallest value.
    pub smallest: f64,
    /// The mean.
    pub mean: f64,
    /// The largest value.
    pub largest: f64,
}
