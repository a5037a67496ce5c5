//! Interface between navigation and a filter: the error model over a range of samples.

use std::sync::Arc;

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::errors::{ErrorMatrix, ErrorVector, STATES};
use super::process_noise::NoiseInputs;
use crate::imu::{PARAMETERS as PER_TRIAD, PerSensor, ThermalState};

/// Sensitivity of navigation errors to the parameters of one triad.
pub type ParameterBlock = SMatrix<f64, STATES, PER_TRIAD>;

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
    /// A state at rest at the site.
    pub fn at_rest(attitude: Matrix3<f64>) -> Self {
        Self {
            attitude,
            velocity: Vector3::zeros(),
            position: Vector3::zeros(),
        }
    }
}

/// The error model over a stretch of samples: the rows of the transition matrix that differ from
/// identity, the inputs of process noise, and the computed state at the end.
///
/// Errors: φ in `C_computed = (I − [φ×]) C_true` (rad), δV and δp computed − true (m/s, m), all East-North-Up;
/// parameter errors δθ true − estimated, in the order of [`crate::imu::TriadVector`]. With these signs, Eq. 13 at a
/// stationary site is
///
/// `φ̇ = −ω_ie × φ − C_b_n B_g δθ_g`, `δV̇ = f_n × φ − 2ω_ie × δV + C_b_n B_a δθ_a`, `δṗ = δV`,
/// `B = (K̂Ĉ)⁻¹ ∂(K C u + D)/∂θ`.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Computed state at the end.
    pub state: State,
    /// Length in s.
    pub duration: f64,
    /// Transition of the navigation errors.
    pub navigation: Arc<ErrorMatrix>,
    /// Transition from the parameter errors of each triad.
    pub parameters: Arc<PerSensor<ParameterBlock>>,
    /// Transition from the error of the magnitude of gravity, true − stated, in m/s².
    pub gravity: ErrorVector,
    /// Transition from the parameter errors of enabled error terms.
    pub terms: Vec<TermColumn>,
    /// Functions of temperature in the block. The transition from the error of a coefficient is the transition from the
    /// error of its parameter, multiplied by the temperature function. `None` if parameters do not depend on
    /// temperature.
    pub thermal: Option<Box<ThermalState>>,
    /// Inputs of process noise, from which its covariance follows for any densities.
    pub noise: NoiseInputs,
}

/// Effect of the error of one term parameter on the navigation errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TermColumn {
    /// Index of the parameter among [`crate::imu::TERM_PARAMETERS`].
    pub parameter: usize,
    /// Navigation errors for a unit error of the parameter, true − estimated.
    pub column: ErrorVector,
}
