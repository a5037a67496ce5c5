//! What was asked of a calibration and is not met.

/// It was calibrated, but what was asked of it is not met.
#[derive(Debug, thiserror::Error)]
pub enum NotMet {
    /// Limits of a specification.
    #[error("the specification is not met: {0}")]
    Specification(String),
    /// Parameters of --require.
    #[error("{0}")]
    Required(String),
}
