//! True motion of a moving body, and the input sensed by an ideal instrument on it.
//!
//! Speed, heading and height follow raised-cosine profiles, so these quantities, velocity, attitude and their
//! derivatives have a closed form. Latitude and longitude have no closed form and are integrals of the velocity.

mod leg;
mod segment;
mod strides;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use leg::Leg;
pub use segment::{Change, Segment, Start};
pub use strides::{Stride, Strides};

/// Minimum ratio of horizontal speed to climb rate, to limit the pitch angle.
const LEAST_GLIDE: f64 = 2.0;
/// Minimum total duration of all segments, s.
const LEAST_ROUND: f64 = 1.0;

/// A start and segments that are repeated.
///
/// The body points along its velocity: heading is the direction of the velocity, and pitch is its angle above the
/// horizon.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trajectory {
    start: Start,
    banks: bool,
    segments: Vec<Segment>,
}

/// Errors for segments that a body cannot follow.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TrajectoryError {
    /// The segments take no time.
    #[error("the segments together take {found} s; give one of them a duration_s or a move")]
    Short {
        /// Duration of all segments, s.
        found: f64,
    },
    /// A climb or descent is too steep.
    #[error(
        "segment {segment} climbs or descends at {climb:.2} m/s with {speed:.2} m/s of horizontal speed at \
         its start or end; horizontal speed must be at least {:.0} times the climb rate: change speed in a separate \
         segment, or climb more slowly",
        LEAST_GLIDE
    )]
    Steep {
        /// Number of the segment, counted from one.
        segment: usize,
        /// Climb rate, m/s.
        climb: f64,
        /// Horizontal speed, m/s.
        speed: f64,
    },
}

impl Trajectory {
    /// A trajectory of these segments.
    ///
    /// # Errors
    /// Returns an error if the segments take no time or a climb is too steep.
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
            let (climb, speed) = (leg.climb_rate(), leg.lower_speed());
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

    /// The start.
    pub fn start(&self) -> &Start {
        &self.start
    }

    /// A copy that starts at another latitude in radians.
    pub fn at_latitude(mut self, latitude: f64) -> Self {
        self.start.latitude = latitude;
        self
    }

    /// A copy that starts at another height in m; all other heights move with it.
    pub fn at_height(mut self, height: f64) -> Self {
        let raised = height - self.start.height;
        self.start.height = height;
        for target in self.segments.iter_mut().filter_map(|s| s.height.as_mut()) {
            target.amount += raised;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::to_pitch_roll_heading;
    use crate::models::{self, Place};
    use crate::navigation::Instant;
    use crate::units::{DEGREE, STANDARD_GRAVITY};

    fn embedded(name: &str) -> Trajectory {
        models::trajectory(name, &Place::Embedded).unwrap().0
    }

    #[test]
    fn a_round_leads_back_near_the_start() {
        for (name, round, metres) in [("flight", 5142.0, 2000.0), ("vehicle", 775.0, 200.0)] {
            let trajectory = embedded(name);
            let start = trajectory.start;
            let mut strides = trajectory.strides();
            strides.pass(round);
            let end = strides.here().truth;
            let apart = 6.4e6 * (end.latitude - start.latitude).hypot(end.longitude * 0.7);
            assert!(apart < metres, "{name}: {apart}");
            assert!((end.height - start.height).abs() < 1.0, "{name}");
            let [.., heading] = to_pitch_roll_heading(&end.attitude);
            assert!((heading - start.heading).abs() < 1e-9, "{name}: {heading}");
        }
    }

    #[test]
    fn a_body_that_banks_feels_no_force_to_its_side_in_a_level_turn() {
        let trajectory = embedded("flight");
        let mut strides = trajectory.strides();
        // In the middle of the first full circle.
        strides.pass(2080.0);
        let Instant { truth, rate, force } = strides.here();
        let [pitch, roll, _] = to_pitch_roll_heading(&truth.attitude);
        let expected = (230.0 * 1.0 * DEGREE / STANDARD_GRAVITY).atan();
        assert!(pitch == 0.0 && (roll - expected).abs() < 1e-9, "{roll}");
        // Except for Coriolis and the Earth's roundness.
        assert!(force.x.abs() < 0.1 && force.z > 10.0, "{force}");
        assert!((rate.norm() - 1.0 * DEGREE).abs() < 2e-4, "{rate}");
    }

    #[test]
    fn climbing_without_speed_and_segments_without_time_are_refused() {
        let start = Start {
            latitude: 0.5,
            longitude: 0.0,
            height: 0.0,
            heading: 0.0,
            speed: 10.0,
        };
        let change = |amount| Change {
            amount,
            rate: 4.0,
            acceleration: 1.0,
        };
        let still = Segment {
            duration: 0.0,
            turn: change(0.0),
            speed: None,
            height: None,
        };
        let of = |segment| Trajectory::new(start, false, vec![segment]);
        assert!(matches!(of(still), Err(TrajectoryError::Short { .. })));
        let climb = Segment {
            height: Some(change(100.0)),
            ..still
        };
        assert!(of(climb).is_err(), "the second round takes no time");
        let halting = Segment {
            speed: Some(change(7.0)),
            duration: 10.0,
            ..climb
        };
        let steep = of(halting).unwrap_err();
        assert!(matches!(steep, TrajectoryError::Steep { segment: 1, .. }));
    }
}
