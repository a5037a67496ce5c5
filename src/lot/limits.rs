//! Limits, and the check of units against them.
//!
//! A value x with σ is within [low, high] with probability `Φ((high − x)/σ) − Φ((low − x)/σ)`. The value passes if this
//! probability is at least the stated confidence, and fails if the probability of being outside is at least the stated
//! confidence. In between, the limit is not decided: a guard band on both sides of each limit (JCGM 106:2012, 7.2 and
//! 8.3).

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal};
use statrs::function::erf::erfc;

use super::quantity::{Quantity, Sample};

/// Limits for units, with the required confidence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Specification {
    /// Probability required to call a unit within or outside each limit.
    pub confidence: f64,
    /// The limits.
    pub limits: Vec<Limit>,
}

impl Specification {
    /// Largest σ for which a unit at its nominal value passes a limit at this distance.
    pub fn deciding_sigma(&self, within: f64) -> f64 {
        within / Normal::standard().inverse_cdf(0.5 * (1.0 + self.confidence))
    }
}

/// Limit of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// Index of the parameter in the general form.
    pub parameter: usize,
    /// Centre of the range, normalised, in SI units.
    pub nominal: f64,
    /// Largest allowed distance from the centre.
    pub within: f64,
}

/// Result of a check against one limit or against all limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The value is within the limit, with the stated confidence.
    Pass,
    /// The value is neither within nor outside the limit with the stated confidence.
    NotDecided,
    /// The value is outside the limit, with the stated confidence.
    Fail,
}

/// Check of a unit against one limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Check {
    /// The limit.
    pub limit: Limit,
    /// Distance from the nominal value with its 1σ; `None` if the unit does not have the parameter.
    pub off: Option<(f64, f64)>,
    /// Probability of being within the limit.
    pub probability: Option<f64>,
    /// The result.
    pub verdict: Verdict,
}

impl Check {
    /// The parameter that is checked.
    pub fn quantity(&self) -> Quantity {
        Quantity::Parameter(self.limit.parameter)
    }
}

/// Probability that a value at this distance from the centre of a limit is outside it.
pub fn probability_outside(off: f64, sigma: f64, within: f64) -> f64 {
    let beyond = |distance: f64| 0.5 * erfc(distance / sigma / 2f64.sqrt());
    beyond(within - off) + beyond(within + off)
}

/// Checks a unit against every limit; `value` returns the value of a parameter.
pub fn checks(of: &Specification, value: impl Fn(usize) -> Option<Sample>) -> Vec<Check> {
    let check = |&limit: &Limit| {
        let off = value(limit.parameter).map(|of| (of.value - limit.nominal, of.sigma));
        // Without a σ, the uncertainty of the value is unknown.
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

/// Combined verdict of several checks: fail if one fails, pass if all pass.
pub fn overall(checks: &[Check]) -> Verdict {
    let worst = checks.iter().map(|check| check.verdict).max();
    worst.unwrap_or(Verdict::NotDecided)
}

impl Verdict {
    /// Name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::NotDecided => "not decided",
            Self::Fail => "fail",
        }
    }
}
