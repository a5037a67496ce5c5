//! σ of embedded paths in the time of a designed path.

use crate::prelude::*;
use turncal::calibration::Estimate;
use turncal::study::design::Shipped;

/// The designed path, then every other path; empty without others.
pub fn table(designed: &Estimate, shipped: &[Shipped]) -> Table {
    let row = |name: &str, factor: String, estimate: Option<&Estimate>| {
        let mut row = vec![name.to_owned(), factor];
        row.extend(Group::all().map(|group| or_dash(rms(group, estimate), three_digits)));
        row
    };
    let others = shipped.iter().map(|of| {
        let factor = of.estimate.as_ref().map(|_| three_digits(of.factor));
        let factor = factor.unwrap_or_else(|| NONE.to_owned());
        row(of.name, factor, of.estimate.as_ref())
    });
    let designed = row("this path", "1.00".to_owned(), Some(designed));
    let rows = std::iter::once(designed).chain(others);
    let titles = Group::all().map(|group| format!("{}, {}", group.short(), group.unit()));
    let table = Table::new(
        "Expected 1σ of embedded paths in the same time",
        cells!["path", "dwells ×"].into_iter().chain(titles),
    )
    .note(
        "Dwells ×: factor of all dwells of an embedded path, so that it takes the same time. A dash: its moves alone \
         need too much of this time. six-position: the positions of Zhao, Jiang, Li 2016.",
    );
    if shipped.is_empty() {
        table
    } else {
        table.section(rows)
    }
}

/// Factor of the dwells and σ of every path by name.
pub fn data(shipped: &[Shipped]) -> Value {
    let one = |of: &Shipped| {
        let estimate = of.estimate.as_ref();
        let sigma = Group::all().map(|group| (group.key(), rms(group, estimate).into()));
        let sigma: Map<String, Value> = sigma.collect();
        (
            of.name.to_owned(),
            json!({ "dwell_factor": of.factor, "sigma": sigma }),
        )
    };
    Value::Object(shipped.iter().map(one).collect())
}

fn rms(group: Group, estimate: Option<&Estimate>) -> Option<f64> {
    let estimate = estimate?;
    group.rms(&estimate.sigma(), estimate)
}
