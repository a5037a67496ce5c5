//! Names of auxiliary parameters, in addition to those of the triads.

use std::collections::BTreeMap;

use crate::prelude::*;
use turncal::calibration::result::TermRecord;
use turncal::calibration::{
    Auxiliary, AuxiliaryKind, ErrorTerm, ErrorTermTest, OBSERVED_BELOW, auxiliary_name,
};
use turncal::turntable::AxisError;

/// An error term in words.
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

/// Rows of the parameter table; with errors if requested by `errors` and stated in the truth.
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

/// A row of the table of parameters: a value with its σ, which is zero if it is fixed; the ratio of prior to posterior
/// σ; and, in a table with errors, its error if known.
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

/// Prior σ divided by posterior σ, with a note if the parameter was not observed.
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

/// Effect of the terms that were on or are significant.
pub fn explained(effects: &[ErrorTermTest]) -> Table {
    let row = |effect: &ErrorTermTest| {
        cells![
            title(effect.term),
            if effect.on { "on" } else { "off" },
            nis(effect),
            three_digits(effect.gain),
            format!("< {}", three_digits(effect.limit)),
            if effect.significant() { "yes" } else { "no" },
            growth(effect),
        ]
    };
    let shown = |on| {
        effects
            .iter()
            .filter(move |e| e.on == on && (e.on || e.significant()))
    };
    Table::new("Effect of each error term", columns("term | | NIS | cost falls by | by chance | significant | σ grows"))
        .sections([shown(true).map(row), shown(false).map(row)])
        .note(
            "NIS of all observations without → with the term. Cost: −2 ln of likelihood and prior. By chance: limit \
             of the fall by chance, at a total false-alarm rate of 1 in 1000 runs.",
        )
        .note(
            "σ grows: σ with the term divided by σ without it, RMS over the parameters of the group where it is largest.",
        )
        .note("Terms that are off are tested with their usual σ and shown if significant.")
}

/// The group whose σ grows most.
fn growth(effect: &ErrorTermTest) -> String {
    let groups = Group::all().zip(effect.sigma_factors);
    let known = groups.filter_map(|(group, factor)| Some((group, factor?)));
    let largest = known.max_by(|a, b| a.1.total_cmp(&b.1));
    largest.map_or(NONE.to_owned(), |(group, factor)| {
        format!("{}: {}", group.short(), value(factor, 0.1))
    })
}

fn nis(effect: &ErrorTermTest) -> String {
    let digits = |nis: f64| {
        if nis < 10.0 {
            value(nis, 0.01)
        } else {
            three_digits(nis)
        }
    };
    format!("{} → {}", digits(effect.without), digits(effect.with))
}
