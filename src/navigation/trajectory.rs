//! Where a body that moves truly is, and what an ideal instrument on it senses.
//!
//! Speed, heading and height follow raised-cosine profiles in closed form, and with them velocity,
//! attitude and their derivatives. Latitude and longitude, which have no closed form, are integrals of
//! the velocity.

use nalgebra::Vector3;
use thiserror::Error;

use super::increments::Increments;
use super::strapdown::Solution;
use crate::attitude::from_pitch_roll_heading;
use crate::earth::{Curvature, earth_rate_n};
use crate::turntable::{Profile, Turned};
use crate::units::STANDARD_GRAVITY;

/// Nodes in parts of a step's half and weights, Gauss–Legendre of sixth order.
const NODES: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 9.0),
    (0.0, 8.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 9.0),
];
/// The least horizontal speed over the climb rate: beyond, pitch would be steeper than a body flies.
const LEAST_GLIDE: f64 = 2.0;
/// The least time in s that all segments together take.
const LEAST_ROUND: f64 = 1.0;

/// A start and segments, gone through again and again.
///
/// The body points where it goes: heading is that of the velocity, pitch its angle above the horizon.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    start: Start,
    banks: bool,
    segments: Vec<Segment>,
}

/// Where a trajectory starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Geodetic latitude in radians, north positive.
    pub latitude: f64,
    /// Longitude in radians, east positive.
    pub longitude: f64,
    /// Height above the ellipsoid in m.
    pub height: f64,
    /// Heading in radians, clockwise from North.
    pub heading: f64,
    /// Horizontal speed in m/s.
    pub speed: f64,
}

/// Moves that begin together. The segment ends with the last of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// The least time that it takes, s.
    pub duration: f64,
    /// Turn by this angle, rad, clockwise positive.
    pub turn: Change,
    /// Change to this horizontal speed, m/s; none keeps it.
    pub speed: Option<Change>,
    /// Change to this height above the ellipsoid, m; none keeps it.
    pub height: Option<Change>,
}

/// A change of a quantity, and how fast it may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// By or to what.
    pub amount: f64,
    /// Rate that the change reaches, per s.
    pub rate: f64,
    /// Peak of the rate's own rate, per s².
    pub acceleration: f64,
}

/// Why a body cannot follow segments.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TrajectoryError {
    /// Nothing happens, and that for no time.
    #[error("the segments together take {found} s; give one of them a duration_s or a move")]
    Short {
        /// How long they take, s.
        found: f64,
    },
    /// A climb or descent that is too steep.
    #[error(
        "segment {segment} climbs or descends at {climb:.2} m/s with {speed:.2} m/s of horizontal speed at \
         its start or end; at least {:.0} times the climb rate is needed: change speed in a segment of its \
         own, or climb more slowly",
        LEAST_GLIDE
    )]
    Steep {
        /// Segment, counted from one.
        segment: usize,
        /// Climb rate, m/s.
        climb: f64,
        /// Horizontal speed, m/s.
        speed: f64,
    },
}

impl Trajectory {
    /// A trajectory whose segments fit each other.
    ///
    /// # Errors
    /// If the segments take no time or a climb is too steep.
    pub fn new(start: Start, banks: bool, segments: Vec<Segment>) -> Result<Self, TrajectoryError> {
        let trajectory = Self {
            start,
            banks,
            segments,
        };
        // The second round may start at another speed than the first.
        let count = trajectory.segments.len();
        let mut leg = Leg::before(&start);
        let mut round = 0.0;
        for k in 0..2 * count {
            leg = leg.followed_by(&trajectory.segments[k % count]);
            if k >= count {
                round += leg.duration;
            }
            let climb = leg.height.peak_rate();
            let end = leg.at(leg.end()).speed.angle;
            let speed = leg.from[SPEED].min(end);
            if climb > 0.0 && speed < LEAST_GLIDE * climb {
                return Err(TrajectoryError::Steep {
                    segment: k % count + 1,
                    climb,
                    speed,
                });
            }
        }
        if round < LEAST_ROUND {
            return Err(TrajectoryError::Short { found: round });
        }
        Ok(trajectory)
    }

    /// Where it starts.
    pub fn start(&self) -> &Start {
        &self.start
    }

    /// The same from another latitude in radians.
    pub fn at_latitude(mut self, latitude: f64) -> Self {
        self.start.latitude = latitude;
        self
    }

    /// The same from another height in m, all other heights moved with it.
    pub fn at_height(mut self, height: f64) -> Self {
        let raised = height - self.start.height;
        self.start.height = height;
        for target in self.segments.iter_mut().filter_map(|s| s.height.as_mut()) {
            target.amount += raised;
        }
        self
    }

    /// Goes through it in steps of `period` seconds.
    pub fn travel(&self, period: f64) -> Travel<'_> {
        let leg = Leg::before(&self.start);
        let mut travel = Travel {
            trajectory: self,
            period,
            steps: 0,
            leg,
            next: 0,
            truth: Solution {
                attitude: nalgebra::Matrix3::identity(),
                velocity: Vector3::zeros(),
                latitude: self.start.latitude,
                longitude: self.start.longitude,
                height: self.start.height,
            },
        };
        travel.enter(0.0);
        travel.arrive(0.0);
        travel
    }
}

const SPEED: usize = 0;
const HEADING: usize = 1;
const HEIGHT: usize = 2;

