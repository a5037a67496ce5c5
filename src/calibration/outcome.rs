//! Outcome of the estimator: an estimate with its covariance, and the diagnostics of the filter.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::calibration::chain::Filtered;
use crate::calibration::chain::states::ATTITUDE;
use crate::calibration::checks::event::Event;
use crate::calibration::checks::form::form_test;
use crate::calibration::checks::innovation::consistency;
use crate::calibration::checks::observability::AttitudeCovariance;
use crate::calibration::checks::recordings::RecordingDifference;
use crate::calibration::checks::rounding::by_rounding;
use crate::calibration::checks::term::{TermEvidence, is_shown};
use crate::calibration::constants::parameters;
use crate::calibration::iterations::Solved;
use crate::calibration::linearisation::{UNKNOWN_HEADING, not_invertible};
use crate::calibration::parameters::Before;
use crate::calibration::several::SeparateEstimate;
use crate::calibration::sizes::{LARGEST, Weighed};
use crate::calibration::{
    AttitudePrior, Auxiliary, CalibrationError, Candidate, Consistency, Constant, Difference,
    Epoch, Estimate, Finding, FormTest, Innovation, Linearisation, MagneticEstimate, Model,
    NoiseReport, Observability, ParameterMatrix, ParameterVector, Pass, Posterior, Problem,
    Thermal, Verdict, Word,
};
use crate::imu::Sensor;

/// Minimum χ² difference between opposite headings for an observed heading.
const HEADING_SEEN: f64 = 6.0;

/// The result of the filter on one run.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The estimate after the last pass.
    pub estimate: Estimate,
    /// Prior 1σ of every parameter.
    pub prior_sigma: ParameterVector,
    /// Prior of the initial attitude of each stretch.
    pub prior_attitudes: Vec<AttitudePrior>,
    /// Posterior 1σ of the initial attitude of the last stretch about East, North and Up, rad; the last component is
    /// the σ of the heading.
    pub attitude_sigma: Vector3<f64>,
    /// Errors of the table geometry and parameters of the instrument's error terms, if they are certain or requested.
    pub auxiliary: Auxiliary,
    /// Temperature dependence of the parameters, if any.
    pub thermal: Option<Thermal>,
    /// Deviation of each recording from the common parameters; empty if the parameters do not differ.
    pub own: Vec<Own>,
    /// Separate calibration of each recording, if recordings or temperatures differ.
    pub alone: Vec<SeparateEstimate>,
    /// The magnetometer and its field, if there is one and the dwells determine it.
    pub magnetic: Option<MagneticEstimate>,
    /// Gravity and its 1σ after the fit, m/s².
    pub gravity: (f64, f64),
    /// Observability of the parameters in the run.
    pub observability: Observability,
    /// Linearisation point of the last pass.
    pub linearised_at: Linearisation,
    /// All passes in order.
    pub passes: Vec<Pass>,
    /// Whether the last pass changed no parameter by more than the limit.
    pub converged: bool,
    /// Estimate and σ against time in the last pass.
    pub history: Vec<Epoch>,
    /// 1σ of the velocity at standstill (white) that the filter used in the first stretch, m/s.
    pub velocity_sigma: f64,
    /// Innovations of the last pass.
    pub innovations: Vec<Innovation>,
    /// Consistency of the innovations with their covariance in the last pass.
    pub consistency: Consistency,
    /// Whether the data reject the misalignment form; `None` if they cannot test it.
    pub form_test: Option<FormTest>,
    /// The estimated model, with the noise that was used.
    pub model: Model,
    /// Origin of the noise that was used.
    pub noise: NoiseReport,
    /// Single unusual events.
    pub events: Vec<Event>,
    /// Evidence for every error term that may be present.
    pub terms: Vec<TermEvidence>,
    /// Differences between recordings that the data show beyond the stated ones.
    pub differences: Vec<RecordingDifference>,
    /// Findings that a calibration engineer must know before using the figures.
    pub findings: Vec<Finding>,
    /// The iterations from which all this follows.
    pub(in crate::calibration) solved: Arc<Solved>,
}

/// Deviation of one recording from the common parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Own {
    /// The estimate.
    pub values: Difference,
    /// 1σ of each deviation; zero for parameters common to all recordings.
    pub sigma: Difference,
}

