//! Definition of a trajectory: a start and segments.

use serde::{Deserialize, Serialize};

/// Start of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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

/// A segment; all its changes start together. The segment ends when the last change ends.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// Minimum duration, s.
    pub duration: f64,
    /// Turn by this angle, rad, clockwise positive.
    pub turn: Change,
    /// Change to this horizontal speed, m/s; `None` keeps the speed.
    pub speed: Option<Change>,
    /// Change to this height above the ellipsoid, m; `None` keeps the height.
    pub height: Option<Change>,
}

/// A change of a quantity, with its limits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// The amount of the change, or the new value.
    pub amount: f64,
    /// Maximum rate of the change, per s.
    pub rate: f64,
    /// Maximum second derivative of the change, per s².
    pub acceleration: f64,
}
