//! Motion along a trajectory, in steps as long as the smoothness of the motion permits.

use std::convert::Infallible;

use nalgebra::Vector2;

use super::Trajectory;
use super::leg::Leg;
use crate::navigation::Instant;

/// The longest step, s: an eightieth of a radian of the Schuler oscillation, so that the Runge–Kutta method keeps its
/// phase over 40 h to 1e-7 rad.
const LONGEST: f64 = 10.0;
/// The largest turn in a step, rad: Simpson's rule then integrates along a turn to 4e-8.
const LARGEST_TURN: f64 = 0.1;

/// The minimum number of steps between two breaks if motion is not steady.
const LEAST: u32 = 8;

/// A step of smooth motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stride {
    /// Length, s.
    pub duration: f64,
    /// Instant in the middle of the step.
    pub middle: Instant,
    /// Instant at the end of the step.
    pub end: Instant,
}

impl Stride {
    /// Number of steps for a time in s with a rotation rate in rad/s.
    pub fn count(duration: f64, rate: f64) -> u32 {
        (duration * (rate / LARGEST_TURN).max(1.0 / LONGEST))
            .ceil()
            .max(1.0) as u32
    }
}

/// Motion along a trajectory, in steps that end at its discontinuities and resolve the motion between them.
#[derive(Debug, Clone)]
pub struct Strides<'a> {
    trajectory: &'a Trajectory,
    leg: Leg,
    /// Number of the segment after the leg.
    next: usize,
    time: f64,
    here: Instant,
}

impl Trajectory {
    /// Follows a trajectory in steps as long as its motion permits.
    pub fn strides(&self) -> Strides<'_> {
        let leg = Leg::before(&self.start);
        let place = Vector2::new(self.start.latitude, self.start.longitude);
        Strides {
            trajectory: self,
            leg,
            next: 0,
            time: 0.0,
            here: leg.at(0.0).instant(place, self.banks),
        }
    }
}

impl Strides<'_> {
    /// The current true state and sensed input.
    pub fn here(&self) -> &Instant {
        &self.here
    }

    /// Advances to the leg at this time.
    fn enter(&mut self) {
        let segments = &self.trajectory.segments;
        while self.leg.end() <= self.time {
            self.leg = self.leg.followed_by(&segments[self.next]);
            self.next = (self.next + 1) % segments.len();
        }
    }

    fn at(&self, time: f64, place: Vector2<f64>) -> Instant {
        self.leg.at(time).instant(place, self.trajectory.banks)
    }

    /// Continues until the given time, in s since the start, and passes each step to the caller. The computed solution
    /// rotates relative to the body at `beside` rad/s.
    ///
    /// # Errors
    /// The first error returned for a stride.
    pub fn go<E>(
        &mut self,
        until: f64,
        beside: f64,
        mut each: impl FnMut(&Stride) -> Result<(), E>,
    ) -> Result<(), E> {
        while self.time < until {
            let from = self.time;
            self.enter();
            let to = self.leg.next_break(from).min(until);
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

    /// Continues until the given time, in s since the start.
    pub fn pass(&mut self, until: f64) {
        let Ok(()) = self.go(until, 0.0, |_| Ok::<_, Infallible>(()));
    }

    /// Steps to a time without a break before it.
    fn steps(&self, to: f64, beside: f64) -> u32 {
        let duration = to - self.time;
        let middle = self.time + 0.5 * duration;
        // Heading rates are largest at an end, roll rates in the middle.
        let place = self.here.truth.place();
        let rates = [self.time, middle, to].map(|time| self.at(time, place).rate.norm());
        let fastest = rates.into_iter().fold(0.0, f64::max);
        let steady = self.leg.at(middle).is_steady();
        Stride::count(duration, fastest + beside).max(if steady { 1 } else { LEAST })
    }

    fn stride(&mut self, to: f64) -> Stride {
        let (from, start) = (self.time, self.here.truth);
        let duration = to - from;
        let at =
            |after: f64, rate: &Vector2<f64>| self.at(from + after, start.place() + rate * after);
        let rate = start.position_rate().xy();
        // An accuracy of metres is enough for the middle: Earth rate and gravity then change by a fraction of 1e-6.
        let middle = at(0.5 * duration, &rate);
        let rate_there = middle.truth.position_rate().xy();
        let mut end = at(duration, &rate_there);
        // Integration by Simpson's rule.
        let mean = (rate + rate_there * 4.0 + end.truth.position_rate().xy()) / 6.0;
        end.truth.latitude = start.latitude + mean.x * duration;
        end.truth.longitude = start.longitude + mean.y * duration;
        self.here = end;
        self.time = to;
        Stride {
            duration,
            middle,
            end,
        }
    }
}
