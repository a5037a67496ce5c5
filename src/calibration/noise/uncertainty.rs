//! What an estimate owes to the noise that it was made with being an estimate itself.

use nalgebra::DVector;
use rayon::prelude::*;

use super::factors::Factors;
use super::fit::Likelihood;
use crate::calibration::error::CalibrationError;
use crate::calibration::iterations::Iterated;
use crate::calibration::linearisation::AttitudePrior;
use crate::calibration::parameters::{ParameterMatrix, to_vector};
use crate::calibration::pass::{Gate, Mode, pass};
use crate::calibration::problem::Problem;

impl Likelihood<'_> {
    /// Mean square by which the parameters would be others with other noise, as likely as the record leaves it.
    ///
    /// Noise weighs observations against each other, and its σ are known to what [`Likelihood::sigma`] says; the
    /// covariance of a pass takes them for exactly known. Here ln σ of the sources that are not zero vary by 1σ
    /// to either side along each axis of their covariance, and the squares of what that does to the parameters
    /// are added. How much larger or smaller the covariance itself would be is in the degrees of freedom of the
    /// budget's parts.
    ///
    /// Source: Kackar and Harville 1984, "Approximations for standard errors of estimators of fixed and random
    /// effects in mixed linear models", Journal of the American Statistical Association 79(388), §3.
    pub fn moves_parameters_by(
        &self,
        factors: &Factors,
        problem: &Problem,
        priors: &[AttitudePrior],
        iterated: &Iterated,
    ) -> Result<ParameterMatrix, CalibrationError> {
        let mut sources = self.scale.present();
        sources.retain(|&k| factors.0[k] > 0.0);
        let Some(covariance) = self.covariance(factors, &sources)? else {
            return Ok(ParameterMatrix::zeros());
        };
        let axes = covariance.symmetric_eigen();
        let steps = axes.eigenvectors.column_iter().zip(axes.eigenvalues.iter());
        let steps: Vec<DVector<f64>> = steps
            .flat_map(|(axis, variance)| {
                let step = axis * variance.max(0.0).sqrt();
                [-&step, step]
            })
            .collect();
        let held = &iterated.held;
        let here = to_vector(&held.estimate.triads);
        let apart = steps.par_iter().map(|step| {
            let mut there = *factors;
            for (&k, step) in sources.iter().zip(step) {
                there.0[k] *= (2.0 * step).exp();
            }
            let problem = problem.with_model(self.scale.apply(&there, &problem.model));
            let mode = Mode::Held(Gate::As(&held.innovations));
            // Noise that the filter cannot run with is not likely.
            pass(&problem, priors, &held.at, mode).map_or_else(
                |_| ParameterMatrix::zeros(),
                |there| {
                    let change = to_vector(&there.estimate.triads) - here;
                    change * change.transpose() * 0.5
                },
            )
        });
        let apart: Vec<ParameterMatrix> = apart.collect();
        Ok(apart.into_iter().sum())
    }
}
