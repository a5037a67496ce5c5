//! The report of the paper's Table 1: tables and verdicts for terminal and page, the paper's Figures 2
//! to 9, and one JSON document.

mod document;
mod figures;
mod tables;
#[cfg(test)]
mod tests;
mod verdict;

use std::fmt::Write;
use std::path::Path;

use maud::html;

use super::number::{count, three_digits};
use super::page::{document as html_document, drawn};
use super::{ReportError, facts as pairs, terminal, write_files};
use crate::study::Table1;
use crate::study::table1::{AGREEMENT, paper};
use crate::units::DEGREE;

pub use document::document;

const TITLE: &str = "What a simplified installation form costs: the paper's Table 1";

/// The study as text: what was done, a table for each column of the paper's, and what can be said of
/// each in a sentence.
pub fn summary(table: &Table1) -> String {
    let mut text = format!("{TITLE}\n{}", terminal::facts(&facts(table)));
    for shown in tables::tables(table) {
        // Writing to a string cannot fail.
        let _ = write!(text, "\n{}\n{}", shown.title, terminal::columns(&shown));
    }
    text.push_str("\nVerdict\n");
    for sentence in verdict::sentences(table) {
        let _ = writeln!(text, "  {sentence}");
    }
    for note in notes(table) {
        let _ = writeln!(text, "\n{note}");
    }
    text
}

/// Writes `index.html`, which needs nothing else, and every figure as an SVG file of its own into an
/// existing directory.
///
/// # Errors
/// [`ReportError`] if a figure cannot be drawn or a file not be written.
pub fn write(table: &Table1, directory: &Path) -> Result<(), ReportError> {
    let figures = figures::figures(table)?;
    let body = html! {
        header { h1 { (TITLE) } }
        section { h2 { "Verdict" } ul { @for s in verdict::sentences(table) { li { (s) } } } }
        section { h2 { "The study" } (pairs::facts(&facts(table))) }
        @for shown in tables::tables(table) { (super::tables::section(&shown)) }
        @for note in notes(table) { p.note { (note) } }
        @for figure in &figures { (drawn(figure)) }
    };
    write_files(directory, &html_document(TITLE, &body), &figures)
}

fn facts(table: &Table1) -> Vec<(String, String)> {
    let study = &table.study;
    let mut samples = format!("{}, seed {}", count(study.samples), study.seed);
    if table.population > study.samples {
        let _ = write!(
            samples,
            "; they begin a population of {} on which the verdicts rest",
            count(table.population)
        );
    }
    [
        (
            "source",
            "Zhao, Jiang, Li, The IMU Calibration Mathematical Modeling and Error Analysis, 2016, §3.2"
                .to_owned(),
        ),
        ("samples", samples),
        (
            "truth",
            "six angles of ±0.1° a triad, rows of unit norm; no noise, no pulses".to_owned(),
        ),
        (
            "navigation",
            format!(
                "standing level for {} h at latitude {:.2}°, height held, alignment perfect",
                three_digits(study.hours),
                study.latitude / DEGREE
            ),
        ),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}

fn notes(table: &Table1) -> Vec<String> {
    let mut notes = vec![
        "Figures are the largest absolute error of the run, mean and standard deviation over samples; \
         velocity and position are horizontal norms. 0 stands for less than 5e-10."
            .to_owned(),
        format!(
            "z: the paper's mean less that of {} samples over the standard error of the difference, \
             s √(1/{} + 1/{}) with s of those samples. Means agree where |z| ≤ {AGREEMENT} (99 %).",
            count(table.population),
            paper::SAMPLES,
            table.population
        ),
        "The paper states no latitude. 45.78° follows from its accelerometer rows: heading over roll is \
         tan L."
            .to_owned(),
    ];
    let (hours, latitude) = (table.study.hours, table.study.latitude / DEGREE);
    if (hours - paper::HOURS).abs() > 1e-9 || (latitude - paper::LATITUDE_DEG).abs() > 1e-9 {
        notes.push(format!(
            "The paper's runs are of {} h at about {}°: differences from it are not those of its \
             conditions.",
            paper::HOURS,
            paper::LATITUDE_DEG
        ));
    }
    notes
}
