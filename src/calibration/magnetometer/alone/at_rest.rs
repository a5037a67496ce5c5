//! Output of a magnetometer and direction of gravity at rest.

use nalgebra::{DMatrix, Vector3};

use crate::recording::MagneticMean;

/// Mean output at rest, and Up along body axes if accelerometers show it.
#[derive(Debug, Clone)]
pub struct AtRest {
    /// Output of the magnetometer.
    pub mean: MagneticMean,
    /// Direction of gravity.
    pub up: Option<Up>,
}

/// Up along body axes.
#[derive(Debug, Clone)]
pub struct Up {
    /// Unit vector.
    pub direction: Vector3<f64>,
    /// 1σ of its own tilt about each axis, rad.
    pub tilt: f64,
    /// Change per error that all dwells have in common, each with σ = 1, one column each.
    pub by_common: DMatrix<f64>,
}
