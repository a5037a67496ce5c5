//! The gate: acceptance of observations.

use nalgebra::Vector3;

use crate::calibration::{Innovation, Observation};

/// After this many consecutive rejections, the gate suspects the first accepted observation instead.
const REOPEN: usize = 5;
/// Number of rejected observations that discredit a preceding single accepted one: only that one had a wide innovation
/// covariance, and two consecutive outliers are rarer than one.
const BEHIND_THE_FIRST: usize = 2;
/// Maximum number of observations per dwell dropped because they closed the gate.
const MOST_CLOSING: usize = 3;

/// Rule for the acceptance of observations in a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gate<'a> {
    /// All.
    Open,
    /// Accept observations whose innovations are not outliers.
    Innovations,
    /// Accept as in a given pass, in the same order; accept all beyond its end.
    As(&'a [bool]),
}

/// Decision on an innovation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decision {
    Accepted,
    Rejected,
    /// The dwell is processed again, without the observation that closed the gate.
    Abandoned,
}

/// Decides on observations, and keeps their innovations.
pub struct Judge<'a> {
    gate: Gate<'a>,
    /// Squared whitened innovation beyond which an observation is an outlier.
    limit: f64,
    pub innovations: Vec<Innovation>,
    /// Number of observations decided without their innovations.
    unseen: usize,
    dwell: Dwell,
}

/// State of the gate in a dwell.
#[derive(Debug, Clone, Default)]
struct Dwell {
    /// Number of dwells started.
    begun: usize,
    after_move: bool,
    /// Number of its first innovation.
    first: usize,
    /// Consecutive rejections of each kind of observation.
    row: [usize; Observation::ALL.len()],
    /// Observations that are dropped because they closed the gate to later ones.
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

    /// Starts a dwell, whether or not after a move.
    pub fn begin(&mut self, after_move: bool) {
        self.dwell = Dwell {
            begun: self.dwell.begun + 1,
            after_move,
            first: self.innovations.len(),
            ..Dwell::default()
        };
    }

    /// Restarts the dwell, without the observation that closed the gate.
    pub fn begin_again(&mut self) {
        self.dwell.row = Default::default();
        self.innovations.truncate(self.dwell.first);
    }

    /// Whether the next observation is accepted, if innovations are not computed.
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
    ) -> Decision {
        let kind = observation as usize;
        let accepted = self.is_accepted(observation, whitened.norm_squared());
        self.dwell.row[kind] = if accepted {
            0
        } else {
            self.dwell.row[kind] + 1
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
            (true, _) => Decision::Accepted,
            (false, Some(_)) => Decision::Abandoned,
            (false, None) => Decision::Rejected,
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

    /// The observation that closed the gate: after several consecutive rejections, the dwell's first accepted one of
    /// their kind. `None` if there is none, or if too many were dropped already.
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
