//! Error for a calibration that does not meet a requirement.

/// The calibration succeeded, but a requirement is not met.
#[derive(Debug, thiserror::Error)]
pub enum NotMet {
    /// Limits of a specification.
    #[error("the specification is not met: {0}")]
    Specification(String),
    /// Parameters of --require.
    #[error("{0}")]
    Required(String),
}
