//! Constants beside the parameters of the triads, side by side.

use super::{Comparison, FLAGGED, NONE, Table};
use crate::calibration::Canonical;
use crate::calibration::{AUXILIARY, AuxiliaryKind, auxiliary_name};
use crate::report::further::unit;
use crate::report::number::{sigma, three_digits, value};
use crate::calibration::result::TermRecord;

/// The constants that any calibration has; none if none has any.
pub(super) fn table(comparison: &Comparison) -> Option<Table> {
    let sides = || comparison.sides.iter().map(|side| &side.calibration);
    let reference = &comparison.reference;
    let has = |name: &str| {
        std::iter::once(reference)
            .chain(sides())
            .any(|c| of(c, name).is_some())
    };
    let row = |index: usize| {
        let name = auxiliary_name(index)?;
        let (unit, in_si) = unit(AuxiliaryKind::of(index)?.error_term());
        has(&name).then(|| {
            let own = of(reference, &name);
            let mut row = vec![
                name.clone(),
                own.map_or(NONE.to_owned(), |own| shown(own.value, own.sigma, in_si)),
                unit.to_owned(),
            ];
            for side in sides() {
                row.extend(cells(own, of(side, &name), in_si));
            }
            row
        })
    };
    let rows: Vec<Vec<String>> = (0..AUXILIARY).filter_map(row).collect();
    let mut headings = vec![String::new(), reference.name.clone(), "unit".to_owned()];
    for side in sides() {
        headings.push(side.name.clone());
        headings.push("z".to_owned());
    }
    (!rows.is_empty()).then(|| Table {
        title: "Constants beside K, E and D",
        headings,
        sections: vec![rows],
        notes: vec![
            "Auxiliary terms and errors of the table: values ± the 1σ that each calibration claims; z: \
             difference to the reference in its σ, where both have it."
                .to_owned(),
        ],
    })
}

fn of<'a>(calibration: &'a Canonical, name: &str) -> Option<&'a TermRecord> {
    calibration.constants.get(name)
}

fn shown(of: f64, own: Option<f64>, unit: f64) -> String {
    match own {
        Some(own) => format!("{} ± {}", value(of / unit, own / unit), sigma(own / unit)),
        None => three_digits(of / unit),
    }
}

fn cells(reference: Option<&TermRecord>, side: Option<&TermRecord>, unit: f64) -> [String; 2] {
    let Some(side) = side else {
        return [NONE; 2].map(str::to_owned);
    };
    let z = reference.and_then(|reference| {
        let sigma = side.sigma?.hypot(reference.sigma.unwrap_or(0.0));
        (sigma > 0.0).then(|| (side.value - reference.value) / sigma)
    });
    let z = z.map_or(NONE.to_owned(), |z| {
        let flag = if z.abs() > FLAGGED { "! " } else { "" };
        format!("{flag}{}", value(z, 1.0))
    });
    [shown(side.value, side.sigma, unit), z]
}
