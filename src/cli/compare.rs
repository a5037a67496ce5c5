//! `turncal compare`: calibrations side by side.

mod document;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::error::ErrorKind;
use turncal::calibration::{Comparison, Named, compare};
use turncal::report::side_by_side::{self, Table};
use turncal::run::CalibrationRecord;

use super::names::short_names;
use super::output::{Overwrite, print};

/// Calibrations side by side, parameter by parameter, with their σ.
///
/// All are brought to the general installation form and to one body frame first. Without a truth the
/// first is the reference. From three on, mean, scatter and χ² of the scatter against the claimed σ
/// are shown, too.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  turncal compare monday.json friday.json --truth truth.json")]
pub struct Compare {
    /// Calibrations, two or more; one is enough with --truth
    #[arg(required = true, value_name = "CALIBRATION.json")]
    calibrations: Vec<PathBuf>,
    /// The true values, if they are known
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Print one JSON document and nothing else
    #[arg(long)]
    json: bool,
    /// Write a report with a figure into this directory
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
}

impl Compare {
    pub fn run(&self) -> anyhow::Result<()> {
        if self.calibrations.len() == 1 && self.truth.is_none() {
            let message = "one calibration can be compared with a truth only: give --truth, or a second \
                       calibration\n";
            clap::Error::raw(ErrorKind::TooFewValues, message).exit();
        }
        let paths: Vec<&Path> = self
            .truth
            .iter()
            .chain(&self.calibrations)
            .map(PathBuf::as_path)
            .collect();
        let records = paths
            .iter()
            .map(|path| CalibrationRecord::read(path))
            .collect::<Result<Vec<_>, _>>()?;
        let names = short_names(&paths);
        let named: Vec<Named> = names
            .iter()
            .zip(&records)
            .map(|(name, record)| Named { name, record })
            .collect();
        let (truth, calibrations) = named.split_at(usize::from(self.truth.is_some()));
        let comparison = compare(calibrations, truth.first().copied())?;
        if let Some(directory) = &self.output {
            let whole = self.overwrite.directory(directory, &paths)?;
            side_by_side::write(&comparison, &whole.path())?;
            whole.commit()?;
        }
        let text = if self.json {
            serde_json::to_string_pretty(&document::Document::new(&comparison))? + "\n"
        } else {
            text(&comparison)
        };
        print(text.as_bytes())
    }
}

fn text(comparison: &Comparison) -> String {
    let mut text = side_by_side::summary(comparison) + "\n";
    for warning in side_by_side::warnings(comparison) {
        text.push_str(&format!("Warning: {warning}\n"));
    }
    for table in side_by_side::tables(comparison) {
        text.push('\n');
        push_table(&mut text, &table);
    }
    text
}

/// Appends a table in columns: the first to the left, the others to the right.
fn push_table(text: &mut String, table: &Table) {
    let rows = || std::iter::once(&table.headings).chain(table.sections.iter().flatten());
    let width = |column: usize| {
        let cells = rows().filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..table.headings.len()).map(width).collect();
    let line = |row: &[String]| {
        let mut line = String::new();
        for (column, (cell, &width)) in row.iter().zip(&widths).enumerate() {
            // Writing to a string cannot fail.
            let _ = match column {
                0 => write!(line, "{cell:<width$}"),
                _ => write!(line, "  {cell:>width$}"),
            };
        }
        line.trim_end().to_owned() + "\n"
    };
    text.push_str(&line(&table.headings));
    let rule = widths
        .iter()
        .map(|w| w + 2)
        .sum::<usize>()
        .saturating_sub(2);
    for section in &table.sections {
        text.push_str(&"─".repeat(rule));
        text.push('\n');
        for row in section {
            text.push_str(&line(row));
        }
    }
    for note in &table.notes {
        text.push_str(note);
        text.push('\n');
    }
}
