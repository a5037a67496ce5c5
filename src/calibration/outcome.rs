//! Outcome of the filter for a run: an estimate with its covariance, and the diagnostics of the filter.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::calibration::checks::dwell_scatter::DwellScores;
use crate::calibration::checks::innovation::consistency;
use crate::calibration::estimate::largest_growth;
use crate::calibration::linearisation::{UNKNOWN_HEADING, not_invertible};
use crate::calibration::{
    AttitudePrior, Auxiliary, BudgetSource, CalibrationError, Consistency, DwellScatter, Epoch,
    Estimate, Finding, FormTest, FoundCause, Innovation, Linearisation, Model, NoiseReport,
    OBSERVED_BELOW, Observability, Own, ParameterMatrix, ParameterVector, Pass, Posterior, Prior,
    Problem, Reduction, Script, SeparateEstimate, Solved, Thermal, Verdict, Word,
};
use crate::imu::Sensor;

/// Minimum χ² difference between opposite headings for an observed heading.
const HEADING_SEEN: f64 = 6.0;

/// The result of the filter on one run.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The estimate after the last pass.
    pub estimate: Estimate,
    /// Covariance of the parameters due to noise and prior alone, from the last pass.
    pub covariance_by_noise: ParameterMatrix,
    /// The other parts of the covariance of the estimate, by their source;
    /// [`crate::calibration::Solution::assess`] adds more.
    pub covariance_parts: BTreeMap<BudgetSource, ParameterMatrix>,
    /// Prior 1σ of every parameter.
    pub prior_sigma: ParameterVector,
    /// Prior of the initial attitude of each stretch.
    pub prior_attitudes: Vec<AttitudePrior>,
    /// Posterior 1σ of the initial attitude of the last stretch about East, North and Up, rad; the last is that of the
    /// heading.
    pub attitude_sigma: Vector3<f64>,
    /// Errors of the table's geometry and parameters of the instrument's error terms.
    pub auxiliary: Auxiliary,
    /// Temperature dependence of the parameters, if any.
    pub thermal: Option<Thermal>,
    /// Deviation of each recording from the common parameters; empty if there is none.
    pub own: Vec<Own>,
    /// Each recording calibrated alone, if something differs between recordings or temperatures.
    pub alone: Vec<SeparateEstimate>,
    /// Gravity and its 1σ after the run, m/s².
    pub gravity: (f64, f64),
    /// Observability of the parameters in the run.
    pub observability: Observability,
    /// Linearisation point of the last pass.
    pub linearised_at: Linearisation,
    /// Each pass in order.
    pub passes: Vec<Pass>,
    /// Whether the last pass moved no parameter by more than the limit.
    pub converged: bool,
    /// Estimate and σ against time in the last pass.
    pub history: Vec<Epoch>,
    /// White 1σ of the velocity at standstill that the filter used in the first stretch, m/s.
    pub velocity_sigma: f64,
    /// Innovations of the last pass.
    pub innovations: Vec<Innovation>,
    /// Consistency of the innovations with their covariance in the last pass.
    pub consistency: Consistency,
    /// Scatter of the dwells relative to the covariance; `None` if there are too few dwells.
    pub dwell_scatter: Option<DwellScatter>,
    /// Whether the data reject the installation form; `None` if they cannot test it.
    pub form_test: Option<FormTest>,
    /// The estimated model, with the noise that was used.
    pub model: Model,
    /// Origin of that noise.
    pub noise: NoiseReport,
    /// Steps of each dwell after a stop that are skipped.
    pub settling: usize,
    /// Causes found in the recording that were not part of the problem.
    pub causes: Vec<FoundCause>,
    /// Findings that a calibration engineer must know before using the figures.
    pub findings: Vec<Finding>,
}

impl Outcome {
    /// The estimate, with the effects of noise and dwell scatter.
    pub(in crate::calibration) fn by_noise(
        as_stated: &Problem,
        solved: Solved,
        form_test: Option<FormTest>,
    ) -> Result<Self, CalibrationError> {
        let (problem, priors) = (solved.problem, solved.priors);
        let (model, prior_sigma) = (&problem.model, as_stated.model.prior_sigma);
        let estimate = solved.iterated.both_triads();
        if let Some(sensor) = not_invertible(&estimate.triads) {
            return Err(CalibrationError::Singular { sensor });
        }
        let (mut held, converged) = (solved.iterated.held, solved.iterated.converged);
        let prior = Prior::new(&held.reduction.constants, model, &held.at);
        let scores = DwellScores::new(&held.reduction, &prior, &held.posterior);
        let widened = scores.as_ref().and_then(DwellScores::widened);
        let scattered = widened.map(|widened| {
            held.posterior = held.posterior.clone().with_covariance(widened);
            let widened = &held.posterior.parameter_covariance;
            Estimate::with_curvature(estimate.triads, widened).covariance - estimate.covariance
        });
        let (mut attitude_sigma, attitude_covariance) = held.last_attitude();
        if priors.last().is_some_and(AttitudePrior::heading_is_unknown) {
            attitude_sigma.z = UNKNOWN_HEADING;
        }
        let gravity = held.gravity();
        let mut outcome = Self {
            form_test,
            dwell_scatter: scores.map(|scores| scores.scatter),
            observability: Observability::new(&estimate, &prior_sigma, &attitude_covariance),
            covariance_by_noise: estimate.covariance,
            estimate,
            covariance_parts: BTreeMap::new(),
            prior_sigma,
            attitude_sigma,
            prior_attitudes: priors,
            auxiliary: held.auxiliary(model),
            thermal: held.posterior.thermal(&held.at, model),
            own: held.reduction.own(&held.at, &held.posterior),
            alone: solved.alone,
            gravity: (problem.run().site.gravity + gravity.0, gravity.1),
            converged,
            consistency: consistency(&held.innovations),
            history: held.reduction.history(&prior, &held.at),
            linearised_at: held.at,
            innovations: held.innovations,
            velocity_sigma: problem.standstill_sigma(Sensor::Accel),
            model: model.clone(),
            settling: solved.settling,
            causes: solved.causes,
            noise: solved.noise,
            passes: solved.passes,
            findings: Vec::new(),
        };
        if let Some(scattered) = scattered {
            outcome.set_part(BudgetSource::DwellScatter, scattered);
        }
        Ok(outcome)
    }

