//! Initial attitudes of stretches, smoothed by those after them.

use nalgebra::{DMatrix, DVector, Vector3};

use super::filter::Filter;
use super::mode::Mode;

/// The initial attitude of a stretch as its own data and those before it show it, with what later ones
/// add by way of the states that all share.
#[derive(Debug, Clone)]
pub(super) struct InitialAttitude {
    error: Vector3<f64>,
    /// Mean of the shared states then.
    shared: DVector<f64>,
    /// Covariance with them times the inverse of theirs.
    gain: DMatrix<f64>,
}

impl InitialAttitude {
    pub fn of(filter: &Filter, mode: Mode) -> Self {
        let states: Vec<usize> = match mode {
            // What is fed back is in no mean.
            Mode::Feedback => Vec::new(),
            Mode::Held(_) => filter.layout.shared().collect(),
        };
        let initial = filter.layout.initial_attitude();
        let n = states.len();
        let sigma: Vec<f64> = states
            .iter()
            .map(|&s| filter.covariance(s, s).sqrt())
            .collect();
        let correlation = DMatrix::from_fn(n, n, |i, j| {
            filter.covariance(states[i], states[j]) / (sigma[i] * sigma[j])
        });
        let cross = DMatrix::from_fn(n, 3, |i, axis| {
            filter.covariance(states[i], initial + axis) / sigma[i]
        });
        // Without an inverse later data change nothing that is known of this attitude.
        let solved = correlation.cholesky().map(|factor| factor.solve(&cross));
        let gain = solved.map_or_else(
            || DMatrix::zeros(3, n),
            |gain| DMatrix::from_fn(3, n, |axis, i| gain[(i, axis)] / sigma[i]),
        );
        Self {
            error: filter.initial_attitude(),
            shared: DVector::from_fn(n, |i, _| filter.mean(states[i])),
            gain,
        }
    }

    pub fn smoothed(&self, last: &Filter) -> Vector3<f64> {
        let states = last.layout.shared();
        let change = states
            .zip(&self.shared)
            .map(|(s, then)| last.mean(s) - then);
        let change = DVector::from_iterator(self.shared.len(), change);
        let moved = &self.gain * change;
        self.error + Vector3::from_fn(|axis, _| moved[axis])
    }
}