impl Outcome {
    /// The outcome of a problem as stated, solved with a prior that it does not contradict.
    pub(in crate::calibration) fn new(
        (as_stated, problem): (&Problem, &Problem),
        alone: Vec<SeparateEstimate>,
        solved: Solved,
    ) -> Result<Self, CalibrationError> {
        if let Some(sensor) = not_invertible(&solved.estimate.triads) {
            return Err(CalibrationError::Singular { sensor });
        }
        let (script, effects) = (solved.script.clone(), &solved.effects);
        let chain = effects.chain(problem, &script)?;
        let weighed = effects.weighed(&chain, problem, &script)?;
        let Weighed {
            filtered,
            prior,
            posterior,
            ..
        } = &weighed;
        let model = effects.model(&problem.model);
        let made = problem.with_model(model.clone());
        let sites = effects.candidates.sites(prior);
        let (innovations, mut history) =
            filtered.innovations((&made, &script), (prior, &sites), &effects.dispersion)?;
        let estimate = with_all_parts(problem, &solved);
        if let Some(last) = history.last_mut() {
            (last.estimate, last.sigma) = (estimate.vector(), estimate.sigma());
        }
        let (attitude_sigma, attitude_covariance) = last_attitude(&weighed, &script.priors);
        let prior_sigma = as_stated.model.prior_sigma;
        let (off, gravity_sigma) = gravity(filtered, posterior);
        Ok(Self {
            observability: Observability::new(&estimate, &prior_sigma, &attitude_covariance),
            form_test: form_test(problem, &solved)?,
            auxiliary: auxiliary(&weighed, &solved, &problem.model),
            thermal: posterior.thermal(&script.at, &problem.model),
            own: own(filtered, posterior, &script.at),
            magnetic: MagneticEstimate::new(posterior, &script.at, &problem.model)
                .filter(MagneticEstimate::is_shown),
            gravity: (problem.run().site.gravity + off, gravity_sigma),
            terms: TermEvidence::all(&weighed, &effects.candidates, &problem.model),
            events: Event::all(problem, &weighed),
            differences: effects.differences(&weighed, problem)?,
            velocity_sigma: made.standstill_sigma(Sensor::Accel),
            noise: effects.report(problem),
            consistency: consistency(&innovations),
            prior_attitudes: script.priors.clone(),
            linearised_at: script.at.clone(),
            passes: solved.passes.clone(),
            converged: solved.converged,
            findings: Vec::new(),
            estimate,
            prior_sigma,
            attitude_sigma,
            alone,
            history,
            innovations,
            model,
            solved: Arc::new(solved),
        })
    }

    /// Whether the result may be used.
    pub fn is_usable(&self) -> bool {
        Verdict::of(&self.findings).word != Word::Failed
    }

    /// Whether the run observed the heading, that is, whether opposite headings differ by more than 6 in χ² without the
    /// prior.
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

    /// Values and σ before the recording, as stated.
    pub(in crate::calibration) fn before(&self) -> Before<'_> {
        Before {
            mean: &self.model.prior_mean,
            sigma: &self.prior_sigma,
        }
    }

    /// Indices of the parameters that the run did not observe.
    pub fn unobserved(&self) -> Vec<usize> {
        self.estimate.unobserved(&self.prior_sigma)
    }
}

/// The estimate with its covariance: that of the chain, the second order of unknown angles, rounding, and the clock.
fn with_all_parts(problem: &Problem, solved: &Solved) -> Estimate {
    let mut estimate = solved.both_triads();
    let beside: ParameterMatrix = beside(problem, &estimate).into_iter().sum();
    estimate.covariance += beside;
    estimate
}

/// Contributions to the covariance that do not come from the chain: rounding and sample period.
pub fn beside(problem: &Problem, estimate: &Estimate) -> [ParameterMatrix; 2] {
    [
        by_rounding(problem, &estimate.triads),
        estimate.by_period(problem.run()),
    ]
}

