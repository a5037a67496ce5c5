//! How well a table's readings tell its attitude.

use super::TableGeometry;

/// 1σ of what a table's log is wrong by.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TableAccuracy {
    /// Per axis of the position error, constant while the table is at rest and new at every position,
    /// rad.
    pub position_sigma: f64,
    /// Per axis of the white error of each reading, rad.
    pub reading_sigma: f64,
    /// Of what it does not read.
    pub geometry: TableGeometry,
}
