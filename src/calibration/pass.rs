//! A pass of the filter over a recording: estimate, covariance and accepted observations.

use nalgebra::Vector3;

use crate::calibration::checks::observability::AttitudeCovariance;
use crate::calibration::constants::parameters;
pub use crate::calibration::filter::Gate;
use crate::calibration::filter::Judge;
use crate::calibration::reduction::Keeping;
use crate::calibration::{
    Auxiliary, CalibrationError, Constant, Innovation, Linearisation, Model, Posterior, Prior,
    Problem, Reduction, Script, auxiliary_vector,
};

/// Result of a pass.
#[derive(Debug, Clone)]
pub struct PassResult {
    /// Its linearisation point.
    pub at: Linearisation,
    pub reduction: Reduction,
    /// Posterior of the constants.
    pub posterior: Posterior,
    /// Cost: sum of squared whitened innovations; it includes the prior, because the filter starts from it.
    /// A rejected observation counts with the limit of the gate.
    pub cost: f64,
    pub innovations: Vec<Innovation>,
}

/// Runs a pass through the events of a recording.
pub fn pass(
    problem: &Problem,
    script: &Script,
    gate: Gate,
) -> Result<PassResult, CalibrationError> {
    let limit = problem.gate_limit();
    let mut judge = Judge::new(gate, limit);
    let reduction = script.follow(problem, &mut judge, Keeping::Innovations)?;
    let prior = Prior::new(&reduction.constants, &problem.model, script.at);
    let innovations = judge.innovations;
    let cost = |of: &Innovation| if of.accepted { of.distance() } else { limit };
    Ok(PassResult {
        at: script.at.clone(),
        posterior: reduction.posterior(&prior),
        reduction,
        cost: innovations.iter().map(cost).sum(),
        innovations,
    })
}

impl PassResult {
    /// Whether each observation was accepted.
    pub fn accepted(&self) -> Vec<bool> {
        self.innovations.iter().map(|of| of.accepted).collect()
    }

    /// The accepted observations.
    pub fn let_in(&self) -> impl Iterator<Item = &Innovation> {
        self.innovations.iter().filter(|of| of.accepted)
    }

    /// −2 ln of the likelihood, up to a constant.
    pub fn deviance(&self) -> f64 {
        self.let_in().map(Innovation::deviance).sum()
    }

    /// Linearisation point of the next pass.
    pub fn estimate(&self) -> Linearisation {
        self.reduction.estimate(&self.at, &self.posterior)
    }

    /// Mean and 1σ of the error of gravity, true − stated, m/s²; zero if it is not estimated.
    pub fn gravity(&self) -> (f64, f64) {
        let Posterior {
            mean, covariance, ..
        } = &self.posterior;
        let of_site = self.reduction.gravity.as_ref().map(|gravity| {
            let (mean, covariance) = gravity.given(&self.posterior);
            (mean[0], covariance[(0, 0)])
        });
        let mut constants = self.reduction.constants.iter();
        let place = constants.position(|&constant| constant == Constant::Gravity);
        let found = of_site.or_else(|| place.map(|k| (mean[k], covariance[(k, k)])));
        found.map_or((0.0, 0.0), |(mean, variance)| {
            (mean, variance.max(0.0).sqrt())
        })
    }

    /// Initial attitude of the last stretch: 1σ about East, North and Up, rad, and its covariance with each parameter
    /// divided by this 1σ.
    pub fn last_attitude(&self) -> (Vector3<f64>, AttitudeCovariance) {
        let mut across = AttitudeCovariance::zeros();
        let Some(attitude) = self.reduction.attitudes.last() else {
            return (Vector3::zeros(), across);
        };
        let (_, covariance) = attitude.given(&self.posterior);
        let sigma = Vector3::from_fn(|axis, _| covariance[(axis, axis)].max(0.0).sqrt());
        let with_constants = attitude.with_constants(&self.posterior);
        for (k, index) in parameters(&self.reduction.constants) {
            for axis in 0..3 {
                across[(index, axis)] = with_constants[(k, axis)] / sigma[axis];
            }
        }
        (sigma, across)
    }

    /// Estimates of error terms and table.
    pub fn auxiliary(&self, model: &Model) -> Auxiliary {
        let mut auxiliary = Auxiliary {
            prior_sigma: auxiliary_vector(&model.geometry.vector(), &model.term_sigma),
            ..Auxiliary::default()
        };
        let Posterior {
            mean, covariance, ..
        } = &self.posterior;
        let all = self.reduction.constants.iter().enumerate();
        let all = all.filter_map(|(k, constant)| Some((k, constant.auxiliary()?)));
        let all: Vec<(usize, usize)> = all.collect();
        for &(k, index) in &all {
            let at = Auxiliary::of_terms(index).map_or(0.0, |term| self.at.terms[term]);
            auxiliary.values[index] = mean[k] + at;
            for &(j, other) in &all {
                auxiliary.covariance[(index, other)] = covariance[(k, j)];
            }
            for (j, parameter) in parameters(&self.reduction.constants) {
                auxiliary.cross[(parameter, index)] = covariance[(j, k)];
            }
        }
        auxiliary
    }
}
