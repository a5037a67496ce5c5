//! Calibrations side by side: the same tables for a terminal and for a page, and one figure.

mod constants;
mod figure;
mod page;

use std::path::Path;

use super::group::{Group, short_name};
use super::number::{count, sigma, three_digits, value};
use super::{ReportError, terminal, write_files};
use crate::calibration::ParameterVector;
use crate::calibration::{ChiSquare, Comparison, Nees, Side};
use crate::imu::{InstallationForm, Sensor};

/// Beyond this many σ a difference is flagged.
pub const FLAGGED: f64 = 3.0;

const NONE: &str = "–";

/// Cells in rows, the first of each naming it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// What it shows.
    pub title: &'static str,
    /// A heading for each column.
    pub headings: Vec<String>,
    /// Rows that belong together.
    pub sections: Vec<Vec<Vec<String>>>,
    /// How to read it, a sentence each.
    pub notes: Vec<String>,
}

/// The comparison as text: what is compared, what must be known of it, and the tables.
pub fn text(comparison: &Comparison) -> String {
    let mut text = summary(comparison) + "\n";
    for warning in warnings(comparison) {
        text.push_str(&format!("Warning: {warning}\n"));
    }
    for table in tables(comparison) {
        text.push('\n');
        text.push_str(&terminal::columns(&table));
    }
    text
}

/// What is compared with what, in a sentence or two.
pub fn summary(comparison: &Comparison) -> String {
    let frame = comparison.body_frame.words();
    let reference = &comparison.reference.name;
    let reference = if comparison.against_truth {
        format!("{reference}, the truth")
    } else {
        format!("{reference}, the first calibration")
    };
    format!("General form, body frame: {frame}. Reference: {reference}.")
}

/// What forbids to trust a calibration's σ, a sentence each.
pub fn warnings(comparison: &Comparison) -> Vec<String> {
    std::iter::once(&comparison.reference)
        .chain(comparison.sides.iter().map(|side| &side.calibration))
        .filter(|calibration| !calibration.converged)
        .map(|calibration| format!("{} did not converge: its σ mean nothing.", calibration.name))
        .collect()
}

/// All tables: parameters, groups, and from three calibrations on their scatter.
pub fn tables(comparison: &Comparison) -> Vec<Table> {
    let mut tables = vec![parameters(comparison), groups(comparison)];
    tables.extend(constants::table(comparison));
    tables.extend(scatter(comparison));
    tables
}

/// Writes `index.html`, which needs nothing else, and the figure as `differences.svg` into an existing
/// directory.
pub fn write(comparison: &Comparison, directory: &Path) -> Result<(), ReportError> {
    let figure = figure::figure(comparison)?;
    let page = page::page(comparison, &figure);
    write_files(directory, &page, &[figure])
}

/// Indices of the compared parameters of a group.
fn of_group(comparison: &Comparison, group: Group) -> Vec<usize> {
    let all = comparison.parameters.iter().copied();
    all.filter(|&index| Group::of(index) == group).collect()
}

fn name(index: usize) -> String {
    short_name(InstallationForm::General, index)
}

/// A table with a section for each triad.
fn by_triad(rows: impl Fn(Group) -> Vec<Vec<String>>) -> Vec<Vec<Vec<String>>> {
    let rows: Vec<(Sensor, Vec<Vec<String>>)> = Group::all()
        .map(|group| (group.sensor(), rows(group)))
        .collect();
    rows.chunk_by(|a, b| a.0 == b.0)
        .map(|triad| triad.iter().flat_map(|(_, rows)| rows.clone()).collect())
        .collect()
}

