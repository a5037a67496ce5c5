//! The study as one JSON document. What is not a finite number is null.

use std::collections::BTreeMap;

use serde::Serialize;

use super::verdict::{of_row, sentence, short};
use crate::imu::InstallationForm;
use crate::study::Table1;
use crate::study::table1::{AGREEMENT, ByQuantity, Column, Moments, Quantity, Row};
use crate::units::DEGREE;

#[derive(Serialize)]
struct Document {
    samples: usize,
    seed: u64,
    latitude_deg: f64,
    hours: f64,
    /// Samples that the verdicts rest on.
    population: usize,
    /// Largest |z| of means that agree.
    agreement_z: f64,
    rows: Vec<ReadingRow>,
    verdicts: Vec<ColumnVerdict>,
}

#[derive(Serialize)]
struct ReadingRow {
    sensor: &'static str,
    form: InstallationForm,
    reading: &'static str,
    hours: f64,
    mean: ByKey<f64>,
    std: ByKey<f64>,
    paper_mean: ByKey<f64>,
    paper_std: ByKey<f64>,
    population_mean: ByKey<f64>,
    population_std: ByKey<f64>,
    z: ByKey<f64>,
    agrees: ByKey<bool>,
    verdict: String,
}

#[derive(Serialize)]
struct ColumnVerdict {
    sensor: &'static str,
    form: InstallationForm,
    verdict: &'static str,
    explanation: String,
}

/// A value for each quantity by its key, which names the unit.
type ByKey<T> = BTreeMap<&'static str, T>;

/// All figures of the study.
pub fn document(table: &Table1) -> impl Serialize + use<> {
    let study = &table.study;
    let columns = || table.columns.iter();
    Document {
        samples: study.samples,
        seed: study.seed,
        latitude_deg: study.latitude / DEGREE,
        hours: study.hours,
        population: table.population,
        agreement_z: AGREEMENT,
        rows: columns()
            .flat_map(|column| column.rows().map(|row| reading(column, row)))
            .collect(),
        verdicts: columns()
            .map(|column| ColumnVerdict {
                sensor: column.published.sensor.name(),
                form: column.published.form,
                verdict: short(&column.verdict),
                explanation: sentence(column),
            })
            .collect(),
    }
}

fn reading(column: &Column, row: &Row) -> ReadingRow {
    let paper = column.published.moments();
    let of = |moments: &ByQuantity<Moments>, part: fn(&Moments) -> f64| {
        by_key(|q| part(&moments[q as usize]) / q.unit_value())
    };
    ReadingRow {
        sensor: column.published.sensor.name(),
        form: column.published.form,
        reading: row.reading.name,
        hours: row.hours,
        mean: of(&row.sample, |m| m.mean),
        std: of(&row.sample, |m| m.std),
        paper_mean: of(&paper, |m| m.mean),
        paper_std: of(&paper, |m| m.std),
        population_mean: of(&row.population, |m| m.mean),
        population_std: of(&row.population, |m| m.std),
        z: by_key(|q| row.difference[q as usize]),
        agrees: by_key(|q| row.agrees(q)),
        verdict: of_row(column, row),
    }
}

fn by_key<T>(of: impl Fn(Quantity) -> T) -> ByKey<T> {
    Quantity::ALL
        .map(|q| (q.key(), of(q)))
        .into_iter()
        .collect()
}
