//! Consistency of an error with its covariance, including correlations.

use faer::{Mat, Side};
use nalgebra::{DMatrix, DMatrixView, DVector, DVectorView};
use serde::{Deserialize, Serialize};

use crate::calibration::mean_square_interval;

/// Eigenvalue of a correlation matrix below which a direction is zero except for rounding, for example if three
/// angles represent six.
const NO_DIRECTION: f64 = 1e-11;

/// Normalised estimation error squared, computed as a mean of squares of independent numbers with σ = 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Nees {
    /// NEES/n.
    pub mean: f64,
    /// n: number of independent directions in which the covariance is not zero.
    pub count: usize,
    /// 95 % interval of NEES/n if the σ are correct (χ²).
    pub interval: (f64, f64),
}

/// NEES of a difference over the parameters with a σ among those given; `None` if there are none.
pub fn nees<'a>(
    difference: impl Into<DVectorView<'a, f64>>,
    covariance: impl Into<DMatrixView<'a, f64>>,
    parameters: &[usize],
) -> Option<Nees> {
    let (difference, covariance) = (difference.into(), covariance.into());
    let with_sigma = parameters.iter().copied();
    let with_sigma: Vec<usize> = with_sigma.filter(|&i| covariance[(i, i)] > 0.0).collect();
    let squares = Directions::new(covariance, &with_sigma)?.squares(difference);
    let count = squares.len();
    (count > 0).then(|| Nees {
        mean: squares.iter().sum::<f64>() / count as f64,
        count,
        interval: mean_square_interval(count, 0.05),
    })
}

/// The independent directions of a covariance, found from its correlation matrix so that units do not matter.
pub struct Directions {
    indices: Vec<usize>,
    sigma: DVector<f64>,
    eigenvalues: DVector<f64>,
    /// Column by column.
    eigenvectors: DMatrix<f64>,
}

impl Directions {
    /// Directions of the covariance of some parameters, each with a σ; `None` if there are none, or if the
    /// matrix is not a covariance.
    pub fn new<'a>(covariance: impl Into<DMatrixView<'a, f64>>, indices: &[usize]) -> Option<Self> {
        let covariance = covariance.into();
        let n = indices.len();
        let sigma = DVector::from_fn(n, |i, _| covariance[(indices[i], indices[i])].sqrt());
        let correlation = Mat::from_fn(n, n, |i, j| {
            let (a, b) = (indices[i], indices[j]);
            0.5 * (covariance[(a, b)] + covariance[(b, a)]) / (sigma[i] * sigma[j])
        });
        let finite = |j: usize| (0..n).all(|i| correlation[(i, j)].is_finite());
        if n == 0 || !(0..n).all(finite) {
            return None;
        }
        let eigen = correlation.self_adjoint_eigen(Side::Lower).ok()?;
        let eigenvalues = DVector::from_fn(n, |k, _| eigen.S().column_vector()[k]);
        (eigenvalues.min() > -NO_DIRECTION).then(|| Self {
            indices: indices.to_vec(),
            sigma,
            eigenvalues,
            eigenvectors: DMatrix::from_fn(n, n, |i, k| eigen.U()[(i, k)]),
        })
    }

    /// Squares of the components of a vector along the directions, each in units of its σ.
    pub fn squares(&self, v: DVectorView<f64>) -> Vec<f64> {
        let z = DVector::from_fn(self.sigma.len(), |i, _| v[self.indices[i]] / self.sigma[i]);
        let along = self.eigenvectors.tr_mul(&z);
        let squares = along.iter().zip(&self.eigenvalues);
        squares
            .filter(|(_, variance)| **variance > NO_DIRECTION)
            .map(|(x, variance)| x * x / variance)
            .collect()
    }

    /// The inverse of the covariance in its own directions, and zero perpendicular to them.
    pub fn inverse(&self) -> DMatrix<f64> {
        let inverse = self.eigenvalues.map(|variance| {
            let is_direction = variance > NO_DIRECTION;
            if is_direction { variance.recip() } else { 0.0 }
        });
        let scale = DMatrix::from_diagonal(&self.sigma.map(f64::recip));
        let whitened = &scale * &self.eigenvectors;
        &whitened * DMatrix::from_diagonal(&inverse) * whitened.transpose()
    }
}
