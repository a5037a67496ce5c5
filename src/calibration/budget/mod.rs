//! The uncertainty budget of an estimate: its covariance by source (JCGM 100:2008, JCGM 102:2011).
//!
//! The covariance of a filter is homogeneous of degree one in the variances of all sources together: priors, noise of
//! the instrument, errors of the table, and noise of each observation. The contribution of a source is therefore its
//! variance times the derivative of the covariance with respect to this variance, and the contributions add up to the
//! covariance (Euler). The contributions of effects between dwells come from one backward pass (Koopman and Shephard
//! 1992), the contribution of the prior is exact, and those of sources at rest are finite differences of the chain.

pub mod curvature;

mod record;
pub mod source;

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::calibration::budget::curvature::curvature;
use crate::calibration::chain::Filtered;
use crate::calibration::constants::{Sites, of_parameters};
use crate::calibration::iterations::Solved;
use crate::calibration::outcome::beside;
use crate::calibration::sizes::{Candidates, Weighed};
use crate::calibration::{
    CalibrationError, Outcome, PARAMETERS, ParameterMatrix, Posterior, Problem,
};
use crate::imu::Sensor;
use crate::statistics::student_limit;
pub use record::{BudgetPartRecord, BudgetRecord};
pub use source::BudgetSource;

/// Two-sided coverage probability: k = 2 with a normal distribution.
const COVERAGE: f64 = 0.954_499_736_103_642;
/// Half of a 95 % interval, in σ.
const END_OF_INTERVAL: f64 = 1.959_963_984_540_054;
/// Parts below this share of every variance are negligible.
const NOTHING: f64 = 1e-12;

/// Covariance of an estimate by source.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// The contribution of each source; their sum is the covariance of the estimate.
    pub parts: Vec<BudgetPart>,
}

/// Contribution of one source to the covariance of an estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct BudgetPart {
    /// The source.
    pub source: BudgetSource,
    /// Contribution to the covariance of the parameters of both triads, in their units.
    pub covariance: ParameterMatrix,
    /// Degrees of freedom of the variance of the source (JCGM 100, G.4.2); infinite if the variance is stated.
    pub degrees_of_freedom: f64,
}

impl BudgetPart {
    /// Part of the variance of a parameter; rounding may make a difference slightly negative.
    fn variance(&self, parameter: usize) -> f64 {
        self.covariance[(parameter, parameter)].max(0.0)
    }
}

/// Relative change of the variance of a source at rest, for a finite difference. The difference is accurate to this
/// fraction; rounding errors stay below it even if covariances fall by ten orders of magnitude.
const STEP: f64 = 3e-4;

/// Sources that act within dwells. Each part is found by filtering the chain again with a slightly larger variance.
const AT_REST: [BudgetSource; 10] = [
    BudgetSource::White(Sensor::Gyro),
    BudgetSource::White(Sensor::Accel),
    BudgetSource::Pulses,
    BudgetSource::VelocityAtRest,
    BudgetSource::AttitudeAtRest,
    BudgetSource::RotationAtRest,
    BudgetSource::TableReading,
    BudgetSource::Settling,
    BudgetSource::Place,
    BudgetSource::MagneticNoise,
];

impl Budget {
    /// The budget of the estimate of an outcome.
    ///
    /// # Errors
    /// Returns [`CalibrationError`] if the outcome belongs to a different problem.
    pub fn new(problem: &Problem, outcome: &Outcome) -> Result<Self, CalibrationError> {
        let problem = &problem.with(|model| model.prior_sigma = outcome.model.prior_sigma);
        let by_source = of_chain(problem, outcome)?;
        let linear = &outcome.solved.posterior.parameter_covariance;
        let bent = curvature(&outcome.estimate.triads, linear);
        let [rounding, period] = beside(problem, &outcome.estimate);
        let parts = by_source.into_iter().chain([
            (BudgetSource::Curvature, bent),
            (BudgetSource::Rounding, rounding),
            (BudgetSource::Period, period),
        ]);
        let variance = outcome.estimate.covariance.diagonal();
        let counts = |part: &ParameterMatrix| {
            let own = part.diagonal();
            (0..PARAMETERS).any(|i| own[i] > NOTHING * variance[i])
        };
        Ok(Self {
            parts: parts
                .filter(|(_, covariance)| counts(covariance))
                .map(|(source, covariance)| BudgetPart {
                    source,
                    covariance,
                    degrees_of_freedom: source.degrees_of_freedom(outcome),
                })
                .collect(),
        })
    }

