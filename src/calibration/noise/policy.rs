//! Noise policy.

use serde::{Deserialize, Serialize};

/// The noise used by the filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoisePolicy {
    /// Use the noise that run.toml and models state
    Stated,
    /// Use the stated noise; estimate it from the recording if the two disagree (p < 0.001)
    #[default]
    Auto,
    /// Estimate the noise from the recording, with the stated noise as prior
    Learnt,
}

impl NoisePolicy {
    /// All policies.
    pub const ALL: [Self; 3] = [Self::Stated, Self::Auto, Self::Learnt];

    /// The name that command line and files use.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stated => "stated",
            Self::Auto => "auto",
            Self::Learnt => "learnt",
        }
    }
}
