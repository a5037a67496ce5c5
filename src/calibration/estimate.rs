//! Both triads with the covariance of their parameters.

use crate::calibration::budget::curvature::curvature;
use crate::calibration::parameters::Before;
use crate::calibration::{
    OBSERVED_BELOW, PARAMETERS, ParameterMatrix, ParameterVector, from_vector, parameter, to_vector,
};
use crate::imu::{InstallationForm, PerSensor, Sensor, Triad};
use crate::magnetic::MagneticVector;
use crate::run::Run;
use nalgebra::{DMatrix, DMatrixView};

/// Estimate of the parameters of both triads at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Epoch {
    /// Time, s.
    pub time: f64,
    /// Parameters of both triads.
    pub estimate: ParameterVector,
    /// 1σ of each.
    pub sigma: ParameterVector,
    /// 1σ of the constants of the magnetometer, if there is one.
    pub magnetic: Option<MagneticVector>,
}

/// Both triads with the covariance of their parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// The estimated triads, normalised (see [`crate::imu::Nominal`]).
    pub triads: PerSensor<Triad>,
    /// Covariance of the parameters of both triads; rows and columns of parameters that were not
    /// estimated are zero.
    pub covariance: ParameterMatrix,
}

impl Estimate {
    /// An estimate with the covariance of a linear filter plus second-order terms.
    pub(in crate::calibration) fn with_curvature(
        triads: PerSensor<Triad>,
        linear: &ParameterMatrix,
    ) -> Self {
        Self {
            covariance: linear + curvature(&triads, linear),
            triads,
        }
    }

    /// Indices of the parameters whose σ is still more than half of these prior σ.
    pub fn unobserved(&self, prior_sigma: &ParameterVector) -> Vec<usize> {
        let sigma = self.sigma();
        let hidden = |&index: &usize| {
            let prior = prior_sigma[index];
            prior > 0.0 && sigma[index] > OBSERVED_BELOW * prior
        };
        self.estimated().filter(hidden).collect()
    }

    /// The estimate as it may be used: unobserved parameters keep these prior values, as if they had not been estimated.
    pub(in crate::calibration) fn usable(&self, prior: Before<'_>) -> Self {
        let (mut values, mut covariance) = (self.vector(), self.covariance);
        for index in self.unobserved(prior.sigma) {
            values[index] = prior.mean[index];
            covariance.row_mut(index).fill(0.0);
            covariance.column_mut(index).fill(0.0);
        }
        Self {
            triads: from_vector(self.form(), &values),
            covariance,
        }
    }

    /// The parameters of both triads.
    pub fn vector(&self) -> ParameterVector {
        to_vector(&self.triads)
    }

    /// 1σ of each parameter; zero for parameters that were not estimated.
    pub fn sigma(&self) -> ParameterVector {
        self.covariance.diagonal().map(|v| v.max(0.0).sqrt())
    }

    /// Joint covariance of the parameters and of further constants, from the covariance of the constants and the
    /// cross-covariance.
    pub fn covariance_with<'a>(
        &self,
        cross: impl Into<DMatrixView<'a, f64>>,
        own: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let (cross, n) = (cross.into(), own.nrows());
        let mut all = DMatrix::zeros(PARAMETERS + n, PARAMETERS + n);
        let corner = (PARAMETERS, PARAMETERS);
        all.view_mut((0, 0), corner).copy_from(&self.covariance);
        all.view_mut(corner, (n, n)).copy_from(own);
        all.view_mut((0, PARAMETERS), (PARAMETERS, n))
            .copy_from(&cross);
        let mut below = all.view_mut((PARAMETERS, 0), (n, PARAMETERS));
        below.copy_from(&cross.transpose());
        all
    }

    /// The misalignment form, one for both triads.
    pub fn form(&self) -> InstallationForm {
        self.triads.gyro.form
    }

    /// Addition to the covariance for an uncertain sample period: the same relative error of all gyro scale factors.
    pub(in crate::calibration) fn by_period(&self, run: &Run) -> ParameterMatrix {
        let scale = self.triads.gyro.scale * run.recording.imu.period_sigma;
        let mut gained = ParameterMatrix::zeros();
        let first = parameter(Sensor::Gyro, 0);
        let mut of_scale = gained.fixed_view_mut::<3, 3>(first, first);
        of_scale.copy_from(&(scale * scale.transpose()));
        gained
    }

    /// Indices of the estimated parameters.
    pub fn estimated(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.covariance.nrows()).filter(|&i| self.covariance[(i, i)] > 0.0)
    }
}

/// Largest factor by which a σ grew, from the variances before and after.
pub fn largest_growth(before: &[f64], after: &[f64]) -> f64 {
    let known = before
        .iter()
        .zip(after)
        .filter(|(before, _)| **before > 0.0);
    let ratios = known.map(|(before, after)| after / before);
    ratios.fold(1.0, f64::max).sqrt()
}