fn parameters(comparison: &Comparison) -> Table {
    let reference = &comparison.reference;
    let mut headings = vec![String::new(), reference.name.clone(), "unit".to_owned()];
    for side in &comparison.sides {
        headings.push(side.calibration.name.clone());
        headings.push("z".to_owned());
    }
    let sections = by_triad(|group| {
        let indices = of_group(comparison, group).into_iter();
        indices
            .map(|index| {
                let mut row = vec![
                    name(index),
                    reference_value(comparison, index),
                    group.unit().to_owned(),
                ];
                for side in &comparison.sides {
                    row.push(plus_minus(
                        side.difference[index],
                        side.calibration.sigma().map(|s| s[index]),
                        finest(comparison, &[index]),
                        group,
                    ));
                    row.push(z(side, index));
                }
                row
            })
            .collect()
    });
    let mut notes = vec![
        "Calibrations: difference to the reference ± the 1σ that the calibration claims."
            .to_owned(),
        "K of the reference is in the file's quantity.".to_owned(),
        format!("z: difference in σ of the difference, ! beyond {FLAGGED}."),
    ];
    if !comparison.against_truth {
        notes.push("z and NEES hold if the calibrations come of different data.".to_owned());
    }
    Table {
        title: "Parameters",
        headings,
        sections,
        notes,
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
    let group = Group::of(index);
    let own = comparison.reference.sigma().map(|s| s[index]);
    let (size, unit) = match comparison.scale_factor(index) {
        Some(nominal) => (nominal, 1.0 / nominal.abs()),
        None => (
            comparison.reference.vector()[index] / group.unit_value(),
            group.unit_value(),
        ),
    };
    match (own.filter(|own| *own > 0.0), finest(comparison, &[index])) {
        (Some(own), _) => format!("{} ± {}", value(size, own / unit), sigma(own / unit)),
        (None, Some(finest)) => value(size, finest / unit),
        (None, None) => value(size, size.abs() * 1e-6),
    }
}

fn plus_minus(difference: f64, own: Option<f64>, finest: Option<f64>, group: Group) -> String {
    let unit = group.unit_value();
    let shown = difference / unit;
    match (own.filter(|own| *own > 0.0), finest) {
        (Some(own), _) => format!("{} ± {}", value(shown, own / unit), sigma(own / unit)),
        (None, Some(finest)) => value(shown, finest / unit),
        (None, None) => three_digits(shown),
    }
}

fn z(side: &Side, index: usize) -> String {
    side.z(index).map_or(NONE.to_owned(), |z| {
        let flag = if z.abs() > FLAGGED { "! " } else { "" };
        format!("{flag}{}", value(z, 1.0))
    })
}

fn groups(comparison: &Comparison) -> Table {
    let mut headings = vec![String::new(), "unit".to_owned()];
    for side in &comparison.sides {
        let name = &side.calibration.name;
        headings.push(format!("{name}: largest"));
        headings.push("RMS".to_owned());
        headings.push("RMS σ".to_owned());
    }
    let mut sections = by_triad(|group| {
        let indices = of_group(comparison, group);
        let spread = |v: &ParameterVector| group.spread(v, &indices);
        let mut row = vec![group.title(), group.unit().to_owned()];
        let finest = finest(comparison, &indices).map(|s| s / group.unit_value());
        let shown = |x: f64| finest.map_or_else(|| three_digits(x), |finest| value(x, finest));
        for side in &comparison.sides {
            let cell = |x: Option<f64>| x.map_or(NONE.to_owned(), shown);
            let difference = spread(&side.difference);
            row.push(cell(difference.map(|x| x.0)));
            row.push(cell(difference.map(|x| x.1)));
            let own = side.calibration.sigma();
            let own = own.and_then(|s| spread(&s)).map(|x| x.1);
            row.push(own.filter(|s| *s > 0.0).map_or(NONE.to_owned(), sigma));
        }
        vec![row]
    });
    let mut row = vec!["NEES/n".to_owned(), String::new()];
    for side in &comparison.sides {
        row.extend(nees(side.nees));
    }
    sections.push(vec![row]);
    Table {
        title: "Groups",
        headings,
        sections,
        notes: [
            "Largest and RMS: of the differences to the reference. RMS σ: of the claimed 1σ.",
            "NEES/n, its 95 % interval and n: one if the σ are true, correlations included.",
        ]
        .map(str::to_owned)
        .to_vec(),
    }
}

fn nees(nees: Option<Nees>) -> [String; 3] {
    match nees {
        Some(Nees {
            mean,
            count,
            interval: (low, high),
        }) => [
            value(mean, 0.1),
            format!("{}…{}", value(low, 0.1), value(high, 0.1)),
            format!("n = {count}"),
        ],
        None => [NONE; 3].map(str::to_owned),
    }
}

fn scatter(comparison: &Comparison) -> Option<Table> {
    let scatter = comparison.scatter.as_ref()?;
    let headings = [
        "",
        "unit",
        "mean less reference",
        "scatter",
        "χ²/n",
        "n",
        "p",
    ];
    let mut sections = by_triad(|group| {
        let of_group = scatter.parameters.iter();
        of_group
            .filter(|p| Group::of(p.index) == group)
            .map(|p| {
                let mut row = vec![
                    name(p.index),
                    group.unit().to_owned(),
                    plus_minus(p.mean, p.mean_sigma, None, group),
                    plus_minus(p.deviation, None, finest(comparison, &[p.index]), group),
                ];
                row.extend(chi_square(p.chi_square));
                row
            })
            .collect()
    });
    let mut all = vec![
        "all".to_owned(),
        String::new(),
        String::new(),
        String::new(),
    ];
    all.extend(chi_square(scatter.joint));
    sections.push(vec![all]);
    Some(Table {
        title: "Scatter",
        headings: headings.map(str::to_owned).to_vec(),
        sections,
        notes: [
            "Mean weighted by the claimed σ, ± its 1σ; scatter: sample standard deviation.",
            "χ² of the scatter against the claimed σ, n its degrees of freedom; p: probability of as \
             much or more. Near 0 the σ are too small, near 1 too large.",
            "All: with correlations, over the calibrations that give them.",
        ]
        .map(str::to_owned)
        .to_vec(),
    })
}

fn chi_square(chi_square: Option<ChiSquare>) -> [String; 3] {
    match chi_square {
        Some(ChiSquare {
            value: x,
            freedom,
            p,
        }) => [
            value(x / freedom as f64, 0.1),
            count(freedom),
            if p < 1e-4 {
                "< 0.0001".to_owned()
            } else {
                value(p, 0.01)
            },
        ],
        None => [NONE; 3].map(str::to_owned),
    }
}
