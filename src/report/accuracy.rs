//! The report of a study of accuracy: one set of tables and a verdict for terminal and page, figures,
//! and one JSON document.

mod bars;
mod containment;
mod document;
mod facts;
mod histogram;
mod merit;
mod nees;
mod tables;
#[cfg(test)]
mod tests;
mod time;
mod verdict;

use std::path::Path;

use super::number::count;
use super::study::StudyReport;
use super::{Figure, ReportError, write_files};
use crate::study::Accuracy;

pub use document::document;

/// The study as text: what was done, the tables, and a verdict in sentences, those that a user
/// must know before trusting the figures with an exclamation mark.
pub fn summary(accuracy: &Accuracy) -> String {
    report(accuracy).summary()
}

/// Writes `index.html`, which needs nothing else, and every figure as an SVG file of its own into an
/// existing directory.
///
/// # Errors
/// [`ReportError`] if a figure cannot be drawn or a file not be written.
pub fn write(accuracy: &Accuracy, directory: &Path) -> Result<(), ReportError> {
    let figures = figures(accuracy)?;
    write_files(directory, &report(accuracy).page(&figures), &figures)
}

fn figures(accuracy: &Accuracy) -> Result<Vec<Figure>, ReportError> {
    let mut figures = vec![
        histogram::figure(accuracy)?,
        bars::ratio(accuracy)?,
        nees::figure(accuracy)?,
        bars::gain(accuracy)?,
        time::figure(accuracy)?,
    ];
    figures.extend(containment::figure(accuracy)?);
    Ok(figures)
}

fn report(accuracy: &Accuracy) -> StudyReport {
    StudyReport {
        title: format!(
            "Accuracy of the filter over {} simulated runs of {}",
            count(accuracy.trials.len()),
            accuracy.study.scenario.name
        ),
        subject: "The study",
        facts: facts::facts(accuracy),
        tables: tables::tables(accuracy),
        verdict: verdict::verdict(accuracy),
    }
}
