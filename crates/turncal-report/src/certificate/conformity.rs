//! Conformity with limits, by a stated decision rule.
//!
//! Source: JCGM 106:2012, 8.3 (guard bands), 9.3 (specific consumer's risk); ILAC-G8:09/2019, 4.2.

use super::results::{coverage, nominal};
use turncal::calibration::result::frame::Canonical;
use turncal::calibration::result::{Calibration, Provenance};
use turncal::calibration::{ComparisonError, parameter_name};
use turncal::imu::InstallationForm;
use turncal::laboratory::DecisionRule;
use turncal::lot::{Limit, Specification, probability_outside};

/// Decision on a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Decision {
    /// Within the limit.
    Pass,
    /// The value is inside the limit, but by less than its uncertainty.
    ConditionalPass,
    /// The value is outside the limit, but by less than its uncertainty.
    ConditionalFail,
    /// Outside the limit.
    Fail,
}

impl Decision {
    /// The decision in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::ConditionalPass => "conditional pass",
            Self::ConditionalFail => "conditional fail",
            Self::Fail => "fail",
        }
    }

    /// Code of the decision in the Digital Calibration Certificate.
    pub fn code(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::ConditionalPass => "conditionalPass",
            Self::ConditionalFail => "conditionalFail",
            Self::Fail => "fail",
        }
    }
}

/// Decision on a parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Decided {
    /// Name of the parameter in the general form.
    pub name: String,
    /// The limit.
    pub limit: Limit,
    /// Distance of the value from the centre between the limits, in SI units.
    pub off: f64,
    /// 1σ of this distance.
    pub sigma: f64,
    /// Coverage factor of the parameter, as in the table of results.
    pub coverage_factor: f64,
    /// The decision.
    pub decision: Decision,
    /// Probability that the decision is wrong (false acceptance or false rejection).
    pub risk: f64,
}

/// Conformity with all limits.
#[derive(Debug, Clone, PartialEq)]
pub struct Conformity {
    /// The decision rule.
    pub rule: DecisionRule,
    /// Each limit.
    pub limits: Vec<Decided>,
    /// Names of parameters that have a limit and were not estimated.
    pub not_decided: Vec<String>,
}

impl Conformity {
    /// Combined decision on all limits; `None` if there are no limits.
    pub fn overall(&self) -> Option<Decision> {
        self.limits.iter().map(|limit| limit.decision).max()
    }
}

/// Decision on a parameter at this distance from the centre between its limits, and the probability that the decision
/// is wrong. The guard band is the expanded uncertainty, k σ.
pub fn decide(
    off: f64,
    (sigma, k): (f64, f64),
    within: f64,
    rule: DecisionRule,
) -> (Decision, f64) {
    let outside = probability_outside(off, sigma, within);
    let guard = match rule {
        DecisionRule::GuardBand => k * sigma,
        DecisionRule::SimpleAcceptance => 0.0,
    };
    let decision = match off.abs() {
        off if off <= within - guard => Decision::Pass,
        off if off <= within => Decision::ConditionalPass,
        off if off < within + guard => Decision::ConditionalFail,
        _ => Decision::Fail,
    };
    let risk = match decision {
        Decision::Pass | Decision::ConditionalPass => outside,
        Decision::ConditionalFail | Decision::Fail => 1.0 - outside,
    };
    (decision, risk)
}

pub fn conformity(
    calibration: &Calibration,
    provenance: &Provenance,
    specification: &Specification,
    rule: DecisionRule,
) -> Result<Conformity, ComparisonError> {
    let nominal = nominal(provenance);
    let frame = calibration.body_frame;
    let canonical = Canonical::new("calibration", calibration, &nominal, frame)?;
    let (values, sigma) = (canonical.vector(), canonical.sigma().unwrap_or_default());
    let name = |index| parameter_name(InstallationForm::General, index).unwrap_or_default();
    let (known, unknown): (Vec<&Limit>, Vec<&Limit>) = specification
        .limits
        .iter()
        .partition(|limit| sigma[limit.parameter] > 0.0);
    let decided = known.into_iter().map(|&limit| {
        let (off, sigma) = (
            values[limit.parameter] - limit.nominal,
            sigma[limit.parameter],
        );
        let name = name(limit.parameter);
        let (k, _) = coverage(calibration, &name);
        let (decision, risk) = decide(off, (sigma, k), limit.within, rule);
        Decided {
            name,
            limit,
            off,
            sigma,
            coverage_factor: k,
            decision,
            risk,
        }
    });
    Ok(Conformity {
        rule,
        limits: decided.collect(),
        not_decided: unknown.iter().map(|limit| name(limit.parameter)).collect(),
    })
}
