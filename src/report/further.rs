//! How constants beside the parameters of the triads are spoken of.

use std::collections::BTreeMap;

use super::number::{sigma, three_digits, value};
use crate::calibration::ErrorTerm;
use crate::calibration::result::TermRecord;
use crate::calibration::{Auxiliary, AuxiliaryKind, auxiliary_name};
use crate::imu::Term;
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
pub(super) fn title(block: ErrorTerm) -> &'static str {
    match block {
        ErrorTerm::GaussMarkovBias => "wandering biases",
        ErrorTerm::TableBase => "table level and north",
        ErrorTerm::TableAxes => "table axes",
        ErrorTerm::Instrument(Term::AccelSecondOrder) => "accel second order",
        ErrorTerm::Instrument(Term::AccelAsymmetry) => "accel asymmetry",
        ErrorTerm::Instrument(Term::SizeEffect) => "accel lever arm",
        ErrorTerm::Instrument(Term::TimeOffset) => "accel time offset",
        ErrorTerm::Instrument(Term::GSensitivity) => "gyro g-sensitivity",
    }
}

/// Name and value in SI of the unit that a block's constants are shown in.
pub(super) fn unit(block: ErrorTerm) -> (&'static str, f64) {
    match block {
        ErrorTerm::Instrument(term) => term.unit(),
        ErrorTerm::TableBase | ErrorTerm::TableAxes | ErrorTerm::GaussMarkovBias => ("″", ARCSEC),
    }
}

/// Every constant that was estimated.
pub(super) fn rows(further: &Auxiliary, truth: &BTreeMap<String, TermRecord>) -> Vec<Row> {
    let posterior = further.sigma();
    let mut last = None;
    let mut row = |k: usize| {
        let (block, name) = (AuxiliaryKind::of(k)?.error_term(), auxiliary_name(k)?);
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
