//! A segment that has its place in time, and what moves in it.

use nalgebra::Vector3;

use super::{Change, Segment, Start, Trajectory};
use crate::attitude::from_pitch_roll_heading;
use crate::earth::earth_rate_n;
use crate::navigation::{Instant, Solution};
use crate::turntable::{Profile, Turned};
use crate::units::STANDARD_GRAVITY;

const SPEED: usize = 0;
const HEADING: usize = 1;
const HEIGHT: usize = 2;

/// A segment that has its place in time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leg {
    start: f64,
    pub(super) duration: f64,
    /// Speed, heading and height at its start.
    from: [f64; 3],
    speed: Profile,
    heading: Profile,
    height: Profile,
}

/// Speed, heading and height with their first and second derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kinematics {
    speed: Turned,
    heading: Turned,
    pub(super) height: Turned,
}

/// The legs of a trajectory, one after the other without end.
#[derive(Debug, Clone)]
pub(super) struct Legs<'a> {
    segments: &'a [Segment],
    pub(super) current: Leg,
    next: usize,
}

impl<'a> Legs<'a> {
    pub(super) fn new(trajectory: &'a Trajectory) -> Self {
        Self {
            segments: &trajectory.segments,
            current: Leg::before(&trajectory.start),
            next: 0,
        }
    }

    /// Goes to the leg of a time.
    pub(super) fn enter(&mut self, time: f64) {
        while self.current.end() <= time {
            self.current = self.current.followed_by(&self.segments[self.next]);
            self.next = (self.next + 1) % self.segments.len();
        }
    }
}

impl Leg {
    /// A leg of no length that ends at a start.
    pub(super) fn before(start: &Start) -> Self {
        let none = Profile::limited(0.0, 1.0, 1.0);
        Self {
            start: 0.0,
            duration: 0.0,
            from: [start.speed, start.heading, start.height],
            speed: none,
            heading: none,
            height: none,
        }
    }

    pub(super) fn followed_by(&self, segment: &Segment) -> Self {
        let end = self.at(self.end());
        let from = [end.speed.angle, end.heading.angle, end.height.angle];
        let to = |change: Option<Change>, from: f64| match change {
            Some(c) => Profile::limited(c.amount - from, c.rate, c.acceleration),
            None => Profile::limited(0.0, 1.0, 1.0),
        };
        let turn = segment.turn;
        let mut leg = Self {
            start: self.end(),
            duration: segment.duration,
            from,
            speed: to(segment.speed, from[SPEED]),
            heading: Profile::limited(turn.amount, turn.rate, turn.acceleration),
            height: to(segment.height, from[HEIGHT]),
        };
        for profile in leg.profiles() {
            leg.duration = leg.duration.max(profile.duration());
        }
        leg
    }

    fn profiles(&self) -> [Profile; 3] {
        [self.speed, self.heading, self.height]
    }

    pub(super) fn end(&self) -> f64 {
        self.start + self.duration
    }

    pub(super) fn at(&self, time: f64) -> Kinematics {
        let of = |profile: &Profile, from: f64| {
            let turned = profile.at(time - self.start);
            Turned {
                angle: from + turned.angle,
                ..turned
            }
        };
        Kinematics {
            speed: of(&self.speed, self.from[SPEED]),
            heading: of(&self.heading, self.from[HEADING]),
            height: of(&self.height, self.from[HEIGHT]),
        }
    }

    /// The lower of the horizontal speeds at start and end, m/s.
    pub(super) fn lower_speed(&self) -> f64 {
        self.from[SPEED].min(self.at(self.end()).speed.angle)
    }

    /// The peak rate of climb or descent, m/s.
    pub(super) fn climb_rate(&self) -> f64 {
        self.height.peak_rate()
    }

    /// The next time after this one where a third derivative jumps, the end at the latest.
    pub(super) fn next_break(&self, after: f64) -> f64 {
        self.profiles()
            .iter()
            .flat_map(Profile::breaks)
            .map(|time| self.start + time)
            .filter(|&time| time > after)
            .fold(self.end(), f64::min)
    }
}

impl Kinematics {
    pub(super) fn velocity(&self) -> Vector3<f64> {
        let (sin, cos) = self.heading.angle.sin_cos();
        let speed = self.speed.angle;
        Vector3::new(speed * sin, speed * cos, self.height.rate)
    }

    /// Derivative of the velocity's components.
    pub(super) fn acceleration(&self) -> Vector3<f64> {
        let (sin, cos) = self.heading.angle.sin_cos();
        let across = self.speed.angle * self.heading.rate;
        Vector3::new(
            self.speed.rate * sin + across * cos,
            self.speed.rate * cos - across * sin,
            self.height.acceleration,
        )
    }

    /// Pitch and roll in rad, each with its rate in rad/s.
    fn pitch_and_roll(&self, banks: bool) -> [(f64, f64); 2] {
        let (speed, climb) = (self.speed.angle, self.height.rate);
        // A body that does not climb may stand.
        let pitch = if climb == 0.0 && self.height.acceleration == 0.0 {
            (0.0, 0.0)
        } else {
            let across = self.height.acceleration * speed - climb * self.speed.rate;
            (climb.atan2(speed), across / (speed * speed + climb * climb))
        };
        let roll = if banks {
            let tangent = speed * self.heading.rate / STANDARD_GRAVITY;
            let change = self.speed.rate * self.heading.rate + speed * self.heading.acceleration;
            let rate = change / STANDARD_GRAVITY / (1.0 + tangent * tangent);
            (tangent.atan(), rate)
        } else {
            (0.0, 0.0)
        };
        [pitch, roll]
    }

    /// Whether nothing but position changes.
    pub(super) fn is_steady(&self) -> bool {
        self.speed.rate == 0.0
            && self.speed.acceleration == 0.0
            && self.heading.rate == 0.0
            && self.heading.acceleration == 0.0
            && self.height.acceleration == 0.0
    }

    /// The true state at this place, of which velocity and attitude are set.
    pub(super) fn placed(&self, place: &Solution, banks: bool) -> Solution {
        let [(pitch, _), (roll, _)] = self.pitch_and_roll(banks);
        Solution {
            attitude: from_pitch_roll_heading(pitch, roll, self.heading.angle),
            velocity: self.velocity(),
            height: self.height.angle,
            ..*place
        }
    }

    /// The true state at this place and what is sensed in it.
    pub(super) fn instant(&self, place: &Solution, banks: bool) -> Instant {
        let truth = self.placed(place, banks);
        let (rate, force) = self.sensed(&truth, banks);
        Instant { truth, rate, force }
    }

    /// Angular rate (rad/s) and specific force (m/s²) along body axes.
    pub(super) fn sensed(&self, truth: &Solution, banks: bool) -> (Vector3<f64>, Vector3<f64>) {
        let [(_, pitch_rate), (_, roll_rate)] = self.pitch_and_roll(banks);
        let (sin, cos) = self.heading.angle.sin_cos();
        let body = Vector3::new(cos, -sin, 0.0) * pitch_rate + truth.attitude.column(1) * roll_rate
            - Vector3::z() * self.heading.rate;
        let rate = earth_rate_n(truth.latitude) + truth.transport_rate() + body;
        // What an unsupported body would do is not sensed.
        let force = self.acceleration() - truth.acceleration(&Vector3::zeros());
        (truth.attitude.tr_mul(&rate), truth.attitude.tr_mul(&force))
    }
}
