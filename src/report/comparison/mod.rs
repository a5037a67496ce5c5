//! The report of calibrations side by side.

mod data;
mod figure;

use super::terms::unit;
use crate::calibration::result::TermRecord;
use crate::calibration::{
    AUXILIARY, AuxiliaryKind, Canonical, ChiSquare, Comparison, Nees, ParameterVector, Side,
    auxiliary_name,
};
use crate::imu::{InstallationForm, Sensor};
use crate::report::prelude::*;

/// Beyond this many σ a difference is flagged.
const FLAGGED: f64 = 3.0;

/// Everything that is said of a comparison.
pub fn document(comparison: &Comparison) -> Document {
    let mut document = Document::new("Comparison of calibrations");
    let reference = match comparison.against_truth {
        true => "the truth",
        false => "the first calibration",
    };
    document.lead = vec![format!(
        "General form, body frame: {}. Reference: {}, {reference}.",
        comparison.body_frame.words(),
        comparison.reference.name
    )];
    document.warnings.items = std::iter::once(&comparison.reference)
        .chain(comparison.sides.iter().map(|side| &side.calibration))
        .filter(|calibration| !calibration.converged)
        .map(|calibration| format!("{} did not converge: its σ mean nothing.", calibration.name))
        .collect();
    document.page(figure::figure(comparison));
    document.both(parameters(comparison));
    document.both(groups(comparison));
    document.both(auxiliary(comparison));
    document.both(scatter(comparison));
    document.data = data::data(comparison);
    document
}

fn name(index: usize) -> String {
    short_name(InstallationForm::General, index)
}

/// Rows of each triad.
fn by_triad(rows: impl Fn(Group) -> Vec<Vec<String>>) -> [Vec<Vec<String>>; 2] {
    Sensor::ALL.map(|sensor| {
        let groups = Group::all().filter(|group| group.sensor() == sensor);
        groups.flat_map(&rows).collect()
    })
}

/// The reference's and for each calibration two columns.
fn beside_reference(comparison: &Comparison) -> Vec<String> {
    let mut columns = cells!["", comparison.reference.name.as_str(), "unit"];
    for side in &comparison.sides {
        columns.extend([side.calibration.name.clone(), "z".to_owned()]);
    }
    columns
}

fn flagged(z: Option<f64>) -> String {
    or_dash(z, |z| {
        let flag = if z.abs() > FLAGGED { "! " } else { "" };
        format!("{flag}{}", value(z, 1.0))
    })
}

fn parameters(comparison: &Comparison) -> Table {
    let row = |index: usize| {
        let group = Group::of(index);
        let mut row = cells![
            name(index),
            reference_value(comparison, index),
            group.unit()
        ];
        for side in &comparison.sides {
            let own = side.calibration.sigma().map(|s| s[index]);
            let finest = finest(comparison, &[index]);
            row.push(with_sigma(
                side.difference[index],
                own,
                finest,
                group.unit_value(),
            ));
            row.push(flagged(side.z(index)));
        }
        row
    };
    let sections = by_triad(|group| {
        group
            .among(&comparison.parameters)
            .into_iter()
            .map(row)
            .collect()
    });
    let table = Table::new("Parameters", beside_reference(comparison))
        .sections(sections)
        .note("Calibrations: difference to the reference ± the 1σ that the calibration claims.")
        .note("K of the reference is in the file's quantity.")
        .note(format!(
            "z: difference in σ of the difference, ! beyond {FLAGGED}."
        ));
    match comparison.against_truth {
        true => table,
        false => table.note("z and NEES hold if the calibrations come of different data."),
    }
}

/// The smallest σ that any calibration claims for some parameters: what is finer means nothing.
fn finest(comparison: &Comparison, indices: &[usize]) -> Option<f64> {
    std::iter::once(&comparison.reference)
        .chain(comparison.sides.iter().map(|side| &side.calibration))
        .filter_map(|calibration| calibration.sigma())
        .flat_map(|sigma| indices.iter().map(move |&index| sigma[index]))
        .filter(|sigma| *sigma > 0.0)
        .reduce(f64::min)
}

/// The reference's own value; scale factors in the file's quantity.
fn reference_value(comparison: &Comparison, index: usize) -> String {
    let own = comparison.reference.sigma().map(|s| s[index]);
    let (size, unit) = match comparison.scale_factor(index) {
        Some(nominal) => (nominal, 1.0 / nominal.abs()),
        None => {
            let unit = Group::of(index).unit_value();
            (comparison.reference.vector()[index] / unit, unit)
        }
    };
    match (own.filter(|own| *own > 0.0), finest(comparison, &[index])) {
        (None, None) => value(size, size.abs() * 1e-6),
        (own, finest) => with_sigma(size * unit, own, finest, unit),
    }
}

/// A number in a unit with its own σ, else with the digits of the finest.
fn with_sigma(of: f64, own: Option<f64>, finest: Option<f64>, unit: f64) -> String {
    match (own.filter(|own| *own > 0.0), finest) {
        (Some(own), _) => plus_minus(of / unit, own / unit),
        (None, Some(finest)) => value(of / unit, finest / unit),
        (None, None) => three_digits(of / unit),
    }
}

