//! The uncertainty budget of an estimate: its covariance by source (JCGM 100:2008, JCGM 102:2011).
//!
//! The covariance of a filter is homogeneous of degree one in the variances of all sources together: priors, noise of
//! the instrument, errors of the table, noise of each observation. So the part of a source is its variance times the
//! derivative with respect to it, and the parts add up to the covariance (Euler). The part of the prior of the
//! constants is exact; the derivative with respect to a noise is computed from the information of two reductions.

pub mod curvature;

mod record;
pub mod source;

use std::collections::BTreeSet;

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::calibration::budget::curvature::curvature;
use crate::calibration::constants::of_parameters;
use crate::calibration::{
    CalibrationError, Layout, Outcome, PARAMETERS, ParameterMatrix, Prior, Problem, Source,
};
use crate::run::Run;
use crate::statistics::student_limit;
pub use record::{BudgetPartRecord, BudgetRecord, LeftOffRecord};
pub use source::BudgetSource;

/// Two-sided coverage probability: k = 2 with a normal distribution.
const COVERAGE: f64 = 0.954_499_736_103_642;
/// The end of a 95 % interval, in σ.
const END_OF_INTERVAL: f64 = 1.959_963_984_540_054;
/// Parts below this share of every variance are negligible.
const NOTHING: f64 = 1e-12;

/// Covariance of an estimate by source.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// The part of each source; the sum is the covariance of the estimate.
    pub parts: Vec<BudgetPart>,
}

/// Contribution of one source to the covariance of an estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct BudgetPart {
    /// The source.
    pub source: BudgetSource,
    /// Its part of the covariance of the parameters of both triads, in their units.
    pub covariance: ParameterMatrix,
    /// Degrees of freedom with which its variance is known (JCGM 100, G.4.2); infinite if it is stated.
    pub degrees_of_freedom: f64,
}

/// Relative change of a source's variance for central differences: they are accurate to its square, and the rounding of
/// covariances that fall by ten orders of magnitude stays below that.
const STEP: f64 = 0.01;

impl Budget {
    /// The budget of the estimate of an outcome.
    ///
    /// # Errors
    /// [`CalibrationError`] if the problem is not the one of the outcome.
    pub fn new(problem: &Problem, outcome: &Outcome) -> Result<Self, CalibrationError> {
        let problem = &outcome.as_calibrated(problem);
        let (script, accepted) = (outcome.script(problem)?, outcome.accepted());
        let reduction = |varied| {
            let problem = problem.with(|model| model.varied = varied);
            script.reduce(&problem, &accepted)
        };
        let own = reduction(None)?;
        let prior = Prior::new(&own.constants, &problem.model, &outcome.linearised_at);
        let posterior = own.posterior(&prior);
        let of_constants = |part: &DMatrix<f64>| of_parameters(&own.constants, part);
        let of_noise = |source: BudgetSource| {
            let information = |factor| Ok(reduction(Some((source, factor)))?.information());
            let fall = information(1.0 - STEP)? - information(1.0 + STEP)?;
            let part = &posterior.covariance * (fall / (2.0 * STEP)) * &posterior.covariance;
            Ok::<_, CalibrationError>((source, of_constants(&part)))
        };
        let sources = problem.sources().into_par_iter();
        let mut by_source = sources.map(of_noise).collect::<Result<Vec<_>, _>>()?;
        let of_prior = prior.parts(&posterior).into_iter();
        by_source.extend(of_prior.map(|(source, part)| (source, of_constants(&part))));
        let filter: ParameterMatrix = by_source.iter().map(|(_, part)| part).sum();
        let bent = curvature(&outcome.estimate.triads, &filter);
        let beside = outcome.covariance_parts.iter();
        let parts = by_source
            .into_iter()
            .chain([(BudgetSource::Curvature, bent)])
            .chain(beside.map(|(&source, &part)| (source, part)));
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

    /// Adds a part whose variance is known exactly.
    pub(in crate::calibration) fn and(
        mut self,
        source: BudgetSource,
        covariance: ParameterMatrix,
    ) -> Self {
        self.parts.push(BudgetPart {
            source,
            covariance,
            degrees_of_freedom: f64::INFINITY,
        });
        self
    }

    /// The sum of all parts.
    pub fn covariance(&self) -> ParameterMatrix {
        self.parts.iter().map(|part| part.covariance).sum()
    }

    /// Degrees of freedom of the combined standard uncertainty of a parameter (Welch and Satterthwaite, JCGM 100,
    /// G.4.1); infinite if infinite for all parts.
    pub fn degrees_of_freedom(&self, parameter: usize) -> f64 {
        let of = |part: &BudgetPart| part.covariance[(parameter, parameter)];
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

impl Problem<'_> {
    /// The noise sources of its reduction: stated sources and those with a nonzero floor.
    fn sources(&self) -> BTreeSet<BudgetSource> {
        let layout = Layout::new(&self.model, self.one_gravity());
        let noise = Source::ALL.into_iter();
        let noise = noise.filter(|source| source.sigma(self) > 0.0);
        let bridged = |run: &Run| {
            let imu = &run.recording.imu;
            imu.bridged(&(0..imu.len())).next().is_some()
        };
        let interpolated = self.runs().any(bridged);
        let always = [
            BudgetSource::Pulses,
            BudgetSource::VelocityAtRest,
            BudgetSource::AttitudeAtRest,
        ];
        let states = layout.sources.into_iter();
        states
            .chain(noise.map(Source::in_budget))
            .chain(always)
            .chain(interpolated.then_some(BudgetSource::Interpolated))
            .collect()
    }
}

impl BudgetSource {
    /// Degrees of freedom with which its variance is known: ½ (u/Δu)² (JCGM 100, G.4.2). Δu is taken from the upper end
    /// of the interval of the estimated noise, because the lower end may be zero; the smallest of several figures is
    /// used, but at least one.
    fn degrees_of_freedom(self, outcome: &Outcome) -> f64 {
        if self == Self::DwellScatter {
            let parameters = outcome.estimate.estimated().count().max(1);
            let scores = outcome.dwell_scatter.map_or(0, |scatter| scatter.count);
            return (scores as f64 / parameters as f64).max(1.0);
        }
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

/// Coverage factor for 95.45 % and this many degrees of freedom.
fn coverage_factor(degrees_of_freedom: f64) -> f64 {
    if degrees_of_freedom.is_finite() {
        student_limit(degrees_of_freedom, 0.5 * (1.0 - COVERAGE))
    } else {
        2.0
    }
}

#[cfg(test)]
mod tests;
