//! Motion profile of an axis from one angle to another.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Angle, rate and acceleration at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Turned {
    /// Angle since the start of the move, rad.
    pub angle: f64,
    /// Rate, rad/s.
    pub rate: f64,
    /// Acceleration, rad/s².
    pub acceleration: f64,
}

/// A turn whose rate rises and falls along raised cosines, with a constant stretch between them, so that the
/// acceleration is continuous and all quantities have a closed form.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    rate: f64,
    ramp: f64,
    plateau: f64,
}

impl Profile {
    /// The turn by `angle` (rad, signed) that reaches `rate` (rad/s) and has `acceleration` (rad/s²) as its peak. A
    /// turn that is too short to reach this rate keeps the acceleration and stays below the rate.
    pub fn limited(angle: f64, rate: f64, acceleration: f64) -> Self {
        // Both ramps together turn by rate · ramp = π rate² / (2 acceleration).
        let rate = rate.min((2.0 * acceleration * angle.abs() / PI).sqrt());
        let ramp = PI * rate / (2.0 * acceleration);
        Self {
            rate: rate.copysign(angle),
            ramp,
            plateau: if rate > 0.0 {
                (angle.abs() / rate - ramp).max(0.0)
            } else {
                0.0
            },
        }
    }

    /// The turn by `angle` (rad, signed) that takes `duration` (s) and has `acceleration` (rad/s²)
    /// as its peak; `None` if that acceleration is too small.
    pub fn timed(angle: f64, duration: f64, acceleration: f64) -> Option<Self> {
        // |angle| = rate (duration − π rate / (2 acceleration)), solved for its smaller root.
        let root = duration * duration - 2.0 * PI * angle.abs() / acceleration;
        (root >= 0.0).then(|| {
            // This form of the root has no cancellation.
            let rate = 2.0 * angle.abs() / (duration + root.sqrt());
            let ramp = PI * rate / (2.0 * acceleration);
            Self {
                rate: rate.copysign(angle),
                ramp,
                plateau: (duration - 2.0 * ramp).max(0.0),
            }
        })
    }

    /// Duration of the turn, s.
    pub fn duration(&self) -> f64 {
        2.0 * self.ramp + self.plateau
    }

    /// The maximum rate magnitude, rad/s.
    pub fn peak_rate(&self) -> f64 {
        self.rate.abs()
    }

    /// The times in s since the start at which the third derivative of the angle jumps.
    pub fn breaks(&self) -> [f64; 3] {
        [self.ramp, self.ramp + self.plateau, self.duration()]
    }

    /// The state `time` seconds after the start; the axis is at rest before the start and after the end.
    pub fn at(&self, time: f64) -> Turned {
        let Self {
            rate,
            ramp,
            plateau,
        } = *self;
        if time <= 0.0 {
            Turned::default()
        } else if time < ramp {
            Self::ramped(rate, ramp, time)
        } else if time <= ramp + plateau {
            Turned {
                angle: rate * (time - 0.5 * ramp),
                rate,
                acceleration: 0.0,
            }
        } else {
            let left = (self.duration() - time).max(0.0);
            let mirrored = Self::ramped(rate, ramp, left);
            Turned {
                angle: rate * (ramp + plateau) - mirrored.angle,
                rate: mirrored.rate,
                acceleration: -mirrored.acceleration,
            }
        }
    }

    fn ramped(rate: f64, ramp: f64, time: f64) -> Turned {
        if time <= 0.0 {
            return Turned::default();
        }
        let frequency = PI / ramp;
        let (s, c) = (frequency * time).sin_cos();
        Turned {
            angle: 0.5 * rate * (time - s / frequency),
            rate: 0.5 * rate * (1.0 - c),
            acceleration: 0.5 * rate * frequency * s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn profiles() -> [Profile; 4] {
        [
            Profile::limited(2.0 * PI, 0.3, 0.2),
            Profile::limited(-0.01, 0.3, 0.2),
            Profile::timed(-PI / 2.0, 9.0, 0.2).unwrap(),
            Profile::timed(0.0, 1.0, 0.2).unwrap(),
        ]
    }

    #[test]
    fn a_turn_ends_at_its_angle_and_stands_before_and_after() {
        for (profile, angle) in profiles().iter().zip([2.0 * PI, -0.01, -PI / 2.0, 0.0]) {
            let end = profile.at(profile.duration());
            assert_relative_eq!(end.angle, angle, epsilon = 1e-15, max_relative = 1e-14);
            assert_relative_eq!(end.rate, 0.0, epsilon = 1e-15);
            assert_eq!(profile.at(profile.duration() + 5.0).rate, 0.0);
            assert_eq!(profile.at(-1.0), Turned::default());
        }
        assert_relative_eq!(profiles()[2].duration(), 9.0);
    }

    #[test]
    fn rate_and_acceleration_are_the_derivatives_of_the_angle_and_keep_the_limits() {
        let step = 1e-5;
        for profile in profiles() {
            for k in 0..200 {
                let time = profile.duration() * (f64::from(k) + 0.37) / 200.0;
                let (before, at, after) = (
                    profile.at(time - step),
                    profile.at(time),
                    profile.at(time + step),
                );
                let rate = (after.angle - before.angle) / (2.0 * step);
                let acceleration = (after.rate - before.rate) / (2.0 * step);
                assert!((rate - at.rate).abs() < 1e-9);
                assert!((acceleration - at.acceleration).abs() < 1e-5);
                assert!(at.rate.abs() <= 0.3 + 1e-12);
                assert!(at.acceleration.abs() <= 0.2 + 1e-12);
            }
        }
    }

    #[test]
    fn a_short_turn_stays_below_the_rate_and_a_hurried_one_does_not_exist() {
        assert!(profiles()[1].peak_rate() < 0.3);
        assert_eq!(Profile::timed(PI, 1.0, 0.2), None);
    }
}
