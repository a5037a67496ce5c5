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

use std::fmt::Write;
use std::path::Path;

use maud::html;

use super::page::{document as html_document, drawn};
use super::side_by_side::Table;
use super::{Figure, ReportError, facts as pairs, terminal, write_files};
use crate::study::Accuracy;

pub use document::document;

/// The study as text: what was done, the tables, and a verdict in sentences, those that a user
/// must know before trusting the figures with an exclamation mark.
pub fn summary(accuracy: &Accuracy) -> String {
    let mut text = title(accuracy) + "\n";
    let facts = facts::facts(accuracy);
    let width = facts.iter().map(|(name, _)| name.chars().count()).max();
    let width = width.unwrap_or(0);
    for (name, value) in facts {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {name:<width$}  {value}");
    }
    for table in tables::tables(accuracy) {
        let _ = write!(text, "\n{}\n{}", table.title, terminal::columns(&table));
    }
    text.push_str("\nVerdict\n");
    for sentence in verdict::verdict(accuracy) {
        let mark = if sentence.good { ' ' } else { '!' };
        let _ = writeln!(text, "{mark} {}", sentence.text);
    }
    text
}

/// Writes `index.html`, which needs nothing else, and every figure as an SVG file of its own into an
/// existing directory.
///
/// # Errors
/// [`ReportError`] if a figure cannot be drawn or a file not be written.
pub fn write(accuracy: &Accuracy, directory: &Path) -> Result<(), ReportError> {
    let figures = figures(accuracy)?;
    write_files(directory, &page(accuracy, &figures), &figures)
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

fn page(accuracy: &Accuracy, figures: &[Figure]) -> String {
    let title = title(accuracy);
    let (good, bad): (Vec<_>, Vec<_>) = verdict::verdict(accuracy)
        .into_iter()
        .partition(|sentence| sentence.good);
    let body = html! {
        header { h1 { (title) } }
        @if !bad.is_empty() {
            section.warnings { h2 { "To be noted" } ul { @for s in bad { li { (s.text) } } } }
        }
        section { h2 { "What holds" } ul { @for s in good { li { (s.text) } } } }
        section { h2 { "The study" } (pairs::facts(facts::facts(accuracy))) }
        @for Table { title, headings, sections, notes } in tables::tables(accuracy) {
            section {
                h2 { (title) }
                (super::tables::table(&headings, sections))
                p.note { (notes.join(" ")) }
            }
        }
        @for figure in figures { (drawn(figure)) }
    };
    html_document(&title, &body)
}

fn title(accuracy: &Accuracy) -> String {
    format!(
        "Accuracy of the filter over {} simulated runs of {}",
        super::number::count(accuracy.trials.len()),
        accuracy.study.scenario.name
    )
}
