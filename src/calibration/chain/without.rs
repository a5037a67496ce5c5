//! The information on the constants that each move contributes.

use nalgebra::DMatrix;

use super::Filtered;
use super::states::NAVIGATION;
use crate::calibration::{ParameterVector, Posterior, of_parameters};

/// 1σ of a disturbance that makes attitude (rad), velocity (m/s) and position (m) unknown.
const WIDE: f64 = 100.0;

impl Filtered<'_> {
    /// 1σ of the parameters without each move in turn: before the next dwell, attitude, velocity and position become
    /// unknown.
    ///
    /// With such a disturbance δ, the information on the constants is `Λ − Eᵀ (N + W⁻²)⁻¹ E`, where N is the
    /// information on δ from all later rows, and E the joint information on δ and the constants (de Jong 1991, "The
    /// diffuse Kalman filter", Annals of Statistics 19(2)).
    pub fn without_moves(&self, posterior: &Posterior) -> Vec<ParameterVector> {
        let mut sigma = Vec::new();
        self.backward(|number, cumulants| {
            let link = &self.chain.links[number];
            if link.begins || link.attitude.is_none() {
                return;
            }
            let mut own = cumulants
                .precision
                .view((0, 0), (NAVIGATION, NAVIGATION))
                .into_owned();
            (0..NAVIGATION).for_each(|k| own[(k, k)] += WIDE.powi(-2));
            let both = cumulants.by_constants.rows(0, NAVIGATION).into_owned();
            // The covariance grows by C Eᵀ (N + W⁻² − E C Eᵀ)⁻¹ E C.
            let across = &both * &posterior.covariance;
            let left = own - &across * both.transpose();
            let scale = left.diagonal().map(|value| value.abs().sqrt().recip());
            let scaled = DMatrix::from_fn(NAVIGATION, NAVIGATION, |i, j| {
                left[(i, j)] * scale[i] * scale[j]
            });
            let across = DMatrix::from_diagonal(&scale) * across;
            let grown = scaled.cholesky().map(|factor| {
                let covariance = &posterior.covariance + across.tr_mul(&factor.solve(&across));
                of_parameters(&posterior.constants, &covariance)
            });
            let grown = grown.unwrap_or(posterior.parameter_covariance);
            sigma.push(grown.diagonal().map(|variance| variance.max(0.0).sqrt()));
        });
        sigma.reverse();
        sigma
    }
}
