//! A body's true motion step by step, whether it stands or moves.

use super::Motion;
use crate::navigation::{Instant, Stride, Strides};

pub(super) enum Course<'a> {
    Standing { here: Instant, time: f64 },
    Moving(Box<Strides<'a>>),
}

impl<'a> Course<'a> {
    pub(super) fn new(motion: &'a Motion) -> Self {
        match motion {
            Motion::Standing(truth) => Self::Standing {
                here: truth.steady(),
                time: 0.0,
            },
            Motion::Moving(trajectory) => Self::Moving(Box::new(trajectory.strides())),
        }
    }

    /// The true state now and what is sensed in it.
    pub(super) fn here(&self) -> &Instant {
        match self {
            Self::Standing { here, .. } => here,
            Self::Moving(strides) => strides.here(),
        }
    }

    /// Goes on until a time in s since the start, as [`Strides::go`] does.
    pub(super) fn go<E>(
        &mut self,
        until: f64,
        beside: f64,
        mut each: impl FnMut(&Stride) -> Result<(), E>,
    ) -> Result<(), E> {
        match self {
            Self::Standing { here, time } => {
                let steps = Stride::count(until - *time, here.rate.norm() + beside);
                let stride = Stride {
                    duration: (until - *time) / f64::from(steps),
                    middle: *here,
                    end: *here,
                };
                *time = until;
                (0..steps).try_for_each(|_| each(&stride))
            }
            Self::Moving(strides) => strides.go(until, beside, each),
        }
    }
}
