//! Whether limits are kept, by a stated decision rule.
//!
//! Source: JCGM 106:2012, 8.3 (guard bands), 9.3 (specific consumer's risk); ILAC-G8:09/2019, 4.2.

use super::laboratory::DecisionRule;
use super::results::nominal;
use crate::calibration::result::frame::Canonical;
use crate::calibration::result::{Calibration, Provenance};
use crate::calibration::{ComparisonError, parameter_name};
use crate::imu::InstallationForm;
use crate::lot::{Limit, Specification, probability_outside};

/// Guard band over σ: the expanded uncertainty with k = 2.
const GUARD: f64 = 2.0;

/// What is decided of a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Decision {
    /// It is kept.
    Pass,
    /// The value is within it by less than its uncertainty.
    ConditionalPass,
    /// The value is beyond it by less than its uncertainty.
    ConditionalFail,
    /// It is not kept.
    Fail,
}

impl Decision {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::ConditionalPass => "conditional pass",
            Self::ConditionalFail => "conditional fail",
            Self::Fail => "fail",
        }
    }

    /// As the Digital Calibration Certificate spells it.
    pub fn code(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::ConditionalPass => "conditionalPass",
            Self::ConditionalFail => "conditionalFail",
            Self::Fail => "fail",
        }
    }
}

/// A parameter against its limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Decided {
    /// Its name in the general form.
    pub name: String,
    /// The limit.
    pub limit: Limit,
    /// Distance from its middle, in SI.
    pub off: f64,
    /// 1σ of that.
    pub sigma: f64,
    /// What is decided.
    pub decision: Decision,
    /// Probability that this is wrong: that a parameter that passes is outside, or one that fails inside.
    pub risk: f64,
}

/// All limits.
#[derive(Debug, Clone, PartialEq)]
pub struct Conformity {
    /// How it was decided.
    pub rule: DecisionRule,
    /// Each limit.
    pub limits: Vec<Decided>,
    /// Names of parameters that have a limit and were not estimated.
    pub not_decided: Vec<String>,
}

impl Conformity {
    /// What all limits together come to; none if there is none.
    pub fn overall(&self) -> Option<Decision> {
        self.limits.iter().map(|limit| limit.decision).max()
    }
}

/// A parameter so far from the middle of a limit.
pub fn decide(off: f64, sigma: f64, within: f64, rule: DecisionRule) -> (Decision, f64) {
    let outside = probability_outside(off, sigma, within);
    let guard = match rule {
        DecisionRule::GuardBand => GUARD * sigma,
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
        let (decision, risk) = decide(off, sigma, limit.within, rule);
        Decided {
            name: name(limit.parameter),
            limit,
            off,
            sigma,
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
