//! Auxiliary parameters, in addition to those of the triads, and the evidence for each error term.

use std::collections::BTreeMap;

use crate::prelude::*;
use turncal::calibration::result::TermRecord;
use turncal::calibration::{
    Auxiliary, AuxiliaryKind, ErrorTerm, OBSERVED_BELOW, TermEvidence, auxiliary_name,
};
use turncal::turntable::AxisError;

/// The name of an error term in words.
pub fn title(block: ErrorTerm) -> &'static str {
    match block {
        ErrorTerm::GaussMarkovBias => "Gauss–Markov biases",
        ErrorTerm::TableBase => "table level and north",
        ErrorTerm::TableAxes(AxisError::Tilt) => "table axes",
        ErrorTerm::TableAxes(AxisError::Wobble) => "table wobble",
        ErrorTerm::TableAxes(AxisError::Encoder) => "table encoders",
        ErrorTerm::Instrument(term) => term.entry().title,
    }
}

/// Symbol and SI value of the display unit of its parameters.
pub fn unit(block: ErrorTerm) -> (&'static str, f64) {
    match block {
        ErrorTerm::Instrument(term) => term.entry().unit,
        ErrorTerm::TableBase | ErrorTerm::TableAxes(_) | ErrorTerm::GaussMarkovBias => {
            ("″", ARCSEC)
        }
    }
}

/// Rows of the parameter table; the errors are included if `errors` is true and the truth states them.
pub fn rows(
    auxiliary: &Auxiliary,
    truth: &BTreeMap<String, TermRecord>,
    errors: bool,
) -> Vec<Vec<String>> {
    let posterior = auxiliary.sigma();
    let row = |k: usize| {
        let (name, (unit, in_si)) = (auxiliary_name(k)?, unit(AuxiliaryKind::of(k)?.error_term()));
        let (of, own, prior) = (auxiliary.values[k], posterior[k], auxiliary.prior_sigma[k]);
        let error = truth.get(&name).map(|truth| (of - truth.value) / in_si);
        let error = errors.then_some(error);
        Some(parameter_row(
            name,
            unit,
            [of, own].map(|x| x / in_si),
            Some(prior / in_si),
            error,
        ))
    };
    auxiliary.estimated().filter_map(row).collect()
}

/// A row of the parameter table: a value with its σ (zero if the value is fixed), the ratio of prior to posterior σ
/// and, in a table with errors, the error if it is known.
pub fn parameter_row(
    name: String,
    unit: &str,
    [of, own]: [f64; 2],
    prior: Option<f64>,
    error: Option<Option<f64>>,
) -> Vec<String> {
    let fixed = own <= 0.0;
    let shown = if fixed {
        format!("{} (fixed)", value(of, own))
    } else {
        plus_minus(of, own)
    };
    let mut row = cells![name, shown, unit];
    row.extend(prior.iter().flat_map(|prior| {
        if fixed {
            [NONE; 2].map(str::to_owned)
        } else {
            [three_digits(*prior), improvement(*prior, own)]
        }
    }));
    row.extend(error.iter().flat_map(|error| {
        let in_sigma = error.filter(|_| !fixed).map(|error| error / own);
        [
            or_dash(*error, |error| value(error, own)),
            or_dash(in_sigma, |z| value(z, 0.1)),
        ]
    }));
    row
}

/// Prior σ divided by posterior σ; a note is added if the parameter was not observed.
pub fn improvement(prior: f64, posterior: f64) -> String {
    let ratio = prior / posterior;
    if !ratio.is_finite() {
        NONE.to_owned()
    } else if ratio * OBSERVED_BELOW < 1.0 {
        format!("{}, not observed", value(ratio, 0.1))
    } else {
        three_digits(ratio)
    }
}

/// Above this probability, a term counts as present.
const CERTAIN: f64 = 0.999;
/// Smallest growth of σ that three digits show.
const GROWN: f64 = 1.005;

/// Every error term that was estimated or may be present.
pub fn explained(all: &[TermEvidence]) -> Table {
    let row = |of: &TermEvidence| {
        cells![
            title(of.term),
            presence(of.present),
            growth(of),
            visibility(of)
        ]
    };
    let is_estimated = |of: &&TermEvidence| of.present == 1.0;
    let (estimated, others): (Vec<_>, Vec<_>) = all.iter().partition(is_estimated);
    let rows = [estimated, others].map(|terms| terms.into_iter().map(row));
    Table::new(
        "Evidence for each error term",
        columns("term | present | σ ratio | shown by this path"),
    )
    .sections(rows)
    .note(
        "Present: probability that the instrument or the table has this error; “estimated” if the term was requested \
         or stated. Values and σ are averaged over the models with and without each term, weighted by these \
         probabilities.",
    )
    .note(
        "σ ratio: σ with the term divided by σ without it, RMS over the parameters of the group with the largest \
         ratio.",
    )
    .note(
        "Shown by this path: whether the recording reduces the σ of every parameter of the term to less than half; if \
         not, the moves or dwells to add.",
    )
}

/// The probability that a term is present.
fn presence(present: f64) -> String {
    if present == 1.0 {
        "estimated".to_owned()
    } else if present > CERTAIN {
        "> 99.9 %".to_owned()
    } else if present < 1.0 - CERTAIN {
        "< 0.1 %".to_owned()
    } else {
        // Two digits, and one decimal near 100 %.
        let percent = 100.0 * present;
        let shown = value(percent, percent.min(10.0 * (100.0 - percent)));
        format!("{shown} %")
    }
}

/// The group whose σ grows most; a dash if no σ grows visibly.
fn growth(of: &TermEvidence) -> String {
    let groups = Group::all().zip(of.sigma_factors);
    let grown = groups.filter_map(|(group, factor)| Some((group, factor?)));
    let grown = grown.filter(|(_, factor)| *factor >= GROWN);
    let largest = grown.max_by(|a, b| a.1.total_cmp(&b.1));
    largest.map_or(NONE.to_owned(), |(group, factor)| {
        format!("{} × {}", group.short(), three_digits(factor))
    })
}

/// Whether the path shows a term; if not, the moves or dwells that do.
fn visibility(of: &TermEvidence) -> String {
    if of.remaining > OBSERVED_BELOW {
        format!("no: {}", of.term.shown_by())
    } else {
        "yes".to_owned()
    }
}
