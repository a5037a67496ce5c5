//! A transition, and the observations after it.

use nalgebra::Matrix3;

use super::given::Given;
use super::rows::Rows;
use super::transition::Transition;

/// A transition, and the observations after it.
#[derive(Debug, Clone)]
pub struct Link {
    /// Whether a stretch begins here.
    pub begins: bool,
    /// Number of the recording that contains the link.
    pub recording: usize,
    /// Number of the dwell that contains the observations.
    pub dwell: usize,
    /// Computed attitude, if a dwell begins here.
    pub attitude: Option<Matrix3<f64>>,
    /// End of the part, s.
    pub time: f64,
    pub transition: Transition,
    pub rows: Rows,
    /// Quantities that are given to the part of the dwell.
    pub given: Given,
}