    /// The sum of all contributions.
    pub fn covariance(&self) -> ParameterMatrix {
        self.parts.iter().map(|part| part.covariance).sum()
    }

    /// Degrees of freedom of the combined standard uncertainty of a parameter (Welch and Satterthwaite, JCGM 100,
    /// G.4.1); infinite if all contributions have infinite degrees of freedom.
    pub fn degrees_of_freedom(&self, parameter: usize) -> f64 {
        let of = |part: &BudgetPart| part.variance(parameter);
        let combined: f64 = self.parts.iter().map(of).sum();
        let each = self.parts.iter();
        let sum: f64 = each
            .map(|part| of(part).powi(2) / part.degrees_of_freedom)
            .sum();
        combined.powi(2) / sum
    }

    /// Coverage factor of a parameter for 95.45 %: 2 for infinite degrees of freedom, else
    /// from Student's t (JCGM 100, G.3).
    pub fn coverage_factor(&self, parameter: usize) -> f64 {
        coverage_factor(self.degrees_of_freedom(parameter))
    }
}

/// Parts of the covariance of the chain by source.
fn of_chain(
    problem: &Problem,
    outcome: &Outcome,
) -> Result<BTreeMap<BudgetSource, ParameterMatrix>, CalibrationError> {
    let solved = &outcome.solved;
    let effects = &solved.effects;
    let chain = effects.chain(problem, &solved.script)?;
    let weighed = effects.weighed(&chain, problem, &solved.script)?;
    let mut by_source = BTreeMap::<BudgetSource, ParameterMatrix>::new();
    let mut add = |source: BudgetSource, part: ParameterMatrix| {
        *by_source.entry(source).or_default() += part;
    };
    let Weighed {
        filtered,
        prior,
        known,
        posterior,
    } = &weighed;
    // Parts of all sources except the candidates are computed as if the candidates were known; the parts of the
    // candidates are what they add.
    let given = filtered.posterior_with(known, &Sites::certain(prior));
    let given = given.as_ref().unwrap_or(posterior);
    let constants = &posterior.constants;
    for (source, part) in at_rest(problem, outcome, (filtered, given))? {
        add(source, part);
    }
    for (effect, part) in filtered.parts(given) {
        add(effect.in_budget(), of_parameters(constants, &part));
    }
    for (source, part) in prior.parts(given) {
        add(source, of_parameters(constants, &part));
    }
    for (source, part) in of_candidates(&weighed, &effects.candidates) {
        add(source, part);
    }
    let sum: ParameterMatrix = by_source.values().sum();
    let rest = posterior.parameter_covariance - sum;
    // The remainder of the finite differences is assigned to the largest part.
    let trace = |part: &ParameterMatrix| relative(part, &posterior.parameter_covariance);
    let largest = by_source.iter_mut();
    let largest = largest.max_by(|a, b| trace(a.1).total_cmp(&trace(b.1)));
    if let Some((_, part)) = largest {
        *part += rest;
    }
    Ok(by_source)
}

