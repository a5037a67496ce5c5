//! The gate: which observations are let in.

use nalgebra::Vector3;

use crate::calibration::checks::innovation::{Innovation, Observation};
use crate::calibration::filter::{Innovations, ObservationJudge, Verdict};

/// After this many rejections in a row the gate doubts itself rather than the data.
const REOPEN: usize = 5;
/// So many right behind the only one that was let in speak against that one: it alone had a wide
/// innovation covariance, and two outliers in a row are rarer than one.
const BEHIND_THE_FIRST: usize = 2;
/// At most this many observations of a dwell are left out for having closed the gate.
const MOST_CLOSING: usize = 3;

/// Which observations a pass lets in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gate<'a> {
    /// All.
    Open,
    /// Those that its innovations do not make outliers.
    Innovations,
    /// Those of another pass, in their order.
    As(&'a [bool]),
}

/// Judges innovations.
pub struct Judge<'a> {
    gate: Gate<'a>,
    /// Squared whitened innovation beyond which an observation is an outlier.
    limit: f64,
    pub innovations: Vec<Innovation>,
    pub sums: Sums,
    dwell: Dwell,
}

/// Over all innovations.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sums {
    /// Whitened innovations squared; a rejected one counts as much as the gate lets pass.
    pub cost: f64,
    /// Logarithm of the determinant of the covariance of those let in.
    pub log_determinant: f64,
}

/// What the gate remembers of a dwell.
#[derive(Debug, Clone, Default)]
struct Dwell {
    /// Number of those that have begun before.
    number: Option<usize>,
    after_move: bool,
    /// Number of its first innovation, and sums before it.
    first: usize,
    before: Sums,
    /// Rejections in a row of each kind of observation.
    row: [usize; Observation::ALL.len()],
    /// Observations that are left out because they closed the gate to those after them.
    closing: Vec<usize>,
}

impl<'a> Judge<'a> {
    pub fn new(gate: Gate<'a>, limit: f64) -> Self {
        Self {
            gate,
            limit,
            innovations: Vec::new(),
            sums: Sums::default(),
            dwell: Dwell::default(),
        }
    }

    /// The observation that closed the gate: where several in a row were rejected, the dwell's first of
    /// their kind that was not. None if there is no such thing, or were too many already.
    fn closing(&self) -> Option<usize> {
        let Dwell {
            first,
            row,
            closing,
            ..
        } = &self.dwell;
        if closing.len() >= MOST_CLOSING {
            return None;
        }
        let row = |kind: Observation| row[kind as usize];
        let mut closed = Observation::ALL
            .into_iter()
            .filter(|&kind| row(kind) >= BEHIND_THE_FIRST);
        closed.find_map(|kind| {
            let of_dwell = self.innovations.iter().enumerate().skip(*first);
            let mut let_in = of_dwell.filter(|(_, i)| i.accepted && i.observation == kind);
            let (first, _) = let_in.next()?;
            let most = match let_in.next() {
                Some(_) => REOPEN,
                None => BEHIND_THE_FIRST,
            };
            (row(kind) >= most).then_some(first)
        })
    }

    fn is_accepted(&self, index: usize, kind: Observation, distance: f64) -> bool {
        match self.gate {
            Gate::Open => true,
            Gate::As(other) => other.get(index).copied().unwrap_or(true),
            Gate::Innovations => {
                let sound = distance <= self.limit && !self.dwell.closing.contains(&index);
                sound || self.dwell.row[kind as usize] >= REOPEN
            }
        }
    }
}

impl ObservationJudge for Judge<'_> {
    fn is_let_in(&mut self) -> bool {
        true
    }

    fn begin(&mut self, after_move: bool) {
        self.dwell = Dwell {
            number: Some(self.dwell.number.map_or(0, |number| number + 1)),
            after_move,
            first: self.innovations.len(),
            before: self.sums,
            ..Dwell::default()
        };
    }

    /// Without the observation that closed the gate.
    fn begin_again(&mut self) {
        self.dwell.row = Default::default();
        self.innovations.truncate(self.dwell.first);
        self.sums = self.dwell.before;
    }

    fn judge(&mut self, innovations: Innovations) -> Verdict {
        let Innovations {
            time,
            kind,
            scalars,
        } = innovations;
        let whitened = Vector3::from(scalars.map(|s| s.innovation / s.variance.sqrt()));
        let distance = whitened.norm_squared();
        let accepted = self.is_accepted(self.innovations.len(), kind, distance);
        let row = &mut self.dwell.row[kind as usize];
        if accepted {
            *row = 0;
            self.sums.cost += distance;
            let of_each = scalars.map(|s| s.variance);
            self.sums.log_determinant += of_each.iter().product::<f64>().ln();
        } else {
            *row += 1;
            self.sums.cost += self.limit;
        }
        self.innovations.push(Innovation {
            time,
            observation: kind,
            whitened: whitened.into(),
            accepted,
            dwell: self.dwell.number.unwrap_or(0),
            after_move: self.dwell.after_move,
        });
        if accepted {
            return Verdict::Accepted;
        }
        let closing = match self.gate {
            Gate::Innovations => self.closing(),
            Gate::Open | Gate::As(_) => None,
        };
        match closing {
            Some(closing) => {
                self.dwell.closing.push(closing);
                Verdict::Abandoned
            }
            None => Verdict::Rejected,
        }
    }
}
