//! How auxiliary parameters, those beside the parameters of the triads, are spoken of.

use std::collections::BTreeMap;

use super::document::NONE;
use super::number::{plus_minus, three_digits, value};
use crate::calibration::further::{Constant, Further, constant_name};
use crate::calibration::outcome::OBSERVED_BELOW;
use crate::imu::Term;
use crate::run::StateBlock;
use crate::run::record::TermRecord;
use crate::units::ARCSEC;

/// An error term in words.
pub(super) fn title(block: StateBlock) -> &'static str {
    match block {
        StateBlock::WanderingBias => "Gauss–Markov biases",
        StateBlock::TableBase => "table level and north",
        StateBlock::TableAxes => "table axes",
        StateBlock::Term(Term::AccelSecondOrder) => "accel second order",
        StateBlock::Term(Term::AccelAsymmetry) => "accel asymmetry",
        StateBlock::Term(Term::SizeEffect) => "accel lever arm",
        StateBlock::Term(Term::TimeOffset) => "accel time offset",
        StateBlock::Term(Term::GSensitivity) => "gyro g-sensitivity",
    }
}

/// Symbol and SI value of the unit that its parameters are shown in.
pub(super) fn unit(block: StateBlock) -> (&'static str, f64) {
    match block {
        StateBlock::Term(term) => term.unit(),
        StateBlock::TableBase | StateBlock::TableAxes | StateBlock::WanderingBias => ("″", ARCSEC),
    }
}

/// Rows of the table of parameters; errors where `errors` asks for them and the truth states them.
pub(super) fn rows(
    further: &Further,
    truth: &BTreeMap<String, TermRecord>,
    errors: bool,
) -> Vec<Vec<String>> {
    let posterior = further.sigma();
    let row = |k: usize| {
        let (name, (unit, in_si)) = (constant_name(k)?, unit(Constant::of(k)?.block()));
        let (of, own, prior) = (further.values[k], posterior[k], further.prior_sigma[k]);
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
    further.estimated().filter_map(row).collect()
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
