//! States of a stretch or a recording that has ended, smoothed by those after it.

use nalgebra::{DMatrix, DVector};

use super::mode::Mode;
use crate::calibration::filter::Filter;

/// States as data up to then show them, with what later data add by way of the constants that all share.
///
/// Source: Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*,
/// §1.4.14: what is learnt of the constants goes to the states by their regression.
#[derive(Debug, Clone)]
pub struct Earlier {
    pub mean: DVector<f64>,
    pub covariance: DMatrix<f64>,
    /// Mean and covariance of the constants then.
    shared: (DVector<f64>, DMatrix<f64>),
    /// Covariance with them times the inverse of theirs.
    gain: DMatrix<f64>,
}

impl Earlier {
    pub fn of(filter: &Filter, mode: Mode, states: &[usize]) -> Self {
        let constants: Vec<usize> = match mode {
            // What is fed back is in no mean.
            Mode::Feedback => Vec::new(),
            Mode::Held(_) => filter.layout.constants().collect(),
        };
        let (n, m) = (constants.len(), states.len());
        let sigma = |k: usize| filter.covariance(constants[k], constants[k]).sqrt();
        let correlation = DMatrix::from_fn(n, n, |i, j| {
            filter.covariance(constants[i], constants[j]) / (sigma(i) * sigma(j))
        });
        let cross = DMatrix::from_fn(n, m, |i, k| {
            filter.covariance(constants[i], states[k]) / sigma(i)
        });
        // Without an inverse later data change nothing that is known of these states.
        let solved = correlation.cholesky().map(|factor| factor.solve(&cross));
        let gain = solved.map_or_else(
            || DMatrix::zeros(m, n),
            |gain| DMatrix::from_fn(m, n, |k, i| gain[(i, k)] / sigma(i)),
        );
        Self {
            mean: DVector::from_fn(m, |k, _| filter.mean(states[k])),
            covariance: DMatrix::from_fn(m, m, |i, j| filter.covariance(states[i], states[j])),
            shared: known(filter, &constants),
            gain,
        }
    }

    /// Mean and covariance by what a filter knows of the constants at the end.
    pub fn smoothed(&self, last: &Filter) -> (DVector<f64>, DMatrix<f64>) {
        let constants: Vec<usize> = last.layout.constants().take(self.gain.ncols()).collect();
        let (mean, covariance) = known(last, &constants);
        let more = &self.gain * (covariance - &self.shared.1) * self.gain.transpose();
        (
            &self.mean + &self.gain * (mean - &self.shared.0),
            &self.covariance + more,
        )
    }
}

fn known(filter: &Filter, states: &[usize]) -> (DVector<f64>, DMatrix<f64>) {
    let n = states.len();
    (
        DVector::from_fn(n, |i, _| filter.mean(states[i])),
        DMatrix::from_fn(n, n, |i, j| filter.covariance(states[i], states[j])),
    )
}
