//! Noise policy.

use serde::{Deserialize, Serialize};

/// The noise used by the filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoisePolicy {
    /// Use the noise stated in run.toml and models
    Stated,
    /// Estimate the noise from the recording, and use the stated noise as the prior
    #[default]
    Auto,
    /// The same as auto
    Learnt,
}

impl NoisePolicy {
    /// All policies.
    pub const ALL: [Self; 3] = [Self::Stated, Self::Auto, Self::Learnt];

    /// The name used on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stated => "stated",
            Self::Auto => "auto",
            Self::Learnt => "learnt",
        }
    }
}
