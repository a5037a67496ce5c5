//! σ of embedded paths in the time of a designed path.

use crate::prelude::*;
use turncal::calibration::Estimate;
use turncal::study::design::{Design, Shipped};

/// The designed path, then every other path.
pub fn table(design: &Design) -> Table {
    let row = |name: &str, factor: String, estimate: Option<&Estimate>| {
        let mut row = vec![name.to_owned(), factor];
        row.extend(Group::all().map(|group| or_dash(rms(group, estimate), three_digits)));
        row
    };
    let others = design.shipped.iter().map(|of| {
        let factor = of.estimate.as_ref().map(|_| of.factor);
        row(of.name, or_dash(factor, three_digits), of.estimate.as_ref())
    });
    let designed = row("this path", "1.00".to_owned(), Some(&design.estimate));
    let titles = Group::all().map(|group| format!("{}, {}", group.short(), group.unit()));
    let heading = if design.study.options.auto_terms {
        "Expected 1σ in the same time, if every error term may have its usual size"
    } else {
        "Expected 1σ in the same time"
    };
    Table::new(heading, cells!["path", "dwells ×"].into_iter().chain(titles))
        .section(std::iter::once(designed).chain(others))
        .note(
            "Dwells ×: factor of all dwells of an embedded path, so that it takes the same time. A dash: its moves \
             alone need too much of this time. six-position: the positions of Zhao, Jiang, Li 2016.",
        )
}

/// σ of the designed path, and factor of the dwells and σ of every other path by name.
pub fn data(design: &Design) -> Value {
    let sigma = |estimate: Option<&Estimate>| {
        let sigma = Group::all().map(|group| (group.key(), rms(group, estimate).into()));
        sigma.collect::<Map<String, Value>>()
    };
    let one = |of: &Shipped| {
        let figures = json!({ "dwell_factor": of.factor, "sigma": sigma(of.estimate.as_ref()) });
        (of.name.to_owned(), figures)
    };
    let others: Map<String, Value> = design.shipped.iter().map(one).collect();
    json!({
        "every_term_of_usual_size": design.study.options.auto_terms,
        "designed": sigma(Some(&design.estimate)),
        "embedded": others,
    })
}

fn rms(group: Group, estimate: Option<&Estimate>) -> Option<f64> {
    let estimate = estimate?;
    group.rms(&estimate.sigma(), estimate)
}