/// Parts of the sources at rest: their variance times the derivative of the covariance, `−C Λ′ C`, where Λ′ is the
/// derivative of the information of the rows.
fn at_rest(
    problem: &Problem,
    outcome: &Outcome,
    (filtered, posterior): (&Filtered, &Posterior),
) -> Result<Vec<(BudgetSource, ParameterMatrix)>, CalibrationError> {
    let Solved {
        script, effects, ..
    } = &*outcome.solved;
    let here = filtered.information();
    let covariance = &posterior.covariance;
    let part = |&source: &BudgetSource| {
        let varied = problem.with(|model| model.varied = Some((source, 1.0 + STEP)));
        let there = effects.information(&varied, script, &filtered.sizes)?;
        let part = covariance * ((&here - there) / STEP) * covariance;
        Ok((source, of_parameters(&posterior.constants, &part)))
    };
    let has_magnetometer = problem.model.magnetic.is_on();
    let sources = AT_REST.par_iter();
    let sources = sources.filter(|&&of| has_magnetometer || of != BudgetSource::MagneticNoise);
    sources.map(part).collect()
}

/// Parts of the constants that may be absent. Together they add `A Σ⁻¹ Aᵀ`: Σ is their covariance, A their covariance
/// with all others. Each has one column of `A Σ⁻½`, the columns nearest to their own (Zuber and Strimmer 2011, "High-
/// dimensional regression and variable selection using CAR scores", Statistical Applications in Genetics 10(1)).
fn of_candidates(
    weighed: &Weighed,
    candidates: &Candidates,
) -> Vec<(BudgetSource, ParameterMatrix)> {
    let posterior = &weighed.posterior;
    let n = weighed.prior.constants.len();
    let first = n - weighed.prior.candidates;
    let all: Vec<usize> = (first..n).collect();
    if all.is_empty() {
        return Vec::new();
    }
    let across = posterior.covariance.select_columns(&all);
    let own = across.select_rows(&all);
    let scale = DMatrix::from_diagonal(&own.diagonal().map(|value| value.sqrt().recip()));
    let mut correlation = (&scale * &own * &scale).symmetric_eigen();
    correlation
        .eigenvalues
        .apply(|value| *value = value.max(f64::EPSILON).sqrt().recip());
    let columns = across * scale * correlation.recompose();
    let part = |places: &[usize]| {
        let columns = columns.select_columns(places);
        let part = &columns * columns.transpose();
        let source = posterior.constants[first + places[0]].source();
        (source, of_parameters(&posterior.constants, &part))
    };
    candidates
        .places()
        .map(|(_, places)| part(places))
        .collect()
}

/// Sum of the variances, each divided by that of the whole.
fn relative(part: &ParameterMatrix, whole: &ParameterMatrix) -> f64 {
    let pairs = part.diagonal().zip_map(&whole.diagonal(), |part, whole| {
        if whole > 0.0 { part / whole } else { 0.0 }
    });
    pairs.sum()
}

impl BudgetSource {
    /// Degrees of freedom of its variance: ½ (u/Δu)² (JCGM 100, G.4.2). Δu is taken from the upper end of the interval
    /// of the estimated noise, because the lower end may be zero; the smallest of several figures is used, but at least
    /// one.
    fn degrees_of_freedom(self, outcome: &Outcome) -> f64 {
        let learnt = outcome.noise.sources.iter();
        let of_own = learnt.filter(|figures| figures.source.in_budget() == self);
        let freedoms = of_own.filter_map(|figures| {
            let [_, high] = figures.interval?;
            let relative = (high / figures.used).ln() / END_OF_INTERVAL;
            (figures.used > 0.0 && relative > 0.0).then(|| (0.5 / relative.powi(2)).max(1.0))
        });
        freedoms.fold(f64::INFINITY, f64::min)
    }
}

/// Coverage factor for 95.45 % and this many degrees of freedom, which may be infinite.
pub fn coverage_factor(degrees_of_freedom: f64) -> f64 {
    if degrees_of_freedom.is_finite() {
        student_limit(degrees_of_freedom, 0.5 * (1.0 - COVERAGE))
    } else {
        2.0
    }
}

#[cfg(test)]
mod tests;
