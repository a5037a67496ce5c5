//! Dwells of the instrument, with the axis that points up.

use nalgebra::Vector3;

use crate::run::{Dwell, Run};
use crate::units::DEGREE;

/// An axis within this angle of the vertical is up or down, rad.
const UPRIGHT: f64 = 10.0 * DEGREE;

/// A dwell, evaluated with nominal scales and prior biases.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    /// The samples and the table position of the dwell.
    pub dwell: Dwell,
    /// Mean specific force along body axes, m/s².
    pub force: Vector3<f64>,
    /// The axis that points up.
    pub up: Up,
}

/// The axis closest to the vertical.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Up {
    /// Index of the body axis: right, front or up.
    pub axis: usize,
    /// Whether the axis points down.
    pub down: bool,
    /// Angle from the vertical, rad.
    pub tilt: f64,
}

impl Up {
    fn of(force: &Vector3<f64>) -> Self {
        let axis = force.iamax();
        let cosine = (force[axis].abs() / force.norm()).clamp(0.0, 1.0);
        Self {
            axis,
            down: force[axis] < 0.0,
            tilt: cosine.acos(),
        }
    }

    /// Whether the axis is nearly vertical.
    pub fn is_upright(&self) -> bool {
        self.tilt < UPRIGHT
    }
}

impl Rest {
    /// Angle between the directions of gravity according to the accelerometers and to the table, rad.
    pub fn off_table(&self) -> Option<f64> {
        let attitude = self.dwell.position.as_ref()?.attitude;
        Some(self.force.angle(&attitude.tr_mul(&Vector3::z())))
    }
}

/// The dwells, in order of time.
pub fn rests(run: &Run) -> Vec<Rest> {
    let rest = |dwell: Dwell| {
        let force = dwell.force(run);
        let up = Up::of(&force);
        Rest { dwell, force, up }
    };
    run.dwells(run.aiding()).into_iter().map(rest).collect()
}
