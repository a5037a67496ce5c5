//! Current information on constants: the prior and whitened rows `[G ν]` as one triangle.

use faer::MatRef;
use nalgebra::{DMatrix, DVector};

use crate::calibration::{Posterior, Prior};

/// Current information on constants.
#[derive(Debug, Clone)]
pub struct Known {
    prior: Prior,
    /// Free constants, and constants fixed at their mean by the prior.
    open: Vec<usize>,
    fixed: Vec<usize>,
    /// Rows of the free constants, with their measured values: an upper triangle.
    root: DMatrix<f64>,
}

impl Known {
    /// The prior, before any data.
    pub fn new(prior: Prior) -> Self {
        let all = 0..prior.sigma.len();
        let (open, fixed): (Vec<usize>, Vec<usize>) = all.partition(|&k| prior.sigma[k] > 0.0);
        let n = open.len();
        let mut root = DMatrix::zeros(n + 1, n + 1);
        for (row, &k) in open.iter().enumerate() {
            root[(row, row)] = prior.sigma[k].recip();
            root[(row, n)] = prior.mean[k] / prior.sigma[k];
        }
        Self {
            prior,
            open,
            fixed,
            root,
        }
    }

    /// Adds rows of all constants.
    pub fn learn(&mut self, rows: &DMatrix<f64>) {
        let (n, all) = (self.open.len(), self.prior.sigma.len());
        let mut with = DMatrix::zeros(n + 1 + rows.nrows(), n + 1);
        with.rows_mut(0, n + 1).copy_from(&self.root);
        let mut below = with.rows_mut(n + 1, rows.nrows());
        for (column, &k) in self.open.iter().enumerate() {
            below.set_column(column, &rows.column(k));
        }
        let mut observed = rows.column(all).into_owned();
        for &k in self.fixed.iter().filter(|&&k| self.prior.mean[k] != 0.0) {
            observed.axpy(-self.prior.mean[k], &rows.column(k), 1.0);
        }
        below.set_column(n, &observed);
        self.root = triangle(&with);
    }

    /// Mean and root of the covariance of combinations of the constants, each given by a row of weights.
    pub fn through(&self, weights: &DMatrix<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let n = self.open.len();
        let mut across = weights.select_columns(&self.open).transpose();
        let root = self.root.view((0, 0), (n, n));
        if !root.tr_solve_upper_triangular_mut(&mut across) {
            across.fill(f64::NAN);
        }
        let root = across.transpose();
        let fixed = weights.select_columns(&self.fixed) * self.prior.mean.select_rows(&self.fixed);
        (
            fixed + &root * self.root.view((0, n), (n, 1)).column(0),
            root,
        )
    }

    /// Estimate and covariance; NaN if a constant is still undetermined.
    pub fn posterior(&self) -> Posterior {
        let (n, all) = (self.open.len(), self.prior.sigma.len());
        let (mean, root) = self.through(&DMatrix::identity(all, all));
        let last = self.root[(n, n)];
        let logarithms: f64 = (0..n).map(|k| self.root[(k, k)].abs().ln()).sum();
        let of_prior: f64 = self.open.iter().map(|&k| self.prior.sigma[k].ln()).sum();
        Posterior::new(
            &self.prior.constants,
            mean,
            &root * root.transpose(),
            last.powi(2),
            2.0 * (logarithms + of_prior),
        )
    }
}

/// The upper-triangular R with `RᵀR = AᵀA`, A consisting of these rows, by Householder reflections.
pub fn triangle(rows: &DMatrix<f64>) -> DMatrix<f64> {
    let rows = MatRef::from_column_major_slice(rows.as_slice(), rows.nrows(), rows.ncols());
    let qr = rows.qr();
    let triangle = qr.thin_R();
    DMatrix::from_fn(triangle.nrows(), triangle.ncols(), |i, j| triangle[(i, j)])
}
