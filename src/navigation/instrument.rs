//! A triad, prepared for sample-by-sample use.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::imu::{PARAMETERS as PER_TRIAD, Triad};

/// Entries of `C_b_n b_k`, with `b = [u; 1]` of a triad's input u: for each column of `C_b_n`, the four `b_k` in order.
pub const INPUTS: usize = 12;

/// `(K̂Ĉ)⁻¹ ∂(K C u + D)/∂θ`, errors of the corrected input of a triad with respect to its parameter errors δθ = true −
/// estimated: one column per parameter, with the weights of `b = [u; 1]` axis by axis.
pub type Response = SMatrix<f64, INPUTS, PER_TRIAD>;

/// The response of a triad with this correction `(K̂Ĉ)⁻¹`.
pub fn response(triad: &Triad, correction: &Matrix3<f64>) -> Response {
    let columns = triad.response().map(|by_input| {
        let weights = (correction * by_input).transpose();
        SVector::<f64, INPUTS>::from_column_slice(weights.as_slice())
    });
    Response::from_columns(&columns)
}

/// Correction of increments, and the effect of its errors.
#[derive(Debug, Clone)]
pub struct Instrument {
    pub correction: Matrix3<f64>,
    /// Corrected bias over one sample.
    pub bias: Vector3<f64>,
    pub response: Response,
}

impl Instrument {
    /// The instrument of a triad with this correction, for samples of a period in s.
    pub fn new(triad: &Triad, correction: Matrix3<f64>, period: f64) -> Self {
        Self {
            correction,
            bias: correction * triad.bias * period,
            response: response(triad, &correction),
        }
    }
}
