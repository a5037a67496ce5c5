//! One-screen summary: accuracy and its main source, cross-validation, navigation error.

use super::super::{navigation, values};
use super::report::Report;
use super::{budget, tables};
use crate::prelude::*;
use turncal::calibration::{Estimate, ParameterVector};

/// Adds the one-screen summary.
pub fn add(document: &mut Document, report: &Report) {
    let Some(estimate) = report.estimate() else {
        return;
    };
    let values = values::table(report.calibration);
    document.brief.push(values.into());
    let magnetometer = values::magnetometer(report.calibration);
    document.brief.extend(magnetometer.map(Into::into));
    document.brief.push(accuracy(report, estimate).into());
    let navigated = report.navigation.ok().filter(|of| !of.is_empty());
    let mut facts = Facts::default();
    for (name, value) in [
        (
            "excluded from fit",
            report.quality.and_then(tables::cross_validation),
        ),
        ("navigation", navigated.map(navigation::line)),
    ] {
        if let Some(value) = value {
            facts.push(name, value);
        }
    }
    document.brief.push(facts.into());
}

/// RMS σ and error of each group, with the predicted σ and the largest source.
fn accuracy(report: &Report, estimate: &Estimate) -> Table {
    let closed_form = report.closed_form.map(|closed| closed.estimate);
    let both = report.outcome.and(closed_form);
    let truth = report.truth_vector();
    let mut columns = vec!["Accuracy (group RMS)", "1σ"];
    columns.extend(truth.map(|_| "error"));
    columns.extend(both.map(|_| "closed form 1σ"));
    columns.extend(both.and(truth).map(|_| "closed form error"));
    columns.extend(report.predicted.map(|_| "predicted 1σ"));
    columns.extend(report.budget.map(|_| "mostly from"));
    let row = |group: Group| {
        let with_unit = |value: Option<f64>| {
            or_dash(value, |value| format!("{} {}", sigma(value), group.unit()))
        };
        let mut row = vec![group.title()];
        for of in std::iter::once(estimate).chain(both) {
            let rms = |v: &ParameterVector| group.rms(v, of);
            row.push(with_unit(rms(&of.sigma())));
            row.extend(truth.map(|truth| with_unit(rms(&(of.vector() - truth)))));
        }
        row.extend(report.predicted.map(|predicted| {
            let of_group = predicted.sigma.iter().find(|(of, _)| *of == group);
            with_unit(of_group.and_then(|(_, sigma)| Some((*sigma)? / group.unit_value())))
        }));
        let source =
            |of| budget::largest(of, &group.estimated(estimate)).unwrap_or(NONE.to_owned());
        row.extend(report.budget.map(source));
        row
    };
    let mut table = Table::new("", columns).section(Group::all().map(row));
    // A narrow terminal omits the last columns, but first the error of the method that was not the subject.
    let (first, others): (Vec<_>, Vec<_>) =
        (2..table.columns.len()).partition(|column| table.columns[*column] == "closed form error");
    table.optional = [others, first].concat();
    table
}
