//! What iterations found, and with what they were made.

use super::gauss_newton::Iterated;
use super::linearisation::AttitudePrior;
use super::outcome::Pass;
use super::parameters::ParameterMatrix;
use super::problem::Problem;
use crate::calibration::checks::finding::Finding;
use crate::calibration::noise::NoiseReport;
use crate::calibration::several::separate_estimate::SeparateEstimate;

/// A problem whose iterations have ended.
#[derive(Clone)]
pub struct Solved<'a> {
    /// As it was calibrated: with the noise that was estimated and the orders of temperature that the data call for.
    pub problem: Problem<'a>,
    pub priors: Vec<AttitudePrior>,
    pub passes: Vec<Pass>,
    pub iterated: Iterated,
    /// Mean square by which the parameters differ from those of other headings, where Earth rate does not tell them.
    pub by_headings: ParameterMatrix,
    pub noise: NoiseReport,
    /// Each recording calibrated alone, where there are several.
    pub alone: Vec<SeparateEstimate>,
    pub findings: Vec<Finding>,
}

impl<'a> Solved<'a> {
    /// With noise of which nothing is said yet.
    pub fn new(
        problem: &Problem<'a>,
        priors: Vec<AttitudePrior>,
        iterated: Iterated,
        passes: Vec<Pass>,
    ) -> Self {
        Self {
            noise: NoiseReport::stated(problem.options.noise, None),
            problem: problem.clone(),
            priors,
            passes,
            iterated,
            by_headings: ParameterMatrix::zeros(),
            alone: Vec::new(),
            findings: Vec::new(),
        }
    }
}
