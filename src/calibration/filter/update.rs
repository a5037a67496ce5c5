//! Updates with measurements that are linear in the errors.

use nalgebra::{DMatrix, DVector};

use super::Filter;
use super::columns::Linear;
use crate::calibration::POSITION;
use crate::navigation::State;

impl Filter {
    /// This number of quantities, independent of all errors.
    pub fn none(&self, rows: usize) -> Linear {
        Linear {
            states: DMatrix::zeros(rows, self.x.len()),
            columns: DMatrix::zeros(rows, self.layout.constants.len()),
        }
    }

    /// Updates with the site position, `z = δp`, with this variance per axis.
    pub fn update_position(&mut self, computed: &State, variance: f64) {
        let mut h = self.none(3);
        (0..3).for_each(|axis| h.states[(axis, POSITION + axis)] = 1.0);
        let across = &h.states * &self.p;
        let z = DVector::from_column_slice(computed.position.as_slice());
        self.take((&h, across), &z, variance);
    }

    /// Updates with measurements `z = H x + v`, v white of variance R each, given H and H P, in Joseph's form, which
    /// keeps the covariance symmetric and positive despite rounding of the gain (Bar-Shalom, Li,
    /// Kirubarajan, *Estimation with Applications to Tracking and Navigation*, Eq. 5.2.3-18).
    pub fn take(&mut self, (h, across): (&Linear, DMatrix<f64>), z: &DVector<f64>, variance: f64) {
        let mut innovation = &across * h.states.transpose();
        (0..z.len()).for_each(|k| innovation[(k, k)] += variance);
        let Some(root) = innovation.cholesky() else {
            // Nothing is finite any more, and the pass diverges.
            self.x.fill(f64::NAN);
            return;
        };
        // L⁻¹ of the innovations' covariance L Lᵀ, P Hᵀ L⁻ᵀ, and K = P Hᵀ L⁻ᵀ L⁻¹.
        let mut whiten = DMatrix::identity(z.len(), z.len());
        root.l_dirty().solve_lower_triangular_mut(&mut whiten);
        let whitened = &whiten * (z - &h.states * &self.x);
        let by_whitened = across.transpose() * whiten.transpose();
        let gain = &by_whitened * &whiten;
        self.x.gemv(1.0, &by_whitened, &whitened, 1.0);
        // (I − K H) P, then (…) (I − K H)ᵀ + K R Kᵀ.
        self.p
            .gemm(-1.0, &by_whitened, &by_whitened.transpose(), 1.0);
        let rest = (&gain * variance - &self.p * h.states.transpose()) * 0.5;
        self.p.gemm(1.0, &gain, &rest.transpose(), 1.0);
        self.p.gemm(1.0, &rest, &gain.transpose(), 1.0);
        self.p.fill_lower_triangle_with_upper_triangle();
        self.columns.update(h, &gain, (&whiten, &whitened));
    }
}
