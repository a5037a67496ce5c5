//! The gate: which observations are let in.

use nalgebra::Vector3;

use super::mode::{Gate, Mode};
use crate::calibration::checks::innovation::{Innovation, Observation};
use crate::calibration::filter::{Innovations, ObservationJudge, Verdict};
use crate::calibration::model::Model;
use crate::calibration::problem::Stretch;
use crate::calibration::record::segment::Seen;

/// After this many rejections in a row the gate doubts itself rather than the data.
const REOPEN: usize = 5;
/// So many right behind the only one that was let in speak against that one: it alone had a wide
/// innovation covariance, and two outliers in a row are rarer than one.
const BEHIND_THE_FIRST: usize = 2;
/// At most this many observations of a dwell are left out for having closed the gate.
const MOST_CLOSING: usize = 3;

/// What the gate remembers of a dwell.
#[derive(Debug, Clone, Default)]
pub struct Memory {
    /// Number of the dwell's first innovation.
    first: usize,
    /// Rejections in a row of each kind of observation.
    row: [usize; Observation::ALL.len()],
    /// Observations that are left out because they closed the gate to those after them.
    closing: Vec<usize>,
}

/// Judges the innovations of a dwell.
pub struct Judge<'a> {
    pub stretch: &'a Stretch<'a>,
    pub model: &'a Model,
    pub mode: Mode<'a>,
    /// Squared whitened innovation beyond which an observation is an outlier.
    pub limit: f64,
    pub dwell: usize,
    pub after_move: bool,
    pub memory: &'a mut Memory,
    pub innovations: &'a mut Vec<Innovation>,
    pub cost: &'a mut f64,
    pub log_determinant: &'a mut f64,
}

impl Memory {
    /// A dwell begins after so many innovations.
    pub fn of_dwell(first: usize) -> Self {
        Self {
            first,
            ..Self::default()
        }
    }

    /// Begins the dwell once more without the observation that closed the gate.
    pub fn again(&mut self) {
        self.row = Default::default();
    }

    /// The observation that closed the gate: where several in a row were rejected, the dwell's first of
    /// their kind that was not. None if there is no such thing, or were too many already.
    fn closing(&self, innovations: &[Innovation]) -> Option<usize> {
        if self.closing.len() >= MOST_CLOSING {
            return None;
        }
        let row = |kind: Observation| self.row[kind as usize];
        let mut closed = Observation::ALL
            .into_iter()
            .filter(|&kind| row(kind) >= BEHIND_THE_FIRST);
        closed.find_map(|kind| {
            let of_dwell = innovations.iter().enumerate().skip(self.first);
            let mut let_in = of_dwell.filter(|(_, i)| i.accepted && i.observation == kind);
            let (first, _) = let_in.next()?;
            let most = match let_in.next() {
                Some(_) => REOPEN,
                None => BEHIND_THE_FIRST,
            };
            (row(kind) >= most).then_some(first)
        })
    }
}

impl ObservationJudge for Judge<'_> {
    fn variance(&self, seen: &Seen) -> f64 {
        self.stretch
            .observation_variance(self.model, seen.kind, seen.readings)
    }

    fn judge(&mut self, innovations: Innovations) -> Verdict {
        let Innovations {
            time,
            kind,
            scalars,
        } = innovations;
        let whitened = Vector3::from(scalars.map(|s| s.innovation / s.variance.sqrt()));
        let distance = whitened.norm_squared();
        let index = self.innovations.len();
        let row = &mut self.memory.row[kind as usize];
        let accepted = match self.mode {
            Mode::Held(Gate::Open) => true,
            Mode::Held(Gate::As(other)) => other.get(index).is_none_or(|i| i.accepted),
            Mode::Held(Gate::Innovations) | Mode::Feedback => {
                let sound = distance <= self.limit && !self.memory.closing.contains(&index);
                sound || *row >= REOPEN
            }
        };
        if accepted {
            *row = 0;
            *self.cost += distance;
            let of_each = scalars.map(|s| s.variance);
            *self.log_determinant += of_each.iter().product::<f64>().ln();
        } else {
            *row += 1;
            *self.cost += self.limit;
        }
        self.innovations.push(Innovation {
            time,
            observation: kind,
            whitened: whitened.into(),
            accepted,
            dwell: self.dwell,
            after_move: self.after_move,
        });
        if accepted {
            return Verdict::Accepted;
        }
        if matches!(self.mode, Mode::Held(Gate::As(_))) {
            return Verdict::Rejected;
        }
        match self.memory.closing(self.innovations) {
            Some(closing) => {
                self.memory.closing.push(closing);
                Verdict::Abandoned
            }
            None => Verdict::Rejected,
        }
    }
}
