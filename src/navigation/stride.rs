//! A step along a true motion, as long as it may be for an integration of fourth order.

use nalgebra::Vector3;

use super::error_model::ErrorModel;
use super::strapdown::{Height, Solution};

/// The longest step, s: an eightieth of a radian of the Schuler oscillation, of which Runge and Kutta then keep
/// the phase over 40 h to 1e-7 rad.
const LONGEST: f64 = 10.0;
/// The largest turn in a step, rad: Simpson's rule then integrates along a turn to 4e-8.
const LARGEST_TURN: f64 = 0.1;

/// A true state and what an ideal instrument senses in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instant {
    /// The true state.
    pub truth: Solution,
    /// Angular rate `ω_ib` along body axes, rad/s.
    pub rate: Vector3<f64>,
    /// Specific force along body axes, m/s².
    pub force: Vector3<f64>,
}

impl Instant {
    /// Of a body that keeps its attitude and its velocity in East-North-Up.
    pub fn steady(truth: &Solution) -> Self {
        let (rate, force) = truth.steady();
        let truth = *truth;
        Self { truth, rate, force }
    }

    /// The linear error model here, height held.
    pub fn linear_model(&self) -> ErrorModel {
        let held = Height::Held {
            height: self.truth.height,
            velocity: self.truth.velocity.z,
        };
        ErrorModel::about(&self.truth, &self.force, held)
    }
}

/// A step in which everything is smooth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stride {
    /// Its length, s.
    pub duration: f64,
    /// In its middle.
    pub middle: Instant,
    /// At its end.
    pub end: Instant,
}

impl Stride {
    /// How many steps a time in s takes in which something turns at a rate in rad/s.
    pub(crate) fn count(duration: f64, rate: f64) -> u32 {
        (duration * (rate / LARGEST_TURN).max(1.0 / LONGEST))
            .ceil()
            .max(1.0) as u32
    }
}
