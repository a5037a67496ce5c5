//! Error terms, which may be estimated in addition to scale factors, misalignments and biases.

use serde::{Deserialize, Serialize};

use crate::imu::Term;
use crate::turntable::AxisError;

/// An error of instrument or table that is estimated if switched on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ErrorTerm {
    /// Biases that vary as first-order Gauss–Markov processes.
    GaussMarkovBias,
    /// Level and north of the table's base.
    TableBase,
    /// Errors of the table axes: tilts of all except the outermost, wobble, encoders.
    TableAxes(AxisError),
    /// A term of the instrument's error model.
    Instrument(Term),
}

impl ErrorTerm {
    /// Every error term. If two terms explain a recording equally well, the one that comes first in this order is more
    /// common.
    pub const ALL: [Self; 5 + Term::ALL.len()] = {
        let mut all = [Self::GaussMarkovBias; 5 + Term::ALL.len()];
        (all[1], all[2]) = (Self::TableBase, Self::TableAxes(AxisError::Tilt));
        let mut k = 0;
        while k < Term::ALL.len() {
            all[3 + k] = Self::Instrument(Term::ALL[k]);
            k += 1;
        }
        all[3 + k] = Self::TableAxes(AxisError::Wobble);
        all[4 + k] = Self::TableAxes(AxisError::Encoder);
        all
    };

    /// Error terms that are constant over a run.
    pub fn constant() -> impl Iterator<Item = Self> {
        let all = Self::ALL.into_iter();
        all.filter(|&term| term != Self::GaussMarkovBias)
    }

    /// The name used in files and commands.
    pub fn name(self) -> &'static str {
        match self {
            Self::GaussMarkovBias => "gauss-markov-bias",
            Self::TableBase => "table-base",
            Self::TableAxes(AxisError::Tilt) => "table-axes",
            Self::TableAxes(AxisError::Wobble) => "table-wobble",
            Self::TableAxes(AxisError::Encoder) => "table-encoder",
            Self::Instrument(term) => term.name(),
        }
    }

    /// The term with the same effect if an axis is only up and down or turns at one rate: both are even in force or
    /// rate. Therefore the two are absent or present together.
    pub(in crate::calibration) fn alike(self) -> Self {
        Self::Instrument(match self {
            Self::Instrument(Term::AccelAsymmetry) => Term::AccelSecondOrder,
            Self::Instrument(Term::GyroSecondOrder) => Term::GyroAsymmetry,
            _ => return self,
        })
    }

    /// Moves or dwells that show the term, if a path does not.
    pub fn shown_by(self) -> &'static str {
        match self {
            Self::GaussMarkovBias => "a long dwell",
            Self::TableBase => "long dwells with each axis up and down",
            Self::TableAxes(AxisError::Tilt) => "dwells at several angles of each table axis",
            Self::TableAxes(_) => "dwells at eight angles of each table axis",
            Self::Instrument(term) => term.entry().shown_by,
        }
    }

    /// Number of states.
    pub fn states(self) -> usize {
        match self {
            Self::GaussMarkovBias => 6,
            Self::TableBase => 3,
            Self::TableAxes(kind) => kind.range().len(),
            Self::Instrument(term) => term.parameters().len(),
        }
    }
}
