//! How auxiliary parameters, those beside the parameters of the triads, are spoken of.

use std::collections::BTreeMap;

use crate::calibration::result::TermRecord;
use crate::calibration::{Auxiliary, AuxiliaryKind, ErrorTerm, OBSERVED_BELOW, auxiliary_name};
use crate::report::prelude::*;
use crate::turntable::AxisError;
use crate::units::ARCSEC;

/// An error term in words.
pub(super) fn title(block: ErrorTerm) -> &'static str {
    match block {
        ErrorTerm::GaussMarkovBias => "Gauss–Markov biases",
        ErrorTerm::TableBase => "table level and north",
        ErrorTerm::TableAxes(AxisError::Tilt) => "table axes",
        ErrorTerm::TableAxes(AxisError::Wobble) => "table wobble",
        ErrorTerm::TableAxes(AxisError::Encoder) => "table encoders",
        ErrorTerm::Instrument(term) => term.entry().title,
    }
}

/// Symbol and SI value of the unit that its parameters are shown in.
pub(super) fn unit(block: ErrorTerm) -> (&'static str, f64) {
    match block {
        ErrorTerm::Instrument(term) => term.entry().unit,
        ErrorTerm::TableBase | ErrorTerm::TableAxes(_) | ErrorTerm::GaussMarkovBias => {
            ("″", ARCSEC)
        }
    }
}

/// Rows of the table of parameters; errors where `errors` asks for them and the truth states them.
pub(super) fn rows(
    auxiliary: &Auxiliary,
    truth: &BTreeMap<String, TermRecord>,
    errors: bool,
) -> Vec<Vec<String>> {
    let posterior = auxiliary.sigma();
    let row = |k: usize| {
        let (name, (unit, in_si)) = (auxiliary_name(k)?, unit(AuxiliaryKind::of(k)?.error_term()));
        let (of, own, prior) = (auxiliary.values[k], posterior[k], auxiliary.prior_sigma[k]);
        let truth = truth.get(&name).map(|truth| of - truth.value);
        let mut row = vec![
            name,
            plus_minus(of / in_si, own / in_si),
            unit.to_owned(),
            three_digits(prior / in_si),
            improvement(prior, own),
        ];
        if errors {
            row.extend(truth.map_or([NONE; 2].map(str::to_owned), |error| {
                [value(error / in_si, own / in_si), value(error / own, 0.1)]
            }));
        }
        Some(row)
    };
    auxiliary.estimated().filter_map(row).collect()
}

/// Prior over posterior σ, with words where the data did not observe the parameter.
pub(super) fn improvement(prior: f64, posterior: f64) -> String {
    let ratio = prior / posterior;
    if !ratio.is_finite() {
        NONE.to_owned()
    } else if ratio * OBSERVED_BELOW < 1.0 {
        format!("{}, not observed", value(ratio, 0.1))
    } else {
        three_digits(ratio)
    }
}