/// A segment that has its place in time.
#[derive(Debug, Clone, Copy)]
struct Leg {
    start: f64,
    duration: f64,
    /// Speed, heading and height at its start.
    from: [f64; 3],
    speed: Profile,
    heading: Profile,
    height: Profile,
}

/// Speed, heading and height with their first and second derivatives.
#[derive(Debug, Clone, Copy)]
struct Kinematics {
    speed: Turned,
    heading: Turned,
    height: Turned,
}

impl Leg {
    /// A leg of no length that ends at a start.
    fn before(start: &Start) -> Self {
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

    fn followed_by(&self, segment: &Segment) -> Self {
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

    fn end(&self) -> f64 {
        self.start + self.duration
    }

    fn at(&self, time: f64) -> Kinematics {
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

    /// The next time after this one where a third derivative jumps, the end at the latest.
    fn next_break(&self, after: f64) -> f64 {
        self.profiles()
            .iter()
            .flat_map(Profile::breaks)
            .map(|time| self.start + time)
            .filter(|&time| time > after)
            .fold(self.end(), f64::min)
    }
}

impl Kinematics {
    fn velocity(&self) -> Vector3<f64> {
        let (sin, cos) = self.heading.angle.sin_cos();
        let speed = self.speed.angle;
        Vector3::new(speed * sin, speed * cos, self.height.rate)
    }

    /// Derivative of the velocity's components.
    fn acceleration(&self) -> Vector3<f64> {
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
    fn is_steady(&self) -> bool {
        self.speed.rate == 0.0
            && self.speed.acceleration == 0.0
            && self.heading.rate == 0.0
            && self.heading.acceleration == 0.0
            && self.height.acceleration == 0.0
    }

    /// The true state at this place, of which velocity and attitude are set.
    fn placed(&self, place: &Solution, banks: bool) -> Solution {
        let [(pitch, _), (roll, _)] = self.pitch_and_roll(banks);
        Solution {
            attitude: from_pitch_roll_heading(pitch, roll, self.heading.angle),
            velocity: self.velocity(),
            height: self.height.angle,
            ..*place
        }
    }

    /// Angular rate (rad/s) and specific force (m/s²) along body axes.
    fn sensed(&self, truth: &Solution, banks: bool) -> (Vector3<f64>, Vector3<f64>) {
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

/// A journey along a trajectory.
#[derive(Debug, Clone)]
pub struct Travel<'a> {
    trajectory: &'a Trajectory,
    period: f64,
    steps: u64,
    leg: Leg,
    next: usize,
    truth: Solution,
}

impl Travel<'_> {
    /// The true state now.
    pub fn truth(&self) -> &Solution {
        &self.truth
    }

    /// Angular rate (rad/s) and specific force (m/s²) along body axes now.
    pub fn sensed(&self) -> (Vector3<f64>, Vector3<f64>) {
        let kinematics = self.leg.at(self.time());
        kinematics.sensed(&self.truth, self.trajectory.banks)
    }

    /// Whether velocity and attitude in East-North-Up stay as they are till a time after now, in s.
    pub fn is_steady_for(&self, duration: f64) -> bool {
        let (now, end) = (self.time(), self.time() + duration);
        self.leg.next_break(now) >= end
            && self.leg.at(now).is_steady()
            && self.leg.at(end).is_steady()
    }

    /// Goes on by a step and gives the integrals over it of what an ideal instrument senses.
    pub fn advance(&mut self) -> Increments {
        let mut now = self.time();
        self.steps += 1;
        let end = self.time();
        let mut increments = Increments::default();
        // No part reaches across a break, so quadrature keeps its order.
        while now < end {
            self.enter(now);
            let to = self.leg.next_break(now).min(end);
            self.integrate(now, to, &mut increments);
            now = to;
        }
        self.enter(end);
        self.arrive(end);
        increments
    }

    fn time(&self) -> f64 {
        self.steps as f64 * self.period
    }

    /// Goes to the leg of a time.
    fn enter(&mut self, time: f64) {
        let segments = &self.trajectory.segments;
        while self.leg.end() <= time {
            self.leg = self.leg.followed_by(&segments[self.next]);
            self.next = (self.next + 1) % segments.len();
        }
    }

    /// Sets velocity, attitude and height to those of a time.
    fn arrive(&mut self, time: f64) {
        self.truth = self.leg.at(time).placed(&self.truth, self.trajectory.banks);
    }

    fn integrate(&mut self, from: f64, to: f64, increments: &mut Increments) {
        let half = 0.5 * (to - from);
        let start = self.leg.at(from);
        let (velocity, acceleration) = (start.velocity(), start.acceleration());
        let radius = Curvature::at(self.truth.latitude).meridian + start.height.angle;
        let mut moved = Vector3::zeros();
        for (node, weight) in NODES {
            let after = half * (1.0 + node);
            let kinematics = self.leg.at(from + after);
            // Millimetres are enough here: they change Earth rate and gravity by 1e-9 of themselves.
            let north = (velocity.y + 0.5 * acceleration.y * after) * after;
            let place = Solution {
                latitude: self.truth.latitude + north / radius,
                ..self.truth
            };
            let truth = kinematics.placed(&place, self.trajectory.banks);
            let (rate, force) = kinematics.sensed(&truth, self.trajectory.banks);
            let transport = truth.transport_rate();
            let weight = weight * half;
            increments.angle += rate * weight;
            increments.velocity += force * weight;
            moved += Vector3::new(transport.y / truth.latitude.cos(), -transport.x, 0.0) * weight;
        }
        self.truth.longitude += moved.x;
        self.truth.latitude += moved.y;
    }
}
