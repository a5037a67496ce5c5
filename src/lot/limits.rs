//! Limits, and whether units are within them.
//!
//! A value x with σ is within [low, high] with probability `Φ((high − x)/σ) − Φ((low − x)/σ)`. It passes if that
//! is at least the stated confidence, fails if the probability of being outside is, and is not decided between:
//! a guard band on both sides of each limit (JCGM 106:2012, 7.2 and 8.3).

use serde::{Deserialize, Serialize};
use statrs::function::erf::erfc;

use super::quantity::Sample;

/// What units must be, and how sure that must be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Specification {
    /// Probability with which a unit is said to be within or outside each limit.
    pub confidence: f64,
    /// The limits.
    pub limits: Vec<Limit>,
}

/// Within which a parameter must be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// Index of the parameter in the general form.
    pub parameter: usize,
    /// Middle, normalised, in SI.
    pub nominal: f64,
    /// Largest distance from it that is allowed.
    pub within: f64,
}

/// Whether a limit is kept, or all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It is, with the stated confidence.
    Pass,
    /// Neither can be said.
    NotDecided,
    /// It is not, with the stated confidence.
    Fail,
}

/// A unit against one limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Check {
    /// The limit.
    pub limit: Limit,
    /// Distance from the nominal value with its 1σ; none if the unit does not have the parameter.
    pub off: Option<(f64, f64)>,
    /// Probability of being within.
    pub probability: Option<f64>,
    /// What follows.
    pub verdict: Verdict,
}

/// Probability that a value, this far from the middle of a limit, is not within it.
pub fn probability_outside(off: f64, sigma: f64, within: f64) -> f64 {
    let beyond = |distance: f64| 0.5 * erfc(distance / sigma / 2f64.sqrt());
    beyond(within - off) + beyond(within + off)
}

/// A unit against every limit, by the value that it has of each parameter.
pub fn checks(of: &Specification, value: impl Fn(usize) -> Option<Sample>) -> Vec<Check> {
    let check = |&limit: &Limit| {
        let off = value(limit.parameter).map(|of| (of.value - limit.nominal, of.sigma));
        // Without a σ nothing is known of how near the value is.
        let known = off.filter(|(_, sigma)| *sigma > 0.0);
        let outside = known.map(|(off, sigma)| probability_outside(off, sigma, limit.within));
        let verdict = match outside {
            Some(outside) if outside <= 1.0 - of.confidence => Verdict::Pass,
            Some(outside) if outside >= of.confidence => Verdict::Fail,
            _ => Verdict::NotDecided,
        };
        Check {
            limit,
            off,
            probability: outside.map(|outside| 1.0 - outside),
            verdict,
        }
    };
    of.limits.iter().map(check).collect()
}

/// Of several checks: fail if one fails, pass if all pass.
pub fn overall(checks: &[Check]) -> Verdict {
    let worst = checks.iter().map(|check| check.verdict).max();
    worst.unwrap_or(Verdict::NotDecided)
}

impl Verdict {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::NotDecided => "not decided",
            Self::Fail => "fail",
        }
    }
}
