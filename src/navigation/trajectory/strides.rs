//! A journey in steps as long as what is smooth allows.

use nalgebra::Vector3;

use super::Trajectory;
use super::leg::{Kinematics, Legs};
use crate::navigation::{Instant, Stride};

/// At least so many steps between two breaks where motion is not steady.
const LEAST: u32 = 8;

/// A journey along a trajectory in steps that end at its breaks and follow what happens between them.
#[derive(Debug, Clone)]
pub struct Strides<'a> {
    banks: bool,
    legs: Legs<'a>,
    time: f64,
    here: Instant,
}

impl<'a> Strides<'a> {
    pub(super) fn new(trajectory: &'a Trajectory) -> Self {
        let start = trajectory.start();
        let mut legs = Legs::new(trajectory);
        legs.enter(0.0);
        let place = start.place();
        let banks = trajectory.banks;
        Self {
            banks,
            here: legs.current.at(0.0).instant(&place, banks),
            legs,
            time: 0.0,
        }
    }

    /// The true state now and what is sensed in it.
    pub fn here(&self) -> &Instant {
        &self.here
    }

    /// Goes on until a time in s since the start and hands over every stride. What is computed on the way turns
    /// at so many rad/s beside the body.
    ///
    /// # Errors
    /// The first that is returned for a stride.
    pub fn go<E>(
        &mut self,
        until: f64,
        beside: f64,
        mut each: impl FnMut(&Stride) -> Result<(), E>,
    ) -> Result<(), E> {
        while self.time < until {
            let from = self.time;
            self.legs.enter(from);
            let to = self.legs.current.next_break(from).min(until);
            let steps = self.steps(to, beside);
            for k in 1..=steps {
                let part = f64::from(k) / f64::from(steps);
                let stride = self.stride(from + (to - from) * part);
                each(&stride)?;
            }
            self.time = to;
        }
        Ok(())
    }

    /// Steps to a time before which nothing breaks.
    fn steps(&self, to: f64, beside: f64) -> u32 {
        let duration = to - self.time;
        let at = |time: f64| self.legs.current.at(time);
        let middle = at(self.time + 0.5 * duration);
        let rate = |kinematics: &Kinematics| {
            let there = kinematics.instant(&self.here.truth, self.banks);
            there.rate.norm()
        };
        // Rates of heading are largest at an end, those of roll in the middle.
        let fastest = rate(&at(self.time)).max(rate(&middle)).max(rate(&at(to)));
        let least = if middle.is_steady() { 1 } else { LEAST };
        Stride::count(duration, fastest + beside).max(least)
    }

    fn stride(&mut self, to: f64) -> Stride {
        let duration = to - self.time;
        let (start, leg) = (self.here, &self.legs.current);
        let at = |after: f64, moved: &Vector3<f64>| {
            let place = start.truth.moved(moved);
            leg.at(self.time + after).instant(&place, self.banks)
        };
        // Metres are enough for the middle: they change Earth rate and gravity by 1e-6 of themselves.
        let half = 0.5 * duration;
        let rate = start.truth.position_rate();
        let middle = at(half, &(rate * half));
        let rate_there = middle.truth.position_rate();
        let mut end = at(duration, &(rate_there * duration));
        // Simpson's rule.
        let mean = (rate + rate_there * 4.0 + end.truth.position_rate()) / 6.0;
        let place = start.truth.moved(&(mean * duration));
        end.truth.latitude = place.latitude;
        end.truth.longitude = place.longitude;
        self.here = end;
        self.time = to;
        Stride {
            duration,
            middle,
            end,
        }
    }
}
