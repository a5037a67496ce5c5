//! Accuracy of a recording in progress, compared with the requirements of a specification.

use super::GroupSigma;
use crate::calibration::{Bound, Estimate, Group, OBSERVED_BELOW, ParameterVector};
use crate::lot::{Check, Limit, Sample, Specification, Verdict, checks};

/// Accuracy that the rows so far allow.
#[derive(Debug, Clone)]
pub struct Attained {
    /// Expected covariance with the stated noise, and its history.
    pub bound: Bound,
    /// Expected σ divided by the σ of the bound.
    pub inflation: ParameterVector,
    /// Expected σ at the end of each dwell.
    pub history: Vec<Reached>,
    /// Parameters that keep more than half of their prior σ.
    pub unobserved: Vec<String>,
    /// Check of every limit of the specification, for a unit at its nominal values.
    pub checks: Vec<Check>,
}

/// Expected σ at the end of a dwell.
#[derive(Debug, Clone, PartialEq)]
pub struct Reached {
    /// Time, s.
    pub time: f64,
    /// σ of each group of parameters.
    pub sigma: GroupSigma,
    /// RMS σ of matrix and bias of the magnetometer with their units, if the rows so far determine it.
    pub magnetic: Option<[(f64, String); 2]>,
}

impl Attained {
    /// Whether a specification is given and, as far as can be predicted, every limit can be decided.
    pub fn is_met(&self) -> bool {
        are_decided(&self.checks)
    }

    /// Time until every limit can be decided, s, if the rest of the recording adds information at the same rate as the
    /// rows so far; `None` without a specification, or if the rows so far do not show a parameter.
    pub fn time_left(&self, specification: Option<&Specification>) -> Option<f64> {
        let specification = specification?;
        let duration = self.bound.history.last()?.time;
        let is_open = |check: &&Check| check.verdict != Verdict::Pass;
        let times = self.checks.iter().filter(is_open).map(|check| {
            let Limit {
                parameter, within, ..
            } = check.limit;
            let (_, sigma) = check.off?;
            let is_shown = sigma < OBSERVED_BELOW * self.bound.prior_sigma[parameter];
            let ratio = sigma / specification.deciding_sigma(within);
            is_shown.then_some(duration * (ratio.powi(2) - 1.0).max(0.0))
        });
        times.reduce(|a, b| Some(a?.max(b?)))?
    }
}

/// Whether there are limits and all of them can be decided.
pub fn are_decided(checks: &[Check]) -> bool {
    let is_decided = |check: &Check| check.verdict == Verdict::Pass;
    !checks.is_empty() && checks.iter().all(is_decided)
}

/// A unit at its nominal values against every limit of an estimated parameter: it passes if the σ of an estimate are
/// small enough to decide the limit.
pub fn decided(specification: &Specification, estimate: &Estimate) -> Vec<Check> {
    let sigma = estimate.in_general_form().sigma();
    let mut specification = specification.clone();
    // Parameters that the body frame fixes have no error.
    specification
        .limits
        .retain(|limit| sigma[limit.parameter] > 0.0);
    checks(&specification, |parameter| {
        let mut limits = specification.limits.iter();
        let limit = limits.find(|limit| limit.parameter == parameter)?;
        Some(Sample {
            value: limit.nominal,
            sigma: sigma[parameter],
        })
    })
}

/// Largest σ of the parameters of a group that decides its tightest limit, for a unit at its nominal values; `None`
/// without a limit.
pub fn needed(specification: &Specification, group: Group) -> Option<f64> {
    let of_group = |limit: &&Limit| Group::of(limit.parameter) == group;
    let limits = specification.limits.iter().filter(of_group);
    let tightest = limits.map(|limit| limit.within).reduce(f64::min)?;
    Some(specification.deciding_sigma(tightest))
}
