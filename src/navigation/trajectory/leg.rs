//! A segment at its place in time, with its motion.

use nalgebra::{Vector2, Vector3};

use super::segment::{Change, Segment, Start};
use crate::attitude::from_pitch_roll_heading;
use crate::navigation::{Instant, Solution};
use crate::turntable::{Profile, Turned};
use crate::units::STANDARD_GRAVITY;

const SPEED: usize = 0;
const HEIGHT: usize = 2;

/// A segment at its place in time; quantities are speed, heading and height, in this order.
#[derive(Debug, Clone, Copy)]
pub struct Leg {
    start: f64,
    pub duration: f64,
    /// Speed, heading and height at the start of the segment.
    from: [f64; 3],
    changes: [Profile; 3],
}

/// Speed, heading and height with their first and second derivatives.
#[derive(Debug, Clone, Copy)]
pub struct Kinematics([Turned; 3]);

impl Leg {
    /// An empty leg that ends at a start.
    pub fn before(start: &Start) -> Self {
        Self {
            start: 0.0,
            duration: 0.0,
            from: [start.speed, start.heading, start.height],
            changes: [none(); 3],
        }
    }

    pub fn followed_by(&self, segment: &Segment) -> Self {
        let Kinematics(end) = self.at(self.end());
        let from = end.map(|of| of.angle);
        let to = |change: Option<Change>, from: f64| match change {
            Some(c) => Profile::limited(c.amount - from, c.rate, c.acceleration),
            None => none(),
        };
        let turn = segment.turn;
        let changes = [
            to(segment.speed, from[SPEED]),
            Profile::limited(turn.amount, turn.rate, turn.acceleration),
            to(segment.height, from[HEIGHT]),
        ];
        let longest = changes.iter().map(Profile::duration);
        Self {
            start: self.end(),
            duration: longest.fold(segment.duration, f64::max),
            from,
            changes,
        }
    }

    pub fn end(&self) -> f64 {
        self.start + self.duration
    }

    pub fn at(&self, time: f64) -> Kinematics {
        Kinematics(std::array::from_fn(|k| {
            let mut turned = self.changes[k].at(time - self.start);
            turned.angle += self.from[k];
            turned
        }))
    }

    /// The lower of the horizontal speeds at start and end, m/s.
    pub fn lower_speed(&self) -> f64 {
        self.from[SPEED].min(self.at(self.end()).0[SPEED].angle)
    }

    /// The peak rate of climb or descent, m/s.
    pub fn climb_rate(&self) -> f64 {
        self.changes[HEIGHT].peak_rate()
    }

    /// The time of the next jump of a third derivative; if there is none, the end of the leg.
    pub fn next_break(&self, after: f64) -> f64 {
        self.changes
            .iter()
            .flat_map(Profile::breaks)
            .map(|time| self.start + time)
            .filter(|&time| time > after)
            .fold(self.end(), f64::min)
    }
}

impl Kinematics {
    /// Pitch and roll in rad, each with its rate in rad/s.
    fn pitch_and_roll(&self, banks: bool) -> [(f64, f64); 2] {
        let Self([speed, heading, height]) = self;
        // A body that does not climb may be stationary.
        let pitch = if height.rate == 0.0 && height.acceleration == 0.0 {
            (0.0, 0.0)
        } else {
            let across = height.acceleration * speed.angle - height.rate * speed.rate;
            let squared = speed.angle * speed.angle + height.rate * height.rate;
            (height.rate.atan2(speed.angle), across / squared)
        };
        let roll = if banks {
            let tangent = speed.angle * heading.rate / STANDARD_GRAVITY;
            let change = speed.rate * heading.rate + speed.angle * heading.acceleration;
            let rate = change / STANDARD_GRAVITY / (1.0 + tangent * tangent);
            (tangent.atan(), rate)
        } else {
            (0.0, 0.0)
        };
        [pitch, roll]
    }

    /// Whether only the position changes.
    pub fn is_steady(&self) -> bool {
        let Self([speed, heading, height]) = self;
        let changes = [
            speed.rate,
            speed.acceleration,
            heading.rate,
            heading.acceleration,
        ];
        changes == [0.0; 4] && height.acceleration == 0.0
    }

    /// The true state at this latitude and longitude, with the sensed input.
    pub fn instant(&self, place: Vector2<f64>, banks: bool) -> Instant {
        let Self([speed, heading, height]) = self;
        let [(pitch, pitch_rate), (roll, roll_rate)] = self.pitch_and_roll(banks);
        let (sin, cos) = heading.angle.sin_cos();
        let (forward, right) = (Vector3::new(sin, cos, 0.0), Vector3::new(cos, -sin, 0.0));
        let truth = Solution {
            attitude: from_pitch_roll_heading(pitch, roll, heading.angle),
            velocity: forward * speed.angle + Vector3::z() * height.rate,
            latitude: place.x,
            longitude: place.y,
            height: height.angle,
        };
        let turning =
            right * pitch_rate + truth.attitude.column(1) * roll_rate - Vector3::z() * heading.rate;
        let acceleration = forward * speed.rate
            + right * (speed.angle * heading.rate)
            + Vector3::z() * height.acceleration;
        Instant::of(truth, &turning, &acceleration)
    }
}

/// No change.
fn none() -> Profile {
    Profile::limited(0.0, 1.0, 1.0)
}
