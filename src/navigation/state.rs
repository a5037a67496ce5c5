//! Where navigation stands.

use nalgebra::{Matrix3, Vector3};

/// Computed attitude, velocity and position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// `C_b_n`, body to East-North-Up.
    pub attitude: Matrix3<f64>,
    /// Velocity relative to the Earth, East-North-Up, m/s.
    pub velocity: Vector3<f64>,
    /// Position relative to the site, East-North-Up, m.
    pub position: Vector3<f64>,
}

impl State {
    /// At rest at the site.
    pub fn at_rest(attitude: Matrix3<f64>) -> Self {
        Self {
            attitude,
            velocity: Vector3::zeros(),
            position: Vector3::zeros(),
        }
    }
}