fn groups(comparison: &Comparison) -> Table {
    let mut columns = vec![String::new(), "unit".to_owned()];
    for side in &comparison.sides {
        let largest = format!("{}: largest", side.calibration.name);
        columns.extend(cells![largest, "RMS", "RMS σ"]);
    }
    let row = |group: Group| {
        let indices = group.among(&comparison.parameters);
        let spread = |v: &ParameterVector| group.spread(v, &indices);
        let mut row = cells![group.title(), group.unit()];
        let finest = finest(comparison, &indices).map(|s| s / group.unit_value());
        let shown = |x: f64| finest.map_or_else(|| three_digits(x), |finest| value(x, finest));
        for side in &comparison.sides {
            let difference = spread(&side.difference);
            row.push(or_dash(difference.map(|x| x.0), shown));
            row.push(or_dash(difference.map(|x| x.1), shown));
            let own = side.calibration.sigma().and_then(|s| spread(&s));
            row.push(or_dash(own.map(|x| x.1).filter(|s| *s > 0.0), sigma));
        }
        vec![row]
    };
    let mut last = cells!["NEES/n", ""];
    last.extend(comparison.sides.iter().flat_map(|side| nees(side.nees)));
    Table::new("Groups", columns)
        .sections(by_triad(row))
        .section([last])
        .note("Largest and RMS: of the differences to the reference. RMS σ: of the claimed 1σ.")
        .note("NEES/n, its 95 % interval and n: one if the σ are true, correlations included.")
}

fn nees(nees: Option<Nees>) -> [String; 3] {
    nees.map_or([NONE; 3].map(str::to_owned), |nees| {
        let (low, high) = nees.interval;
        [
            value(nees.mean, 0.1),
            format!("{}…{}", value(low, 0.1), value(high, 0.1)),
            format!("n = {}", nees.count),
        ]
    })
}

/// Auxiliary parameters that any calibration has.
fn auxiliary(comparison: &Comparison) -> Table {
    fn of<'a>(calibration: &'a Canonical, name: &str) -> Option<&'a TermRecord> {
        calibration.constants.get(name)
    }
    let shown = |of: Option<&TermRecord>, unit| {
        of.map_or(NONE.to_owned(), |of| {
            with_sigma(of.value, of.sigma, None, unit)
        })
    };
    let row = |index: usize| {
        let name = auxiliary_name(index)?;
        let (symbol, unit) = unit(AuxiliaryKind::of(index)?.error_term());
        let reference = of(&comparison.reference, &name);
        let mut row = cells![name.as_str(), shown(reference, unit), symbol];
        let mut any = reference.is_some();
        for Side { calibration, .. } in &comparison.sides {
            let side = of(calibration, &name);
            let z = side.zip(reference).and_then(|(side, reference)| {
                let sigma = side.sigma?.hypot(reference.sigma.unwrap_or(0.0));
                (sigma > 0.0).then(|| (side.value - reference.value) / sigma)
            });
            row.extend([shown(side, unit), flagged(z)]);
            any |= side.is_some();
        }
        any.then_some(row)
    };
    Table::new("Auxiliary parameters", beside_reference(comparison))
        .section((0..AUXILIARY).filter_map(row))
        .note(
            "Error terms of instrument and table: values ± the 1σ that each calibration claims; z: \
             difference to the reference in its σ, where both have it.",
        )
}

/// From three calibrations on.
fn scatter(comparison: &Comparison) -> Table {
    let table = Table::new(
        "Scatter",
        columns("| unit | mean minus reference | scatter | χ²/n | n | p"),
    );
    let Some(scatter) = &comparison.scatter else {
        return table;
    };
    let rows = |group: Group| {
        let of_group = scatter
            .parameters
            .iter()
            .filter(|p| Group::of(p.index) == group);
        let row = of_group.map(|p| {
            let unit = group.unit_value();
            let finest = finest(comparison, &[p.index]);
            let mean = with_sigma(p.mean, p.mean_sigma, None, unit);
            let deviation = with_sigma(p.deviation, None, finest, unit);
            let mut row = cells![name(p.index), group.unit(), mean, deviation];
            row.extend(chi_square(p.chi_square));
            row
        });
        row.collect()
    };
    let mut all = cells!["all", "", "", ""];
    all.extend(chi_square(scatter.joint));
    table
        .sections(by_triad(rows))
        .section([all])
        .note("Mean weighted by the claimed σ, ± its 1σ; scatter: sample standard deviation.")
        .note(
            "χ² of the scatter against the claimed σ, n its degrees of freedom; p: probability of as much or \
             more. Near 0 the σ are too small, near 1 too large.",
        )
        .note("All: with correlations, over the calibrations that give them.")
}

fn chi_square(chi_square: Option<ChiSquare>) -> [String; 3] {
    chi_square.map_or([NONE; 3].map(str::to_owned), |of| {
        let p = if of.p < 1e-4 {
            "< 0.0001".to_owned()
        } else {
            value(of.p, 0.01)
        };
        [
            value(of.value / of.freedom as f64, 0.1),
            count(of.freedom),
            p,
        ]
    })
}
