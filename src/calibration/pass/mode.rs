//! How a pass treats its estimates, and which observations it lets in.

use crate::calibration::checks::innovation::Innovation;

/// How a pass treats its estimates and its gate.
#[derive(Debug, Clone, Copy)]
pub enum Mode<'a> {
    /// Estimates are fed back as they come.
    Feedback,
    /// Linearisation is held at the given point.
    Held(Gate<'a>),
}

/// Which observations a pass lets in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gate<'a> {
    /// All.
    Open,
    /// Those that its innovations do not make outliers.
    Innovations,
    /// Those of another pass, in their order.
    As(&'a [Innovation]),
}
