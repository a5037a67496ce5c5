//! Requirements on a calibration that are not met.

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
