//! A lot as rows: one for each quantity of each unit.

use super::shown::{shown, unit_key};
use crate::lot::{Lot, Quantity, Row, Verdict};

const HEADER: [&str; 9] = [
    "unit",
    "serial",
    "date",
    "quantity",
    "unit_of_value",
    "value",
    "sigma",
    "apart",
    "verdict",
];

/// As CSV. A unit without a calibration has one row without values.
pub(super) fn csv(lot: &Lot) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut write = |cells: &[String]| {
        // Memory takes it all.
        let _ = writer.write_record(cells);
    };
    write(&HEADER.map(str::to_owned));
    for (place, row) in lot.rows.iter().enumerate() {
        let meta = |key: &str| row.unit.meta.get(key).cloned().unwrap_or_default();
        let first = [row.unit.name.clone(), meta("serial"), meta("date")];
        if row.canonical.is_err() {
            let empty = std::iter::repeat_n(String::new(), HEADER.len() - first.len() - 1);
            let all = first.iter().cloned().chain(empty);
            write(&all.chain(["not calibrated".to_owned()]).collect::<Vec<_>>());
            continue;
        }
        for quantity in lot.statistics.iter().map(|of| of.quantity) {
            let Some(sample) = row.sample(quantity) else {
                continue;
            };
            let (value, sigma) = shown(quantity, sample);
            let apart = lot.outliers_of(place).any(|of| of.quantity == quantity);
            let rest = [
                quantity.name(),
                unit_key(quantity).to_owned(),
                value.to_string(),
                sigma.to_string(),
                apart.to_string(),
                verdict(row, quantity).map_or("", Verdict::name).to_owned(),
            ];
            write(&[&first[..], &rest].concat());
        }
    }
    String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
}

/// The verdict of the limit of a quantity.
pub(super) fn verdict(row: &Row, quantity: Quantity) -> Option<Verdict> {
    let of = row.checks.iter();
    let mut of = of.filter(|check| Quantity::Parameter(check.limit.parameter) == quantity);
    of.next().map(|check| check.verdict)
}
