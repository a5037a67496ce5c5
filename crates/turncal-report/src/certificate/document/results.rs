//! The table of results.

use crate::certificate::{Certificate, Measured, Quantity, in_words};
use crate::prelude::*;
use turncal::calibration::Group;
use turncal::imu::{Sensor, Term};

/// A value and its U, rounded as EA-4/02, 6.3, requires: U to two digits, and the value to the same decimal place.
pub fn two_digits(of: f64, expanded: f64) -> (f64, f64) {
    let place = 10f64.powf((expanded.log10() - 1.0).floor());
    if place > 1.0 {
        (
            (of / place).round() * place,
            (expanded / place).round() * place,
        )
    } else {
        (of, expanded)
    }
}

/// Every parameter with its expanded uncertainty, and the definitions of parameter and uncertainty.
pub fn results(certificate: &Certificate) -> Table {
    let has_budget = certificate.calibration.budget.is_some();
    let row = |of: &Measured| {
        // Only a budget gives degrees of freedom, and only for parameters of the triads.
        let infinite = match of.quantity {
            Quantity::Parameters(_) if has_budget => "∞",
            _ => NONE,
        };
        let (unit, size) = of.quantity.unit();
        let (value_of, expanded) = two_digits(of.value / size, of.expanded / size);
        cells![
            in_words(&of.name),
            plus_minus(value_of, expanded),
            unit,
            value(of.coverage_factor, 0.1),
            of.degrees_of_freedom.map_or(infinite.to_owned(), sigma),
        ]
    };
    let groups = Group::all().map(|group| {
        let of_group = certificate
            .results
            .iter()
            .filter(move |of| of.quantity == Quantity::Parameters(group));
        of_group.map(row).collect::<Vec<_>>()
    });
    let terms = Term::ALL.map(|term| {
        let all = certificate.terms.iter();
        let of_term = all.filter(move |of| of.quantity == Quantity::Term(term));
        of_term.map(row).collect::<Vec<_>>()
    });
    let budget = if has_budget {
        ", and calibration.json contains the uncertainty budget of the results"
    } else {
        ""
    };
    let table = Table::new("Results", columns("parameter | value ± U | unit | k | ν"))
        .sections(groups)
        .sections(terms)
        .note(format!(
            "Scale factor: deviation from nominal (gyroscopes {}; accelerometers {}). Misalignment: entries of the \
             installation matrix by row and column.",
            nominal(certificate, Sensor::Gyro, "rad/s"),
            nominal(certificate, Sensor::Accel, "m/s²"),
        ))
        .note(format!(
            "U: expanded uncertainty, the standard uncertainty times the coverage factor k for a coverage probability \
             of 95.45 % (JCGM 100); ν: effective degrees of freedom (– if not evaluated). The results are correlated; \
             both attached files contain the covariance matrix of scale factors, misalignments and biases{budget}.",
        ));
    if certificate.terms.is_empty() {
        table
    } else {
        table.note(of_terms(certificate))
    }
}

/// The nominal scale factors of a triad, with their unit.
fn nominal(certificate: &Certificate, sensor: Sensor, input: &str) -> String {
    let unit = certificate.calibration.unit.as_ref();
    let unit = unit.map_or("output", |unit| unit.get(sensor).as_str());
    nominal_scale(*certificate.provenance.nominal.get(sensor), unit, input)
}

/// Input added to the model by the error terms with results.
fn of_terms(certificate: &Certificate) -> String {
    let has = |term: &Term| {
        let mut all = certificate.terms.iter();
        all.any(|of| of.quantity == Quantity::Term(*term))
    };
    let words = |term: Term| format!("{} adds {}", term.name(), term.entry().adds);
    let all: Vec<String> = Term::ALL.into_iter().filter(has).map(words).collect();
    format!(
        "Error terms (their sum is t in the model): {}. f: specific force; w: angular rate; q: the parameter.",
        all.join("; ")
    )
}
