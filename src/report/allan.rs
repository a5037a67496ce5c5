//! The report of an instrument's noise: Allan deviations, what they show, and the figures for a run.

mod document;
mod figure;
mod quantity;
mod run_toml;
mod tables;
mod words;

use std::fmt::Write;
use std::path::Path;

use maud::html;
use serde::Serialize;

use super::number::{count, three_digits};
use super::page::{document as html_document, drawn};
use super::side_by_side::Table;
use super::{ReportError, terminal, write_files};
use crate::imu::Sensor;
use crate::noise::NoiseAnalysis;

/// The noise of a run, to be shown.
#[derive(Debug, Clone, Copy)]
pub struct AllanReport<'a> {
    /// Name of the run.
    pub run: &'a str,
    /// What was found.
    pub analysis: &'a NoiseAnalysis,
}

impl AllanReport<'_> {
    /// The coefficients, the deviations, what could not be seen, and a table for `run.toml`.
    pub fn summary(&self) -> String {
        let mut text = self.title() + "\n";
        for warning in words::warnings(self.analysis) {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "Warning: {warning}");
        }
        let shown = Sensor::ALL.map(|sensor| tables::coefficients(self.analysis, sensor));
        for table in shown.iter().chain([&tables::deviations(self.analysis, 2)]) {
            let _ = write!(text, "\n{}\n{}", table.title, terminal::columns(table));
        }
        let advice = words::advice(self.analysis);
        if !advice.is_empty() {
            text.push_str("\nNot found\n");
        }
        for sentence in advice {
            let _ = writeln!(text, "  {sentence}");
        }
        text + "\n" + &run_toml::noise_table(self.analysis)
    }

    /// All figures as one document.
    pub fn document(&self) -> impl Serialize {
        document::document(self)
    }

    /// Writes `index.html`, which needs nothing else, `gyro.svg` and `accel.svg` into an existing
    /// directory.
    ///
    /// # Errors
    /// [`ReportError`] if a figure cannot be drawn or a file not be written.
    pub fn write(&self, directory: &Path) -> Result<(), ReportError> {
        let figures = [
            figure::figure(self.analysis, Sensor::Gyro)?,
            figure::figure(self.analysis, Sensor::Accel)?,
        ];
        let title = self.title();
        let warnings = words::warnings(self.analysis);
        let advice = words::advice(self.analysis);
        let mut shown = Sensor::ALL
            .map(|sensor| tables::coefficients(self.analysis, sensor))
            .to_vec();
        shown.push(tables::deviations(self.analysis, 1));
        let body = html! {
            header { h1 { (title) } }
            @if !warnings.is_empty() {
                section.warnings { h2 { "Warnings" } ul { @for w in warnings { li { (w) } } } }
            }
            @for figure in &figures { (drawn(figure)) }
            section { h2 { "For run.toml" } pre { (run_toml::noise_table(self.analysis)) } }
            @if !advice.is_empty() {
                section { h2 { "Not found" } ul { @for sentence in advice { li { (sentence) } } } }
            }
            @for Table { title, headings, sections, notes } in shown {
                section {
                    h2 { (title) }
                    (super::tables::table(&headings, sections))
                    p.note { (notes.join(" ")) }
                }
            }
            section { h2 { "Method" } p.note { (words::METHOD) } }
        };
        write_files(directory, &html_document(&title, &body), &figures)
    }

    fn title(&self) -> String {
        let NoiseAnalysis {
            stretch, period, ..
        } = self.analysis;
        format!(
            "Noise of {}: {}, {}, {} samples at {} Hz",
            self.run,
            stretch.name,
            words::duration(self.analysis.duration()),
            count(stretch.samples.len()),
            three_digits(period.recip())
        )
    }
}
