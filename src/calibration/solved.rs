//! What iterations found, and with what they were made.

use super::error::CalibrationError;
use super::estimate::Estimate;
use super::gauss_newton::{Iterated, Pass, Progress, iterate};
use super::linearisation::{AttitudePrior, Linearisation};
use super::pass::Gate;
use super::problem::Problem;
use crate::calibration::checks::cause::FoundCause;
use crate::calibration::checks::finding::Finding;
use crate::calibration::noise::NoiseReport;
use crate::imu::{PerSensor, ThermalState};

/// What a recording alone says.
#[derive(Debug, Clone)]
pub struct SeparateEstimate {
    /// Its name.
    pub name: String,
    /// Mean temperature of each axis, °C, and its rate, K/s, over its dwells; none where it is not known.
    pub temperature: Option<PerSensor<[f64; 3]>>,
    /// The span of its temperatures, K.
    pub span: f64,
    /// Calibration at that temperature, with the noise that is stated or, where it may be learnt and has to be, with
    /// that of its own; none where it gave none.
    pub estimate: Option<Estimate>,
    /// Where its temperature stands for all of it: the functions of temperature then.
    pub(in crate::calibration) state: Option<ThermalState>,
    /// The estimate with the initial attitudes, or the coarse start.
    pub(in crate::calibration) at: Linearisation,
    pub(in crate::calibration) priors: Vec<AttitudePrior>,
}

impl SeparateEstimate {
    /// Mean temperature of all axes over its dwells, °C.
    pub fn mean_temperature(&self) -> Option<f64> {
        let PerSensor { gyro, accel } = self.temperature?;
        Some(gyro.iter().chain(&accel).sum::<f64>() / 6.0)
    }
}

/// A problem whose iterations have ended.
#[derive(Clone)]
pub struct Solved<'a> {
    /// As it was calibrated: with the noise that was estimated and the orders of temperature that the data call for.
    pub problem: Problem<'a>,
    pub priors: Vec<AttitudePrior>,
    pub passes: Vec<Pass>,
    pub iterated: Iterated,
    pub noise: NoiseReport,
    /// Each recording calibrated alone, where there are several.
    pub alone: Vec<SeparateEstimate>,
    /// Steps of each dwell after a stop that are skipped.
    pub settling: usize,
    /// Causes that were found and taken into the problem.
    pub causes: Vec<FoundCause>,
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
            alone: Vec::new(),
            settling: 0,
            causes: Vec::new(),
            findings: Vec::new(),
        }
    }

    /// By iterations from a point of linearisation.
    pub fn of(
        problem: &Problem<'a>,
        priors: Vec<AttitudePrior>,
        from: Linearisation,
        gate: Gate,
        progress: Progress,
    ) -> Result<Self, CalibrationError> {
        let mut passes = Vec::new();
        let iterated = iterate(problem, &priors, from, gate, &mut passes, progress)?;
        Ok(Self::new(problem, priors, iterated, passes))
    }

    /// Iterates another problem from here.
    pub fn again(
        mut self,
        problem: Problem<'a>,
        progress: Progress,
    ) -> Result<Self, CalibrationError> {
        let (from, gate) = (self.iterated.estimate, Gate::Innovations);
        let passes = &mut self.passes;
        self.iterated = iterate(&problem, &self.priors, from, gate, passes, progress)?;
        self.problem = problem;
        Ok(self)
    }
}
