//! How constants beside the parameters of the triads are spoken of.

use std::collections::BTreeMap;

use super::number::{sigma, three_digits, value};
use crate::calibration::further::{Constant, Further, constant_name};
use crate::imu::Term;
use crate::run::StateBlock;
use crate::run::record::TermRecord;
use crate::units::ARCSEC;

/// One constant, each number as it is shown.
pub(super) struct Row {
    /// Its block in words.
    pub title: &'static str,
    /// Whether it is the block's first.
    pub first: bool,
    /// The name that files use, such as `accel.second_order.x`.
    pub name: String,
    /// Its end, such as `x`.
    pub axis: String,
    pub value: String,
    pub sigma: String,
    pub unit: &'static str,
    pub prior: String,
    /// Posterior over prior σ.
    pub remaining: f64,
    /// Error, and error over σ, where the truth is known.
    pub error: Option<[String; 2]>,
}

/// A block in words.
pub(super) fn title(block: StateBlock) -> &'static str {
    match block {
        StateBlock::WanderingBias => "wandering biases",
        StateBlock::TableBase => "table level and north",
        StateBlock::TableAxes => "table axes",
        StateBlock::Term(Term::AccelSecondOrder) => "accel second order",
        StateBlock::Term(Term::AccelAsymmetry) => "accel asymmetry",
        StateBlock::Term(Term::SizeEffect) => "accel lever arm",
        StateBlock::Term(Term::TimeOffset) => "accel time offset",
        StateBlock::Term(Term::GSensitivity) => "gyro g-sensitivity",
    }
}

/// Name and value in SI of the unit that a block's constants are shown in.
pub(super) fn unit(block: StateBlock) -> (&'static str, f64) {
    match block {
        StateBlock::Term(term) => term.unit(),
        StateBlock::TableBase | StateBlock::TableAxes | StateBlock::WanderingBias => ("″", ARCSEC),
    }
}

/// Every constant that was estimated.
pub(super) fn rows(further: &Further, truth: &BTreeMap<String, TermRecord>) -> Vec<Row> {
    let posterior = further.sigma();
    let mut last = None;
    let mut row = |k: usize| {
        let (block, name) = (Constant::of(k)?.block(), constant_name(k)?);
        let (unit, in_si) = unit(block);
        let prior = further.prior_sigma[k];
        let axis = name.rsplit('.').next().filter(|end| *end != "time_offset");
        Some(Row {
            title: title(block),
            first: last.replace(block) != Some(block),
            axis: axis.unwrap_or_default().replace('_', " "),
            value: value(further.values[k] / in_si, posterior[k] / in_si),
            sigma: sigma(posterior[k] / in_si),
            unit,
            prior: three_digits(prior / in_si),
            remaining: posterior[k] / prior,
            error: truth.get(&name).map(|truth| {
                let error = further.values[k] - truth.value;
                [
                    value(error / in_si, posterior[k] / in_si),
                    value(error / posterior[k], 1.0),
                ]
            }),
            name,
        })
    };
    further.estimated().filter_map(&mut row).collect()
}
