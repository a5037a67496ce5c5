//! What happened once in a record.

use crate::earth::ROTATION_RATE;
use crate::imu::Sensor;

/// What happened once: with the begin of a dwell, told by its number among all, something is other than before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disturbance {
    /// What.
    pub kind: DisturbanceKind,
    /// Number of the dwell.
    pub dwell: usize,
}

/// What a disturbance is, by its three components.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DisturbanceKind {
    /// The attitude that the table reads in that dwell alone is off, East, North and Up, rad.
    Position,
    /// The body turned in the move before that dwell as the gyros did not sense, East, North and Up, rad.
    Slip,
    /// Earth rate is other than at the stated latitude, throughout: East, North and Up, rad/s.
    EarthRate,
    /// The biases of a triad step, from half a step below their mean to half a step above it, rad/s or m/s².
    BiasStep(Sensor),
}

impl Disturbance {
    /// What it may be before the data, 1σ of each component: anything that is linear still or, of a bias, as `bias` says.
    pub fn sigma(self, bias: impl Fn(Sensor) -> f64) -> f64 {
        match self.kind {
            DisturbanceKind::Position | DisturbanceKind::Slip => LINEAR,
            // The place may be anywhere, also on the other hemisphere.
            DisturbanceKind::EarthRate => ROTATION_RATE,
            DisturbanceKind::BiasStep(sensor) => bias(sensor),
        }
    }
}

/// An attitude error that is linear still, rad.
const LINEAR: f64 = 0.1;
