//! The report of what a run holds: its log, dwells and turns, labels, and what the methods could see.

mod document;
mod figure;
mod tables;
mod words;

use std::fmt::Write;
use std::path::Path;

use maud::html;
use serde::Serialize;

use super::number::{count, three_digits, value};
use super::page::{document as html_document, drawn};
use super::{ReportError, terminal, write_files};
use crate::run::Run;
use crate::survey::Survey;

/// What a run holds, to be shown.
#[derive(Debug, Clone, Copy)]
pub struct CheckReport<'a> {
    /// The run.
    pub run: &'a Run,
    /// What was seen in it.
    pub survey: &'a Survey,
}

impl CheckReport<'_> {
    /// What to change, then the log, dwells and turns, labels, and what each method could see.
    pub fn summary(&self) -> String {
        let mut text = self.title() + "\n" + &words::log(self) + "\n";
        let findings = words::findings(self);
        if !findings.is_empty() {
            text.push_str("\nWhat to look at\n");
        }
        for finding in findings {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "  {finding}");
        }
        for table in tables::all(self) {
            let _ = write!(text, "\n{}\n{}", table.title, terminal::columns(&table));
        }
        text
    }

    /// All figures as one document.
    pub fn document(&self) -> impl Serialize {
        document::document(self)
    }

    /// Writes `index.html`, which needs nothing else, and `record.svg` into an existing directory.
    ///
    /// # Errors
    /// [`ReportError`] if the figure cannot be drawn or a file not be written.
    pub fn write(&self, directory: &Path) -> Result<(), ReportError> {
        let figure = figure::figure(self)?;
        let title = self.title();
        let findings = words::findings(self);
        let body = html! {
            header { h1 { (title) } p { (words::log(self)) } }
            @if !findings.is_empty() {
                section.warnings { h2 { "What to look at" } ul { @for f in &findings { li { (f) } } } }
            }
            (drawn(&figure))
            @for table in &tables::all(self) { (super::tables::section(table)) }
        };
        write_files(directory, &html_document(&title, &body), &[figure])
    }

    fn title(&self) -> String {
        let imu = &self.run.recording.imu;
        format!(
            "Check of {}: {} s, {} samples at {} Hz, {}, {}",
            self.run.recording.name,
            value(imu.duration(), 10.0),
            count(imu.len()),
            three_digits(imu.period.recip()),
            several(self.survey.rests.len(), "dwell"),
            several(self.survey.turns.len(), "turn"),
        )
    }
}

/// Such as `3 turns`.
fn several(count: usize, name: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {name}{plural}")
}

#[cfg(test)]
mod tests;
