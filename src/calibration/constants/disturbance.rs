//! Single events in a recording.

use crate::earth::ROTATION_RATE;
use crate::imu::Sensor;

/// A single event: a change that starts with a dwell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disturbance {
    /// Its kind.
    pub kind: DisturbanceKind,
    /// Number of the dwell.
    pub dwell: usize,
}

/// Kind of a disturbance; each has three components.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DisturbanceKind {
    /// Error of the table's attitude reading in this dwell only, East, North and Up, rad.
    Position,
    /// Rotation in the move before this dwell that the gyros did not sense, East, North and Up, rad.
    Slip,
    /// Deviation of Earth rate from that at the stated latitude, throughout: East, North and Up, rad/s.
    EarthRate,
    /// Step of the biases of a triad, from half a step below their mean to half a step above it, rad/s or m/s².
    BiasStep(Sensor),
}

impl Disturbance {
    /// Prior 1σ of each component: the linear range or, for a bias, the value of `bias`.
    pub fn sigma(self, bias: impl Fn(Sensor) -> f64) -> f64 {
        match self.kind {
            DisturbanceKind::Position | DisturbanceKind::Slip => LINEAR,
            // The place may be anywhere, also on the other hemisphere.
            DisturbanceKind::EarthRate => ROTATION_RATE,
            DisturbanceKind::BiasStep(sensor) => bias(sensor),
        }
    }
}

/// Largest attitude error in the linear range, rad.
const LINEAR: f64 = 0.1;
