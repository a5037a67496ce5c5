//! Prior of a few constants, in square-root form.

use nalgebra::{Matrix3, Vector3};

use super::rows::{add, dot, factor, whiten};

/// Mean of constants `g` and a root S of their covariance, `S Sᵀ`: the covariance may shrink by twelve
/// orders of magnitude from one observation to the next, and a root keeps twice the digits (Bierman 1977,
/// *Factorization Methods for Discrete Sequential Estimation*, §II).
pub struct InputPrior<const G: usize> {
    mean: [f64; G],
    /// S, row by row.
    root: [[f64; G]; G],
}

/// Three scalars minus their expectation.
pub struct Unexpected<const G: usize> {
    /// In units of their σ, independent of one another.
    pub whitened: Vector3<f64>,
    /// L, lower triangular root of their covariance.
    pub root: Matrix3<f64>,
    /// `B = H S`.
    by_root: [[f64; G]; 3],
}

impl<const G: usize> InputPrior<G> {
    pub fn new(mean: [f64; G], covariance: [[f64; G]; G]) -> Self {
        let mut root = [[0.0; G]; G];
        for (k, (_, column, _)) in factor(covariance, [0.0; G]).enumerate() {
            for (row, value) in root.iter_mut().zip(column) {
                row[k] = value;
            }
        }
        Self { mean, root }
    }

    /// The innovations of three independent scalars of σ 1, rows H of `g`; `None` if they are not finite.
    #[inline]
    pub fn predict(&self, rows: &[[f64; G]; 3], scalars: &Vector3<f64>) -> Option<Unexpected<G>> {
        let mut by_root = [[0.0; G]; 3];
        for (by_root, row) in by_root.iter_mut().zip(rows) {
            for (weight, of_component) in row.iter().zip(&self.root) {
                add(by_root, *weight, of_component);
            }
        }
        let covariance = Matrix3::from_fn(|row, column| dot(&by_root[row], &by_root[column]))
            + Matrix3::identity();
        let root = covariance.cholesky()?.l();
        let expected = Vector3::from_fn(|row, _| dot(&rows[row], &self.mean));
        let whitened = root.solve_lower_triangular(&(scalars - expected))?;
        whitened.norm_squared().is_finite().then_some(Unexpected {
            whitened,
            root,
            by_root,
        })
    }

    /// Updates with them, in Potter's form for three scalars at once: `S − S Bᵀ L⁻ᵀ (L + 1)⁻¹ B` (Andrews 1968, "A
    /// square root formulation of the Kalman covariance equations", AIAA Journal 6(6)).
    #[inline]
    pub fn update(&mut self, unexpected: &Unexpected<G>) {
        let Unexpected {
            whitened,
            root,
            by_root,
        } = unexpected;
        let (mut gaining, mut shrinking) = (*by_root, *by_root);
        whiten(root, &mut gaining);
        whiten(&(root + Matrix3::identity()), &mut shrinking);
        let mut gain = [0.0; 3];
        for (mean, of_component) in self.mean.iter_mut().zip(&mut self.root) {
            for (row, gaining) in gaining.iter().enumerate() {
                gain[row] = dot(gaining, of_component);
                *mean += gain[row] * whitened[row];
            }
            for (gain, shrinking) in gain.iter().zip(&shrinking) {
                add(of_component, -gain, shrinking);
            }
        }
    }
}
