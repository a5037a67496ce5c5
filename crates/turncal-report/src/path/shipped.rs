//! Comparison of a designed path with the embedded paths in the same time.

use crate::prelude::*;
use turncal::calibration::{Estimate, Terms};
use turncal::study::design::{Design, Shipped};

/// The designed path, then every other path: without the error terms that may be absent, then with all of them.
pub fn tables(design: &Design) -> Vec<Table> {
    let heading = "Expected 1σ in the same time";
    let mut tables = vec![table(design, Terms::None, heading)];
    if design.expected.all.is_some() {
        let heading = format!("{heading}, if every error term has its typical magnitude");
        tables.push(table(design, Terms::All, &heading));
    }
    tables
}

fn table(design: &Design, terms: Terms, heading: &str) -> Table {
    let row = |name: &str, factor: String, estimate: Option<&Estimate>| {
        let mut row = vec![name.to_owned(), factor];
        row.extend(Group::all().map(|group| or_dash(rms(group, estimate), three_digits)));
        row
    };
    let others = design.shipped.iter().map(|of| {
        let factor = of.expected.as_ref().map(|_| of.factor);
        row(of.name, or_dash(factor, three_digits), other(of, terms))
    });
    let designed = row("this path", "1.00".to_owned(), design.expected.of(terms));
    let titles = Group::all().map(|group| format!("{}, {}", group.short(), group.unit()));
    Table::new(heading, cells!["path", "dwells ×"].into_iter().chain(titles))
        .section(std::iter::once(designed).chain(others))
        .note(
            "Dwells ×: factor by which all dwells of an embedded path were scaled so that the path takes the same \
             time. Dash: the moves of the path alone take too long. six-position: the positions of Zhao, Jiang, Li \
             2016.",
        )
}

/// σ of the designed path and, by name, the dwell factor and the σ of every other path.
pub fn data(design: &Design) -> Value {
    let every_term = design.expected.all.as_ref();
    json!({
        "without_terms": with_terms(design, Terms::None),
        "every_term_of_usual_size": every_term.map(|_| with_terms(design, Terms::All)),
    })
}

fn with_terms(design: &Design, terms: Terms) -> Value {
    let sigma = |estimate: Option<&Estimate>| {
        let sigma = Group::all().map(|group| (group.key(), rms(group, estimate).into()));
        sigma.collect::<Map<String, Value>>()
    };
    let one = |of: &Shipped| {
        let figures = json!({ "dwell_factor": of.factor, "sigma": sigma(other(of, terms)) });
        (of.name.to_owned(), figures)
    };
    let others: Map<String, Value> = design.shipped.iter().map(one).collect();
    json!({ "designed": sigma(design.expected.of(terms)), "embedded": others })
}

fn other(path: &Shipped, terms: Terms) -> Option<&Estimate> {
    path.expected.as_ref()?.of(terms)
}

fn rms(group: Group, estimate: Option<&Estimate>) -> Option<f64> {
    let estimate = estimate?;
    group.rms(&estimate.sigma(), estimate)
}
