//! Attitudes that a magnetometer lacks: directions of the field along body axes in which hardly any dwell was observed.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::Survey;
use crate::attitude::{exp, level};
use crate::calibration::Bound;
use crate::magnetic::{MAGNETOMETER, MagneticTriad};
use crate::recording::MagneticNoise;
use crate::run::Run;
use crate::turntable::Rotation;

type Matrix12 = SMatrix<f64, MAGNETOMETER, MAGNETOMETER>;

/// A magnetometer in the last dwell.
pub struct FieldDirections {
    triad: MagneticTriad,
    attitude: Matrix3<f64>,
    /// Covariance of matrix and bias.
    covariance: Matrix12,
    information: Matrix12,
    /// Variance of the mean output of a dwell, averaged over the dwells so far.
    variance: f64,
}

/// The magnetometer after a move and a dwell.
#[derive(Debug, Clone, Copy, Default)]
pub struct AfterMove {
    /// Sum of the log σ of matrix and bias.
    pub log_sigma: f64,
    /// Whether the output in this attitude is predicted less accurately than a dwell measures it.
    pub is_lacking: bool,
}

impl FieldDirections {
    /// The magnetometer of a bound; `None` if the rows so far do not determine it.
    pub fn new((run, survey): (&Run, &Survey), bound: &Bound) -> Option<Self> {
        let of = bound.magnetic.as_ref()?;
        let log = run.recording.magnetometer.as_ref()?;
        let means = survey.rests.iter().map(|rest| {
            let [start, end] = rest.dwell.times(run);
            log.mean(&(start..end), &MagneticNoise::default())
        });
        let means: Vec<_> = means.collect();
        let (rest, output) = (survey.rests.last()?, (*means.last()?)?.output);
        let along_body = of.triad.matrix.try_inverse()? * (output - of.triad.bias);
        let attitude = level(&rest.force.normalize());
        let seen = attitude * along_body;
        let turn = seen.x.atan2(seen.y) - of.triad.angles.x;
        let covariance: Matrix12 = of
            .covariance
            .fixed_view::<MAGNETOMETER, MAGNETOMETER>(0, 0)
            .into();
        let information = of.covariance.cholesky()?.inverse();
        let dwells = means.iter().flatten().count() as f64;
        // Each dwell adds 6/variance to the trace: three outputs, each per matrix row and per bias.
        let trace: f64 = information.diagonal().rows(0, MAGNETOMETER).sum();
        Some(Self {
            triad: of.triad,
            attitude: exp(Vector3::z() * turn) * attitude,
            variance: 6.0 * dwells / trace,
            information: covariance.cholesky()?.inverse(),
            covariance,
        })
    }

    /// The magnetometer after this rotation.
    pub fn after(&self, rotation: Rotation) -> AfterMove {
        let attitude = self.attitude * exp(rotation.vector(&self.attitude));
        let by_constants = self.triad.response(&attitude).by_constants;
        let rows = by_constants.fixed_columns::<MAGNETOMETER>(0);
        let gained = rows.transpose() * rows / self.variance;
        let predicted = (rows * self.covariance * rows.transpose()).trace() / self.variance;
        let after = (self.information + gained)
            .cholesky()
            .map(|of| of.inverse());
        let log_sigma = after.map_or(0.0, |of| of.diagonal().map(|v| 0.5 * v.ln()).sum());
        AfterMove {
            log_sigma,
            is_lacking: predicted > 3.0,
        }
    }
}
