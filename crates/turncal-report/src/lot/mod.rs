//! Report that compares calibrations: every parameter, mean and spread, outliers, differences from a truth, and limits.

mod data;
mod figures;
mod shown;
mod tables;
#[cfg(test)]
mod tests;

use crate::prelude::*;
use turncal::lot::Lot;

/// The complete report that compares calibrations.
pub fn document(lot: &Lot) -> Document {
    let is_single = lot.rows.len() == 1 && lot.truth.is_none();
    let mut document = Document::new(match (&lot.rows[..], &lot.truth) {
        ([row], None) => row.unit.name.clone(),
        ([row], Some(truth)) => format!("{} and {}", row.unit.name, truth.unit.name),
        (rows, _) => format!("Comparison of {} calibrations", count(rows.len())),
    });
    document.verdict = shown::verdict(lot);
    document.lead = vec![format!(
        "General form, body frame: {}. Scale factors are deviations from nominal. Every σ is 1σ.",
        lot.body_frame.words()
    )];
    let failures = lot.failures();
    let failures = failures.map(|(unit, reason)| format!("{}: {reason}", unit.name));
    let without = lot.without_magnetometer();
    let without = without.map(|(unit, reason)| {
        format!(
            "{}: {reason}; turncal compared the other values.",
            unit.name
        )
    });
    document.warnings.items = failures.chain(without).collect();
    document.both(tables::limits(lot));
    if !is_single {
        document.both(tables::units(lot));
        document.page(figures::values(lot));
        document.both(tables::quantities(lot));
    }
    document.data = data::data(lot);
    document.files = vec![("lot.csv".to_owned(), data::csv(&document.data))];
    document
}
