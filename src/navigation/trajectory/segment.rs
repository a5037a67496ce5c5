//! What a trajectory is stated by: a start and segments.

use serde::{Deserialize, Serialize};

/// Where a trajectory starts.
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

/// Moves that begin together. The segment ends with the last of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// The least time that it takes, s.
    pub duration: f64,
    /// Turn by this angle, rad, clockwise positive.
    pub turn: Change,
    /// Change to this horizontal speed, m/s; `None` keeps it.
    pub speed: Option<Change>,
    /// Change to this height above the ellipsoid, m; `None` keeps it.
    pub height: Option<Change>,
}

/// A change of a quantity, and how fast it may be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// By or to what.
    pub amount: f64,
    /// Rate that the change reaches, per s.
    pub rate: f64,
    /// Peak of the rate's own rate, per s².
    pub acceleration: f64,
}
