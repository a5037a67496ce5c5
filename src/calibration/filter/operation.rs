//! What is done to a filter's errors, and what noise drives them.

use nalgebra::{DMatrix, Matrix3};

use crate::imu::Sensor;

/// What is done to errors, true − estimated.
#[derive(Debug, Clone)]
pub enum Operation {
    /// One error with this 1σ is drawn anew, the same in all of these states.
    Drawn { states: Vec<usize>, sigma: f64 },
    /// Three errors from a first on become more by the attitude error times a matrix.
    Turned { first: usize, by: Matrix3<f64> },
    /// An error is forgotten but for a part, and driven by noise of this variance.
    Varied {
        state: usize,
        keep: f64,
        variance: f64,
    },
    /// Scalars of these rows, each with this variance of noise, are taken in by a gain, a column each.
    Taken {
        rows: DMatrix<f64>,
        gain: DMatrix<f64>,
        variance: f64,
    },
    /// The states that move (rows, in order) become these combinations of the first states (columns).
    Carried {
        moving: Vec<usize>,
        transition: DMatrix<f64>,
    },
}

/// Noise that drives errors, by what makes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Driver {
    /// Random walk of a triad.
    White(Sensor),
    /// What moves add to it.
    Moves(Sensor),
    /// A bias that varies.
    Wander(Sensor),
    /// The turn at rest.
    Turning,
    /// Samples that were interpolated.
    Interpolated,
}

impl Driver {
    pub const ALL: [Self; 8] = [
        Self::White(Sensor::Gyro),
        Self::White(Sensor::Accel),
        Self::Moves(Sensor::Gyro),
        Self::Moves(Sensor::Accel),
        Self::Wander(Sensor::Gyro),
        Self::Wander(Sensor::Accel),
        Self::Turning,
        Self::Interpolated,
    ];
}
