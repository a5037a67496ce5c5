//! Error terms: what may be estimated beside scale factors, installation and biases.

use crate::imu::Term;
use crate::turntable::AXIS_TILTS;

/// An error of instrument or table that is estimated where it is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorTerm {
    /// Biases that vary as first-order Gauss–Markov processes.
    GaussMarkovBias,
    /// Level and north of the table's base.
    TableBase,
    /// Tilts of the table's axes within the outermost.
    TableAxes,
    /// A term of the instrument's error model.
    Instrument(Term),
}

impl ErrorTerm {
    /// Every error term.
    pub const ALL: [Self; 8] = [
        Self::GaussMarkovBias,
        Self::TableBase,
        Self::TableAxes,
        Self::Instrument(Term::AccelSecondOrder),
        Self::Instrument(Term::AccelAsymmetry),
        Self::Instrument(Term::SizeEffect),
        Self::Instrument(Term::TimeOffset),
        Self::Instrument(Term::GSensitivity),
    ];

    /// Those that are constant over a run.
    pub fn constant() -> impl Iterator<Item = Self> {
        let all = Self::ALL.into_iter();
        all.filter(|&term| term != Self::GaussMarkovBias)
    }

    /// The name that files and commands use.
    pub fn name(self) -> &'static str {
        match self {
            Self::GaussMarkovBias => "gauss-markov-bias",
            Self::TableBase => "table-base",
            Self::TableAxes => "table-axes",
            Self::Instrument(term) => term.name(),
        }
    }

    /// How many states it has.
    pub fn states(self) -> usize {
        match self {
            Self::GaussMarkovBias => 6,
            Self::TableBase => 3,
            Self::TableAxes => AXIS_TILTS,
            Self::Instrument(term) => term.parameters().len(),
        }
    }
}