/// Mean and 1σ of the error of gravity at the last site, true − stated, m/s²; zero if it is not estimated.
fn gravity(filtered: &Filtered, posterior: &Posterior) -> (f64, f64) {
    let (mean, covariance) = (&posterior.mean, &posterior.covariance);
    let mut constants = posterior.constants.iter();
    let place = constants.position(|&constant| constant == Constant::Gravity);
    let found = place.map(|k| (mean[k], covariance[(k, k)]));
    let found = found.or_else(|| {
        let state = filtered.layout().gravity?;
        let (_, last) = filtered.states(posterior, |link| link.begins).pop()?;
        Some((last.mean[state], last.covariance[(state, state)]))
    });
    found.map_or((0.0, 0.0), |(mean, variance)| {
        (mean, variance.max(0.0).sqrt())
    })
}

/// Initial attitude of the last stretch: 1σ about East, North and Up, rad, and its covariance with each parameter
/// divided by this 1σ.
pub fn last_attitude(of: &Weighed, priors: &[AttitudePrior]) -> (Vector3<f64>, AttitudeCovariance) {
    let mut across = AttitudeCovariance::zeros();
    let begins = of.filtered.states(&of.posterior, |link| link.begins);
    let Some((_, last)) = begins.last() else {
        return (Vector3::zeros(), across);
    };
    let variance = |axis: usize| last.covariance[(ATTITUDE + axis, ATTITUDE + axis)];
    let mut sigma = Vector3::from_fn(|axis, _| variance(axis).max(0.0).sqrt());
    for (k, index) in parameters(&of.posterior.constants) {
        for axis in 0..3 {
            across[(index, axis)] = last.with_constants[(k, ATTITUDE + axis)] / sigma[axis];
        }
    }
    if priors.last().is_some_and(AttitudePrior::heading_is_unknown) {
        sigma.z = UNKNOWN_HEADING;
    }
    (sigma, across)
}

/// Deviation of each recording, linearised `at` a point.
fn own(filtered: &Filtered, posterior: &Posterior, at: &Linearisation) -> Vec<Own> {
    let layout = filtered.layout();
    let mut all = Vec::new();
    if layout.own.is_empty() {
        return all;
    }
    for (link, states) in filtered.states(posterior, |link| link.begins) {
        if link.recording < all.len() {
            continue;
        }
        let mut own = Own {
            values: at.own(link.recording),
            sigma: Difference::default(),
        };
        for &(state, of) in &layout.own {
            *own.values.get_mut(of) += states.mean[state];
            *own.sigma.get_mut(of) = states.covariance[(state, state)].max(0.0).sqrt();
        }
        all.push(own);
    }
    all
}

/// Estimates of the error terms and table errors that were requested or are certain.
pub fn auxiliary(of: &Weighed, solved: &Solved, model: &Model) -> Auxiliary {
    let count = solved.effects.candidates.absent().count();
    let shown = |constant: Constant| {
        Candidate::of(constant, model).is_none_or(|candidate| {
            let mut absent = solved.effects.candidates.absent();
            let is_it = |(other, absent)| other == candidate && is_shown(absent, count);
            solved.converged && absent.any(is_it)
        })
    };
    auxiliary_of(&of.posterior, &solved.script.at, model, shown)
}

/// Estimates of the selected constants.
pub fn auxiliary_of(
    posterior: &Posterior,
    at: &Linearisation,
    model: &Model,
    selected: impl Fn(Constant) -> bool,
) -> Auxiliary {
    let mut auxiliary = Auxiliary::default();
    let (mean, covariance) = (&posterior.mean, &posterior.covariance);
    let all = posterior.constants.iter().enumerate();
    let all = all.filter_map(|(k, &constant)| {
        let index = constant.auxiliary().filter(|_| selected(constant))?;
        Some((k, index))
    });
    let all: Vec<(usize, usize)> = all.collect();
    for &(k, index) in &all {
        let at = Auxiliary::of_terms(index).map_or(0.0, |term| at.terms[term]);
        auxiliary.values[index] = mean[k] + at;
        let constant = posterior.constants[k];
        let widest = Candidate::of(constant, model).map_or(1.0, |_| LARGEST);
        auxiliary.prior_sigma[index] = widest * constant.sigma(model);
        for &(j, other) in &all {
            auxiliary.covariance[(index, other)] = covariance[(k, j)];
        }
        for (j, parameter) in parameters(&posterior.constants) {
            auxiliary.cross[(parameter, index)] = covariance[(j, k)];
        }
    }
    auxiliary
}
