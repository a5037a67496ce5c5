//! Passes over a recording, and the callback that reports them.

use std::ops::ControlFlow;

use crate::calibration::CalibrationError;

/// One pass over the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pass {
    /// The largest change of any parameter from the linearisation point, in σ.
    pub largest_step: f64,
    /// Sum of squared whitened innovations, plus the prior term.
    pub cost: f64,
    /// Number of scalar observations that entered the cost.
    pub observations: usize,
}

/// Callback after each pass. The callback may stop the work. The command line uses it to display the progress.
pub type Progress<'a> = &'a (dyn Fn(&Pass) -> ControlFlow<()> + Sync);

/// A callback that does nothing.
pub const UNWATCHED: Progress<'static> = &|_| ControlFlow::Continue(());

/// Reports a pass.
///
/// # Errors
/// Returns [`CalibrationError::Stopped`] if the callback stops the work.
pub fn tell(progress: Progress, pass: &Pass) -> Result<(), CalibrationError> {
    match progress(pass) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(CalibrationError::Stopped),
    }
}
