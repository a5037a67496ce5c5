//! What navigation hands to a filter: the error model over a range of samples.

use std::sync::Arc;

use nalgebra::{Matrix3, SMatrix, SVector};

use super::process_noise::NoiseInputs;
use super::state::State;
use crate::imu::{PARAMETERS as PER_TRIAD, PerSensor, ThermalState, Triad};

/// Attitude, velocity and position error.
pub const NAVIGATION: usize = 9;
/// Navigation errors against navigation errors.
pub type BlockMatrix = SMatrix<f64, NAVIGATION, NAVIGATION>;
/// Navigation errors against the parameters of one triad.
pub type ParameterBlock = SMatrix<f64, NAVIGATION, PER_TRIAD>;

/// The error model over a stretch of samples: the rows of the transition matrix that differ from
/// identity, what process noise acts on, and the computed state at the end.
///
/// Errors: φ in `C_computed = (I − [φ×]) C_true` (rad), δV and δp computed − true (m/s, m), all
/// East-North-Up; parameter errors δθ true − estimated, in the order of [`crate::imu::TriadVector`].
/// With these signs (Eq. 13 at a standing site)
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
    pub navigation: Arc<BlockMatrix>,
    /// Transition from the parameter errors of each triad.
    pub parameters: Arc<PerSensor<ParameterBlock>>,
    /// Transition from the error of gravity's magnitude, true − stated, in m/s².
    pub gravity: SVector<f64, NAVIGATION>,
    /// Transition from the parameter errors of error terms that are on.
    pub terms: Vec<TermColumn>,
    /// Functions of temperature meanwhile: the transition from a coefficient's error is that from its
    /// parameter's error times its function. None where parameters do not change with temperature.
    pub thermal: Option<Box<ThermalState>>,
    /// What noise acts on: its covariance follows for any densities.
    pub noise: NoiseInputs,
}

impl Block {
    /// The same of as many samples at rest in the same attitude, of which interpolated ones add this covariance
    /// to the integral of each triad's input, rad² and (m/s)² in `n`.
    pub(super) fn bridging(&self, bridged: PerSensor<Matrix3<f64>>) -> Self {
        Self {
            noise: self.noise.bridging(bridged),
            ..self.clone()
        }
    }
}

/// What the error of one term parameter makes of the navigation errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TermColumn {
    /// The parameter's index among [`crate::imu::TERM_PARAMETERS`].
    pub parameter: usize,
    /// Navigation errors by the parameter's error, true − estimated.
    pub column: SVector<f64, NAVIGATION>,
}

/// `(K̂Ĉ)⁻¹ W_p` for every parameter: the error of the computed input is this times `[u; 1]`.
#[derive(Debug, Clone)]
pub(super) struct CorrectedResponse(pub [SMatrix<f64, 3, 4>; PER_TRIAD]);

impl CorrectedResponse {
    pub(super) fn new(triad: &Triad, correction: &Matrix3<f64>) -> Self {
        Self(triad.response().map(|w| correction * w))
    }

    /// Of each parameter the weights of `C_b_n b_k`, for each column of `C_b_n` one `b_k` after the other.
    pub(super) fn columns(&self) -> [SVector<f64, 12>; PER_TRIAD] {
        self.0
            .map(|w| SVector::from_column_slice(w.transpose().as_slice()))
    }
}
