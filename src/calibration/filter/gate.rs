//! The gate: which observations are let in.

use nalgebra::Vector3;

use crate::calibration::{Innovation, Observation};

/// After this many rejections in a row the gate doubts itself rather than the data.
const REOPEN: usize = 5;
/// This many correct ones behind the only one that was let in speak against that one: it alone had a wide
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
    /// Those of another pass, in their order; those beyond its end, too.
    As(&'a [bool]),
}

/// What is done with an innovation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    Accepted,
    Rejected,
    /// The dwell is taken in again, without the observation that closed the gate.
    Abandoned,
}

/// Decides on observations, and keeps their innovations.
pub struct Judge<'a> {
    gate: Gate<'a>,
    /// Squared whitened innovation beyond which an observation is an outlier.
    limit: f64,
    pub innovations: Vec<Innovation>,
    /// Observations that were decided on without their innovations.
    unseen: usize,
    dwell: Dwell,
}

/// What the gate remembers of a dwell.
#[derive(Debug, Clone, Default)]
struct Dwell {
    /// Number of dwells that have begun.
    begun: usize,
    after_move: bool,
    /// Number of its first innovation.
    first: usize,
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
            unseen: 0,
            dwell: Dwell::default(),
        }
    }

    /// A dwell begins, after a move or not.
    pub fn begin(&mut self, after_move: bool) {
        self.dwell = Dwell {
            begun: self.dwell.begun + 1,
            after_move,
            first: self.innovations.len(),
            ..Dwell::default()
        };
    }

    /// The dwell begins again, without the observation that closed the gate.
    pub fn begin_again(&mut self) {
        self.dwell.row = Default::default();
        self.innovations.truncate(self.dwell.first);
    }

    /// Whether the next observation is let in, where innovations are not worked out.
    pub fn lets_in(&mut self) -> bool {
        self.unseen += 1;
        match self.gate {
            Gate::As(other) => other.get(self.unseen - 1).copied().unwrap_or(true),
            Gate::Open | Gate::Innovations => true,
        }
    }

    /// Decides by an innovation, whitened, and the σ of its components.
    pub fn judge(
        &mut self,
        (time, observation): (f64, Observation),
        whitened: Vector3<f64>,
        sigma: [f64; 3],
    ) -> Verdict {
        let kind = observation as usize;
        let accepted = self.is_accepted(observation, whitened.norm_squared());
        self.dwell.row[kind] = match accepted {
            true => 0,
            false => self.dwell.row[kind] + 1,
        };
        self.innovations.push(Innovation {
            time,
            observation,
            whitened: whitened.into(),
            sigma,
            accepted,
            dwell: self.dwell.begun.saturating_sub(1),
            after_move: self.dwell.after_move,
        });
        let closing = self.closing().filter(|_| !accepted);
        self.dwell.closing.extend(closing);
        match (accepted, closing) {
            (true, _) => Verdict::Accepted,
            (false, Some(_)) => Verdict::Abandoned,
            (false, None) => Verdict::Rejected,
        }
    }

    fn is_accepted(&self, kind: Observation, distance: f64) -> bool {
        let index = self.innovations.len();
        match self.gate {
            Gate::Open => true,
            Gate::As(other) => other.get(index).copied().unwrap_or(true),
            Gate::Innovations => {
                let sound = distance <= self.limit && !self.dwell.closing.contains(&index);
                sound || self.dwell.row[kind as usize] >= REOPEN
            }
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
        if self.gate != Gate::Innovations || closing.len() >= MOST_CLOSING {
            return None;
        }
        Observation::ALL.into_iter().find_map(|kind| {
            let rejected = row[kind as usize];
            let of_dwell = self.innovations.iter().enumerate().skip(*first);
            let mut let_in = of_dwell.filter(|(_, i)| i.accepted && i.observation == kind);
            let (first, _) = let_in.next().filter(|_| rejected >= BEHIND_THE_FIRST)?;
            (rejected >= REOPEN || let_in.next().is_none()).then_some(first)
        })
    }
}
