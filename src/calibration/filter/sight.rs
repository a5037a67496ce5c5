//! What the filter's observations see of its states.

use nalgebra::{SMatrix, SVector};

use crate::calibration::states::{ATTITUDE, AXES, BASE, POSITION, TABLE, VELOCITY};
use crate::run::{AXIS_TILTS, Tilts};

/// What an observation of three components sees: three states, less others.
#[derive(Debug, Clone, Copy)]
pub(in crate::calibration) struct Sight {
    pub(super) plus: usize,
    pub(super) minus: Option<usize>,
    /// Where the table's own errors are states: how its attitude turns with the tilt of each axis.
    tilts: Option<Tilts>,
}

impl Sight {
    /// δV: computed minus zero velocity.
    pub const VELOCITY: Self = Self {
        plus: VELOCITY,
        minus: None,
        tilts: None,
    };
    /// δp: computed minus the site's position.
    pub const POSITION: Self = Self {
        plus: POSITION,
        minus: None,
        tilts: None,
    };

    /// φ − τ: computed attitude against the table's; less ε and what the axes' tilts make, where they
    /// are states.
    pub fn table(tilts: Option<Tilts>) -> Self {
        Self {
            plus: ATTITUDE,
            minus: Some(TABLE),
            tilts,
        }
    }

    /// Each state that a component sees, and how.
    fn row(&self, component: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let of_base = self.tilts.map(|_| (BASE + component, -1.0));
        let of_axes = self.tilts.iter().flat_map(move |tilts| {
            (0..AXIS_TILTS).map(move |k| (AXES + k, -tilts[(component, k)]))
        });
        std::iter::once((self.plus + component, 1.0))
            .chain(self.minus.map(|minus| (minus + component, -1.0)))
            .chain(of_base)
            .chain(of_axes)
    }

    pub(super) fn along<const N: usize>(&self, component: usize, v: &SVector<f64, N>) -> f64 {
        let row = self.row(component);
        row.map(|(state, weight)| weight * v[state]).sum()
    }

    pub(super) fn across<const N: usize>(
        &self,
        component: usize,
        p: &SMatrix<f64, N, N>,
    ) -> SVector<f64, N> {
        let mut sum = SVector::<f64, N>::zeros();
        for (state, weight) in self.row(component) {
            sum.axpy(weight, &p.column(state), 1.0);
        }
        sum
    }
}
