//! Commanded positions and moves of a table.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// A sequence of positions with its initial attitude.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Path {
    /// Dwell before the first step, s.
    pub first_dwell: f64,
    /// The moves, all in table axes or all in body axes.
    pub moves: Moves,
}

/// Moves in table axes or in body axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Moves {
    /// Turns of the table's axes.
    Axes {
        /// Angle of each axis at the start, outermost first, rad.
        start: Vec<f64>,
        /// The moves in order.
        steps: Vec<AxesStep>,
    },
    /// Rotations about body axes, as in published multi-position sequences.
    Body {
        /// `C_b_n` at the start.
        start: Matrix3<f64>,
        /// The rotations in order.
        steps: Vec<BodyStep>,
    },
}

/// All named axes turn simultaneously, then the table is at rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AxesStep {
    /// Turn of each axis, outermost first, rad.
    pub angles: Vec<f64>,
    /// Maximum rate of the turns, rad/s.
    pub rate: f64,
    /// Peak acceleration, rad/s².
    pub acceleration: f64,
    /// Dwell afterwards, s.
    pub dwell: f64,
}

/// One rotation about a body axis, then the table is at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BodyStep {
    /// The rotation.
    pub rotation: Rotation,
    /// Duration of the rotation, s.
    pub duration: f64,
    /// Peak acceleration, rad/s².
    pub acceleration: f64,
    /// Dwell afterwards, s.
    pub dwell: f64,
}

/// A rotation in body axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Rotation {
    /// A rotation by this rotation vector along body axes, rad.
    By(Vector3<f64>),
    /// The shortest rotation that makes a body axis point in a direction.
    Point {
        /// Unit vector along body axes.
        axis: Vector3<f64>,
        /// Unit vector in East-North-Up.
        along: Vector3<f64>,
    },
}

impl Moves {
    /// Number of steps.
    pub fn len(&self) -> usize {
        match self {
            Self::Axes { steps, .. } => steps.len(),
            Self::Body { steps, .. } => steps.len(),
        }
    }

    /// Whether there are no steps.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl BodyStep {
    /// The shortest duration of a rotation by this angle with this acceleration, s, apart from rounding.
    pub fn shortest(&self, angle: f64) -> f64 {
        (2.0 * PI * angle / self.acceleration).sqrt() * (1.0 + 1e-12)
    }
}

impl Rotation {
    /// The rotation vector in body axes, rad, given the attitude `C_b_n` at the beginning of the rotation.
    pub fn vector(&self, attitude: &Matrix3<f64>) -> Vector3<f64> {
        match *self {
            Self::By(vector) => vector,
            Self::Point { axis, along } => {
                let target = attitude.tr_mul(&along);
                let normal = axis.cross(&target);
                let angle = normal.norm().atan2(axis.dot(&target));
                // Half a turn can be about any perpendicular axis; the one towards the next body axis will do.
                let across = Vector3::new(axis.z, axis.x, axis.y);
                let direction = normal
                    .try_normalize(1e-9)
                    .or_else(|| (across - axis * axis.dot(&across)).try_normalize(1e-9))
                    .unwrap_or_else(Vector3::zeros);
                direction * angle
            }
        }
    }
}
