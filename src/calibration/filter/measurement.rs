//! Measurements: `z = H x + v`, three components at once, `v` white with the same variance R on each.

use nalgebra::Vector3;

use crate::calibration::layout::POSITION;
use crate::navigation::State;

/// A residual with its measurement model.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// z, computed − observed, East-North-Up.
    pub residual: Vector3<f64>,
    /// H, row by row: state and coefficient of what is not zero.
    pub rows: [Vec<(usize, f64)>; 3],
    /// R, per axis.
    pub variance: f64,
}

/// One component of a measurement less what the filter expected of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ScalarInnovation {
    pub innovation: f64,
    /// As the filter expects it.
    pub variance: f64,
}

impl Measurement {
    /// The site's position: `z = δp`.
    pub fn position(computed: &State, variance: f64) -> Self {
        Self {
            residual: computed.position,
            rows: [0, 1, 2].map(|axis| vec![(POSITION + axis, 1.0)]),
            variance,
        }
    }
}
