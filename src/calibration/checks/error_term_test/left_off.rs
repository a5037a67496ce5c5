//! What an error term does to an estimate that does without it.

use crate::calibration::parameters::ParameterVector;

/// 1σ of what an error term that is not estimated changes each parameter by: in no covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOff {
    /// Where its own parameters have their usual σ around zero.
    pub usual: ParameterVector,
    /// RMS where they are also as the record shows them.
    pub shown: ParameterVector,
}
