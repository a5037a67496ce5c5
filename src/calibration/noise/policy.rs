//! Which noise is used.

use serde::{Deserialize, Serialize};

/// Which noise the filter uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoisePolicy {
    /// What is stated.
    Stated,
    /// What is stated unless the data contradict it, which right figures do in one run of a thousand;
    /// else what the data show.
    #[default]
    Auto,
    /// What the data show, around what is stated.
    Learnt,
}

impl NoisePolicy {
    /// All of them.
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
