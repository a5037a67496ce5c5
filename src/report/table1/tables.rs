//! The tables, for terminal and page alike: one for each of the paper's columns.

use super::super::number::{count, three_digits, value};
use super::super::side_by_side::Table;
use super::verdict;
use crate::imu::{InstallationForm, Sensor};
use crate::study::Table1;
use crate::study::table1::paper::{self, Published};
use crate::study::table1::{ByQuantity, Column, Moments, Quantity, Row};

/// Smaller figures, in the units shown, are shown as zero.
const ZERO: f64 = 5e-10;
/// A difference of more standard errors than this is only said to be more.
const MANY: f64 = 100.0;

pub(super) fn tables(table: &Table1) -> Vec<Table> {
    let columns = table.columns.iter();
    columns.map(|column| of_column(table, column)).collect()
}

pub(super) fn title(published: &Published) -> &'static str {
    match (published.sensor, published.form) {
        (Sensor::Gyro, InstallationForm::ThreeAngle) => "Gyros, three-angle form (Eq. 10)",
        (Sensor::Gyro, _) => "Gyros, six-angle form (Eq. 8)",
        (Sensor::Accel, InstallationForm::ThreeAngle) => {
            "Accelerometers, three-angle form (Eq. 10)"
        }
        (Sensor::Accel, _) => "Accelerometers, six-angle form (Eq. 8)",
    }
}

/// A figure in the unit of its quantity.
pub(super) fn figure(quantity: Quantity, figure: f64) -> String {
    let shown = figure / quantity.unit_value();
    if shown.abs() < ZERO {
        "0".to_owned()
    } else {
        three_digits(shown)
    }
}

fn of_column(table: &Table1, column: &Column) -> Table {
    let mut headings = vec!["reading".to_owned(), String::new()];
    headings.extend(Quantity::ALL.map(|q| format!("{}, {}", q.name(), q.unit())));
    headings.push("the paper's figures".to_owned());
    let paper = column.published.moments();
    let paper_name = format!("paper, {} samples", paper::SAMPLES);
    let mut sections = vec![pair(&paper_name, &paper, "")];
    for row in column.rows() {
        sections.push(of_row(table, row, &verdict::of_row(column, row)));
    }
    Table {
        title: title(column.published),
        headings,
        sections,
        notes: Vec::new(),
    }
}

/// Mean and standard deviation.
fn pair(name: &str, moments: &ByQuantity<Moments>, verdict: &str) -> Vec<Vec<String>> {
    vec![
        line(
            name,
            "mean",
            |q| figure(q, moments[q as usize].mean),
            verdict,
        ),
        line("", "std", |q| figure(q, moments[q as usize].std), ""),
    ]
}

fn of_row(table: &Table1, row: &Row, verdict: &str) -> Vec<Vec<String>> {
    let mut lines = pair(row.reading.name, &row.sample, verdict);
    if table.population > table.study.samples {
        let of = format!("mean of {}", count(table.population));
        lines.push(line(
            "",
            &of,
            |q| figure(q, row.population[q as usize].mean),
            "",
        ));
    }
    lines.push(line(
        "",
        "z",
        |q| standard_errors(row.difference[q as usize]),
        "",
    ));
    lines
}

fn line(name: &str, what: &str, cell: impl Fn(Quantity) -> String, verdict: &str) -> Vec<String> {
    let mut cells = vec![name.to_owned(), what.to_owned()];
    cells.extend(Quantity::ALL.map(cell));
    cells.push(verdict.to_owned());
    cells
}

fn standard_errors(z: f64) -> String {
    if z.abs() > MANY {
        format!("{} {MANY}", if z > 0.0 { ">" } else { "< −" }).replace("− ", "−")
    } else {
        value(z, 1.0)
    }
}
