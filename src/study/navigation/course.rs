//! A body's true motion step by step, whether it stands or moves.

use nalgebra::Vector3;

use super::Motion;
use crate::navigation::{Increments, Solution, Travel};

pub(super) enum Course<'a> {
    Standing {
        truth: &'a Solution,
        increments: Increments,
    },
    Moving(Box<Travel<'a>>),
}

impl<'a> Course<'a> {
    /// Begins to go in steps of `period` seconds.
    pub(super) fn new(motion: &'a Motion, period: f64) -> Self {
        match motion {
            Motion::Standing(truth) => {
                let (rate, force) = truth.steady();
                Self::Standing {
                    truth,
                    increments: Increments {
                        angle: rate * period,
                        velocity: force * period,
                    },
                }
            }
            Motion::Moving(trajectory) => Self::Moving(Box::new(trajectory.travel(period))),
        }
    }

    /// The true state now.
    pub(super) fn truth(&self) -> &Solution {
        match self {
            Self::Standing { truth, .. } => truth,
            Self::Moving(travel) => travel.truth(),
        }
    }

    /// Angular rate (rad/s) and specific force (m/s²) along body axes now.
    pub(super) fn sensed(&self) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Self::Standing { truth, .. } => truth.steady(),
            Self::Moving(travel) => travel.sensed(),
        }
    }

    /// Whether velocity and attitude stay as they are for some seconds.
    pub(super) fn is_steady_for(&self, duration: f64) -> bool {
        match self {
            Self::Standing { .. } => true,
            Self::Moving(travel) => travel.is_steady_for(duration),
        }
    }

    /// Goes on by a step and gives what an ideal instrument senses in it.
    pub(super) fn advance(&mut self) -> Increments {
        match self {
            Self::Standing { increments, .. } => *increments,
            Self::Moving(travel) => travel.advance(),
        }
    }
}
