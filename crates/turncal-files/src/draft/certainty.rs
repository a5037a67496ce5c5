//! Certainty of what a log shows.

/// Certainty of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certainty {
    /// Stated in the log and confirmed by motion, determined by motion alone, or stated by the user.
    Certain,
    /// Stated in the log or typical, but not confirmed by motion.
    Guess,
    /// Neither.
    Unknown,
}

impl Certainty {
    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Certain => "certain",
            Self::Guess => "guess",
            Self::Unknown => "unknown",
        }
    }
}
