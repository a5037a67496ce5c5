//! Estimate of a magnetometer and of the field at its site.

use nalgebra::{DMatrix, Matrix3, SMatrix};

use crate::calibration::constants::parameters;
use crate::calibration::{Constant, Linearisation, Model, PARAMETERS, Posterior};
use crate::magnetic::{MAGNETIC, MagneticTriad, MagneticVector};
use crate::statistics::{FALSE_ALARM, chi_square_limit};

/// Covariance of the constants of a magnetometer.
pub type MagneticMatrix = SMatrix<f64, MAGNETIC, MAGNETIC>;

/// A magnetometer in the body frame of the triads, with its covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct MagneticEstimate {
    /// The estimate.
    pub triad: MagneticTriad,
    /// Magnitude of the field and its 1σ, T; zero for a magnitude by convention.
    pub magnitude: [f64; 2],
    /// Covariance of its constants, in the order of [`MagneticVector`].
    pub covariance: MagneticMatrix,
    /// Covariance of the parameters of both triads (rows) with these constants.
    pub cross: SMatrix<f64, PARAMETERS, MAGNETIC>,
}

impl MagneticEstimate {
    /// The estimate of a posterior, linearised `at` a point; `None` if the magnetometer is not calibrated.
    pub(in crate::calibration) fn new(
        posterior: &Posterior,
        at: &Linearisation,
        model: &Model,
    ) -> Option<Self> {
        let mut values = at.magnetic?;
        let constants = posterior.constants.iter().enumerate();
        let own = constants.filter_map(|(place, constant)| match constant {
            Constant::Magnetic(k) => Some((place, *k)),
            _ => None,
        });
        let own: Vec<(usize, usize)> = own.collect();
        let (mut covariance, mut cross) = (MagneticMatrix::zeros(), SMatrix::zeros());
        let of_all: &DMatrix<f64> = &posterior.covariance;
        for &(place, k) in &own {
            values[k] += posterior.mean[place];
            for &(other, j) in &own {
                covariance[(k, j)] = of_all[(place, other)];
            }
            for (row, index) in parameters(&posterior.constants) {
                cross[(index, k)] = of_all[(row, place)];
            }
        }
        Some(Self {
            triad: MagneticTriad::from_vector(&values),
            magnitude: model.magnetic.magnitude,
            covariance,
            cross,
        })
    }

    /// The estimate along other axes, to which this matrix turns the field.
    pub fn along(&self, axes: &Matrix3<f64>) -> Self {
        let by_matrix: MagneticMatrix = MagneticTriad::to_axes(axes);
        let mut turned = self.clone();
        turned.triad.matrix *= axes.transpose();
        turned.covariance = by_matrix * self.covariance * by_matrix.transpose();
        turned.cross = self.cross * by_matrix.transpose();
        turned
    }

    /// Whether the output of each axis depends on the field.
    pub fn is_shown(&self) -> bool {
        let limit = chi_square_limit(3.0, FALSE_ALARM);
        (0..3).all(|axis| {
            let row = self.triad.matrix.row(axis).transpose();
            let own = self.covariance.fixed_view::<3, 3>(3 * axis, 3 * axis);
            let solved = own.into_owned().cholesky().map(|of| of.solve(&row));
            solved.is_some_and(|solved| row.dot(&solved) > limit)
        })
    }

    /// 1σ of each constant; zero if it was not estimated.
    pub fn sigma(&self) -> MagneticVector {
        self.covariance.diagonal().map(|v| v.max(0.0).sqrt())
    }
}
