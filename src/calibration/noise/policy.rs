//! Noise policy.

use serde::{Deserialize, Serialize};

/// The noise used by the filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoisePolicy {
    /// The stated noise.
    Stated,
    /// The stated noise, unless the data contradict it (p < 0.001); then the noise estimated from the
    /// data.
    #[default]
    Auto,
    /// The noise estimated from the data, with the stated noise as prior.
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
