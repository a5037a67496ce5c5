//! The heading of a stretch without a table.

use nalgebra::{Matrix3, SMatrix, SVector};

use super::equations::Common;

/// The heading common to all attitudes of a stretch.
#[derive(Debug, Clone, Copy)]
pub struct Heading {
    /// Number of the stretch.
    pub stretch: usize,
    /// Turn about Up that brings the attitudes to East-North-Up, rad.
    pub turn: Matrix3<f64>,
    /// 1σ of its angle, rad; above one nothing is known of it.
    pub sigma: f64,
}

impl Heading {
    /// Its σ as it is used, rad.
    pub fn known(&self) -> f64 {
        self.sigma.clamp(1e-3, 1.0)
    }

    /// How some rows follow its error, by their change with an angle of one.
    pub fn error<const N: usize>(
        &self,
        by_angle: &SVector<f64, N>,
    ) -> (Common, SMatrix<f64, N, 3>) {
        let mut error = SMatrix::<f64, N, 3>::zeros();
        error.set_column(2, &(by_angle * self.known()));
        (Common::Unit(self.stretch), error)
    }
}
