//! Result of the iterations, with the problem that was solved.

use crate::calibration::{
    AttitudePrior, CalibrationError, Estimate, Finding, FoundCause, Gate, Iterated, Linearisation,
    NoiseReport, Pass, Problem, Progress, iterate,
};
use crate::imu::{PerSensor, ThermalState};

/// A recording calibrated alone.
#[derive(Debug, Clone)]
pub struct SeparateEstimate {
    /// Its name.
    pub name: String,
    /// Mean temperature of each axis, °C, and its rate, K/s, over its dwells; `None` if unknown.
    pub temperature: Option<PerSensor<[f64; 3]>>,
    /// The span of its temperatures, K.
    pub span: f64,
    /// Calibration at that temperature, with the stated noise or, if the policy allows and the data demand it, with the
    /// noise estimated from this recording; `None` if the calibration failed.
    pub estimate: Option<Estimate>,
    /// Functions of temperature, if its temperature is constant.
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
    /// The problem as calibrated: with the estimated noise and the selected temperature orders.
    pub problem: Problem<'a>,
    pub priors: Vec<AttitudePrior>,
    pub passes: Vec<Pass>,
    pub iterated: Iterated,
    pub noise: NoiseReport,
    /// Each recording calibrated alone, if there are several.
    pub alone: Vec<SeparateEstimate>,
    /// Steps of each dwell after a stop that are skipped.
    pub settling: usize,
    /// Causes that were found and included in the problem.
    pub causes: Vec<FoundCause>,
    pub findings: Vec<Finding>,
}

impl<'a> Solved<'a> {
    /// A solution with noise that is not yet tested.
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

    /// The solved problem with stated noise and prior, but with the estimated differences between recordings.
    pub fn as_stated(&self, stated: &Problem<'a>) -> Problem<'a> {
        self.problem.with(|model| {
            *model = model.with_noise_of(&stated.model);
            model.prior_sigma = stated.model.prior_sigma;
        })
    }

    /// The result of iterating again, unless it failed or converged worse.
    pub fn better(
        &self,
        again: Result<Self, CalibrationError>,
    ) -> Result<Option<Self>, CalibrationError> {
        match again {
            Err(CalibrationError::Stopped) => Err(CalibrationError::Stopped),
            again => Ok(again
                .ok()
                .filter(|again| again.iterated.converged || !self.iterated.converged)),
        }
    }

    /// Iterates from a linearisation point.
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
