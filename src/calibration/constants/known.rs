//! Current information on constants: the prior and whitened rows `[G ν]` as one triangle.

use faer::MatRef;
use nalgebra::{Cholesky, DMatrix, DVector};

use crate::calibration::{Constant, ParameterVector, Posterior, Prior};

/// Current information on constants.
#[derive(Debug, Clone)]
pub struct Known {
    prior: Prior,
    /// Indices of free constants, and of constants fixed at their mean by the prior.
    open: Vec<usize>,
    fixed: Vec<usize>,
    /// Rows of the free constants, with their measured values: an upper triangle.
    root: DMatrix<f64>,
}

/// Information on constants: the logarithm of their density is `−½ xᵀ matrix x + xᵀ vector` up to a constant.
#[derive(Debug, Clone, PartialEq)]
pub struct Information {
    pub matrix: DMatrix<f64>,
    pub vector: DVector<f64>,
}

/// Normal priors of the constants that may be absent, and the additional covariance from averaging over several cases.
#[derive(Debug, Clone, PartialEq)]
pub struct Sites {
    pub information: Information,
    /// Covariance between the cases, multiplied from both sides by the inverse of the covariance.
    pub between: DMatrix<f64>,
}

impl Known {
    /// The prior, before any data; constants that may be absent have no prior yet.
    pub fn new(prior: Prior) -> Self {
        let all = 0..prior.sigma.len();
        let (open, fixed): (Vec<usize>, Vec<usize>) = all.partition(|&k| prior.sigma[k] > 0.0);
        let n = open.len();
        let mut root = DMatrix::zeros(n + 1, n + 1);
        for (row, &k) in open.iter().take(n - prior.candidates).enumerate() {
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

    /// Adds rows with coefficients of all constants.
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

    /// Information from the rows on the constants that may be absent, with all other constants marginalised.
    pub fn of_candidates(&self) -> Information {
        let (n, m) = (self.open.len(), self.prior.candidates);
        let root = self.root.view((n - m, n - m), (m, m));
        Information {
            matrix: root.tr_mul(&root),
            vector: root.tr_mul(&self.root.view((n - m, n), (m, 1)).column(0)),
        }
    }

    /// Change of all other free constants per candidate, one column each.
    fn by_candidates(&self) -> Option<DMatrix<f64>> {
        let (n, m) = (self.open.len(), self.prior.candidates);
        let mut by = -self.root.view((0, n - m), (n - m, m)).into_owned();
        let root = self.root.view((0, 0), (n - m, n - m));
        root.solve_upper_triangular_mut(&mut by).then_some(by)
    }

    /// Returns the RMS change of the parameters of both triads due to the candidates at these positions, each with its
    /// usual size; and the largest remaining fraction of this size if all other candidates are absent.
    pub fn effect_of(&self, places: &[usize]) -> Option<(ParameterVector, f64)> {
        let (n, m) = (self.open.len(), self.prior.candidates);
        let all = self.prior.sigma.len();
        let usual = |place: usize| self.prior.sigma[all - m + place];
        let by = self.by_candidates()?;
        let mut squares = ParameterVector::zeros();
        for &place in places {
            for row in 0..n - m {
                if let Constant::Parameter(index) = self.prior.constants[self.open[row]] {
                    squares[index] += (by[(row, place)] * usual(place)).powi(2);
                }
            }
        }
        let information = self.of_candidates().matrix;
        let scaled = DMatrix::from_fn(places.len(), places.len(), |i, j| {
            let own = information[(places[i], places[j])] * usual(places[i]) * usual(places[j]);
            own + f64::from(u8::from(i == j))
        });
        let least = scaled.symmetric_eigenvalues().min().max(1.0);
        Some((squares.map(f64::sqrt), least.sqrt().recip()))
    }

    /// Estimate and covariance with these factors for the constants that may be absent; `None` if a constant is still
    /// undetermined.
    pub fn with(&self, sites: &Sites) -> Option<Posterior> {
        let (n, m) = (self.open.len(), self.prior.candidates);
        let k = n - m;
        let own = self.of_candidates();
        let information = own.matrix + &sites.information.matrix;
        let vector = own.vector + &sites.information.vector;
        let (of_candidates, log_determinant) = inverse(&information)?;
        let candidates = &of_candidates * &vector;
        let between = &of_candidates * &sites.between * &of_candidates;
        let of_candidates = of_candidates + between;
        let root = self.root.view((0, 0), (k, k)).into_owned();
        let mut of_known = DMatrix::identity(k, k);
        let mut by_candidates = -self.root.view((0, k), (k, m)).into_owned();
        let mut known = self.root.view((0, n), (k, 1)).into_owned();
        let solved = root.solve_upper_triangular_mut(&mut of_known)
            && root.solve_upper_triangular_mut(&mut by_candidates)
            && root.solve_upper_triangular_mut(&mut known);
        if !solved {
            return None;
        }
        let mut by = DMatrix::zeros(n, m);
        by.rows_mut(0, k).copy_from(&by_candidates);
        by.rows_mut(k, m).fill_with_identity();
        let mut values = &by * &candidates;
        let mut first = values.rows_mut(0, k);
        first += known.column(0);
        let mut covariance = &by * of_candidates * by.transpose();
        let mut first = covariance.view_mut((0, 0), (k, k));
        first += &of_known * of_known.transpose();
        let all = self.prior.sigma.len();
        let mut mean = self.prior.mean.clone();
        let mut full = DMatrix::zeros(all, all);
        for (row, &i) in self.open.iter().enumerate() {
            mean[i] = values[row];
            for (column, &j) in self.open.iter().enumerate() {
                full[(i, j)] = covariance[(row, column)];
            }
        }
        let squares = self.root.view((k, n), (m + 1, 1)).norm_squared();
        let of_root: f64 = (0..k).map(|row| self.root[(row, row)].abs().ln()).sum();
        let of_prior: f64 = self
            .open
            .iter()
            .take(k)
            .map(|&i| self.prior.sigma[i].ln())
            .sum();
        Some(Posterior::new(
            &self.prior.constants,
            mean,
            full,
            squares - vector.dot(&candidates),
            2.0 * (of_root + of_prior) + log_determinant,
        ))
    }

    /// Mean and square root of the covariance of combinations of the constants. Each combination is a row of weights;
    /// constants that may be absent must have their own rows.
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
}

impl Sites {
    /// Fixes all constants at their prior mean, to a millionth of their usual size.
    pub fn certain(prior: &Prior) -> Self {
        let (n, m) = (prior.sigma.len(), prior.candidates);
        let information = prior
            .sigma
            .rows(n - m, m)
            .map(|sigma| 1e12 * sigma.powi(-2));
        Self::of(Information {
            vector: information.component_mul(&prior.mean.rows(n - m, m)),
            matrix: DMatrix::from_diagonal(&information),
        })
    }

    /// Priors that add no information to the rows.
    pub fn none(prior: &Prior) -> Self {
        let m = prior.candidates;
        Self::of(Information {
            matrix: DMatrix::zeros(m, m),
            vector: DVector::zeros(m),
        })
    }

    fn of(information: Information) -> Self {
        Self {
            between: DMatrix::zeros(information.vector.len(), information.vector.len()),
            information,
        }
    }

    /// A copy without the covariance between the cases.
    pub fn within(self) -> Self {
        Self::of(self.information)
    }
}

/// Inverse of a positive-definite matrix, for any units of its components, and its log-determinant.
pub fn inverse(matrix: &DMatrix<f64>) -> Option<(DMatrix<f64>, f64)> {
    let n = matrix.nrows();
    // Scaled so that the diagonal is one.
    let scale = matrix.diagonal().map(|value| value.sqrt().recip());
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let root = Cholesky::new(scaled)?;
    let logarithms = root.l_dirty().diagonal().map(f64::ln).sum() - scale.map(f64::ln).sum();
    let inverse = root.inverse();
    let inverse = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
    Some((inverse, 2.0 * logarithms))
}

/// The upper-triangular R with `RᵀR = AᵀA`, where A consists of these rows, by Householder reflections.
pub fn triangle(rows: &DMatrix<f64>) -> DMatrix<f64> {
    let rows = MatRef::from_column_major_slice(rows.as_slice(), rows.nrows(), rows.ncols());
    let qr = rows.qr();
    let triangle = qr.thin_R();
    DMatrix::from_fn(triangle.nrows(), triangle.ncols(), |i, j| triangle[(i, j)])
}