    /// Whether it may be used.
    pub fn is_usable(&self) -> bool {
        Verdict::of(&self.findings).word != Word::Failed
    }

    /// Whether the run observed the heading: without the prior, opposite headings differ by more than 6
    /// in χ².
    pub fn heading_observed(&self) -> bool {
        let information = |sigma: &Vector3<f64>| sigma.z.powi(-2);
        let Some(prior) = self.prior_attitudes.last() else {
            return false;
        };
        if prior.heading_is_unknown() {
            return false;
        }
        let of_run = information(&self.attitude_sigma) - information(&prior.sigma);
        // Opposite directions of Earth rate differ by twice its level part.
        4.0 * of_run > HEADING_SEEN
    }

    /// The problem as calibrated: with the estimated noise, and a prior that the data do not contradict.
    pub(in crate::calibration) fn as_calibrated<'a>(&self, problem: &Problem<'a>) -> Problem<'a> {
        let problem = self.with_prior(problem);
        if self.noise.learnt {
            problem.with_model(problem.model.with_noise_of(&self.model))
        } else {
            problem
        }
    }

    /// The problem with that prior and all causes found, but with the stated noise.
    pub(in crate::calibration) fn with_prior<'a>(&self, problem: &Problem<'a>) -> Problem<'a> {
        let causes = self.causes.iter();
        let problem = causes.fold(problem.settled(self.settling), |problem, of| {
            of.taken_into(&problem)
        });
        problem.with(|model| model.prior_sigma = self.model.prior_sigma)
    }

    /// Accepted observations.
    pub(in crate::calibration) fn accepted(&self) -> Vec<bool> {
        let each = self.innovations.iter();
        each.map(|innovation| innovation.accepted).collect()
    }

    /// Events of a problem at the linearisation point.
    pub(in crate::calibration) fn script<'a>(
        &'a self,
        problem: &'a Problem,
    ) -> Result<Script<'a>, CalibrationError> {
        Script::new(problem, &self.prior_attitudes, &self.linearised_at)
    }

    /// Information of the recording about the constants there.
    pub(in crate::calibration) fn reduction(
        &self,
        problem: &Problem,
    ) -> Result<Reduction, CalibrationError> {
        self.script(problem)?.reduce(problem, &self.accepted())
    }

    /// The same with the prior of those constants.
    pub(in crate::calibration) fn posterior(
        &self,
        problem: &Problem,
        reduction: &Reduction,
    ) -> Posterior {
        let constants = &reduction.constants;
        reduction.posterior(&Prior::new(constants, &problem.model, &self.linearised_at))
    }

    /// A part of the covariance of the estimate that no pass includes; zero if absent.
    pub fn part(&self, source: BudgetSource) -> ParameterMatrix {
        self.covariance_parts
            .get(&source)
            .copied()
            .unwrap_or_default()
    }

    /// Replaces such a part of the covariance of the estimate.
    pub(in crate::calibration) fn set_part(&mut self, source: BudgetSource, part: ParameterMatrix) {
        self.estimate.covariance += part - self.part(source);
        self.covariance_parts.insert(source, part);
    }

    /// Largest growth factor of σ due to such a part.
    pub(in crate::calibration) fn growth_by(&self, source: BudgetSource) -> f64 {
        let with = self.estimate.covariance;
        let without = with - self.part(source);
        let variances = [without, with].map(|covariance| covariance.diagonal());
        largest_growth(variances[0].as_slice(), variances[1].as_slice())
    }

    /// Indices of the parameters that the run did not observe.
    pub fn unobserved(&self) -> Vec<usize> {
        let sigma = self.estimate.sigma();
        let hidden = |&i: &usize| sigma[i] > OBSERVED_BELOW * self.prior_sigma[i];
        self.estimate.estimated().filter(hidden).collect()
    }
}
