//! The report as text: what a calibration engineer reads at a glance.

use std::fmt::Write;

use comfy_table::{CellAlignment, Table, presets};

use super::group::{Group, axis_name};
use super::number::{count, sigma, three_digits, value};
use super::{Report, blocks, further, navigation, quality, side_by_side};
use crate::calibration::{Estimate, Nis, Outcome, to_vector};

impl Report<'_> {
    /// The estimates with their σ, what the run taught, and warnings.
    pub fn summary(&self) -> String {
        let mut text = self.heading();
        if let Some(estimate) = self.estimate() {
            let _ = writeln!(text, "\n{}", self.estimates(estimate));
        }
        if self.truth.is_some() {
            let _ = writeln!(text, "\n{}", self.group_errors());
        }
        if let Some(line) = navigation::outlook::line(self.navigation.unwrap_or_default()) {
            let _ = writeln!(text, "\n{line}");
        }
        if let Some(left) = self.quality_table() {
            let _ = write!(text, "\n{}\n{}", left.title, columns(&left));
        }
        for of_blocks in blocks::tables(self.effects) {
            let _ = write!(text, "\n{}\n{}", of_blocks.title, columns(&of_blocks));
        }
        for warning in self.warnings() {
            let _ = writeln!(text, "\nWarning: {warning}");
        }
        text
    }

    /// What the calibration leaves of gravity and turns.
    pub(super) fn quality_table(&self) -> Option<side_by_side::Table> {
        quality::table(self.quality?, self.table())
    }

    /// What a calibration engineer must know before using the figures.
    pub(super) fn warnings(&self) -> Vec<String> {
        let of_closed_form = self.closed_form.map_or(&[][..], |closed| closed.findings);
        let of_outcome = self.outcome.map_or(&[][..], |outcome| &outcome.findings);
        let findings = of_closed_form.iter().chain(of_outcome);
        let mut warnings: Vec<String> = findings.map(ToString::to_string).collect();
        warnings.extend(blocks::advice(self.effects));
        warnings
    }

    fn heading(&self) -> String {
        let imu = &self.run.recording.imu;
        let mut text = format!(
            "{}: {} s, {} samples at {} Hz, {} dwells",
            self.title,
            value(imu.duration(), 10.0),
            count(imu.len()),
            three_digits(1.0 / imu.period),
            self.dwells.len(),
        );
        if let Some(estimate) = self.estimate() {
            let _ = write!(text, "; {} installation", estimate.form().name());
        }
        let _ = writeln!(text, "; body frame: {}", self.body_frame.words());
        if let Some(outcome) = self.outcome {
            let _ = writeln!(text, "{}", passes(outcome));
        } else if let Some(closed_form) = self.closed_form {
            let _ = writeln!(text, "closed form: {}", closed_form.note);
        }
        text
    }

    fn estimates(&self, estimate: &Estimate) -> Table {
        let (values, sigmas) = (estimate.vector(), estimate.sigma());
        let truth = self.truth.map(to_vector);
        let prior = self.outcome.map(|outcome| outcome.prior_sigma);
        let mut headings = vec!["", "", "value", "", "σ", "unit"];
        if prior.is_some() {
            headings.extend(["prior σ", "prior : σ"]);
        }
        if truth.is_some() {
            headings.extend(["error", "error/σ"]);
        }
        let mut table = table(&headings);
        for group in Group::all() {
            for (n, index) in group.estimated(estimate).into_iter().enumerate() {
                let shown = |x: f64| x / group.unit_value();
                let s = shown(sigmas[index]);
                let mut row = vec![
                    if n == 0 { group.title() } else { String::new() },
                    axis_name(estimate.form(), index),
                    value(group.shown(values[index]), s),
                    "±".to_owned(),
                    sigma(s),
                    group.unit().to_owned(),
                ];
                if let Some(prior) = prior {
                    row.push(three_digits(shown(prior[index])));
                    row.push(three_digits(prior[index] / sigmas[index]));
                }
                if let Some(truth) = truth {
                    let error = shown(values[index] - truth[index]);
                    row.push(value(error, s));
                    row.push(value(error / s, 1.0));
                }
                table.add_row(row);
            }
        }
        if let Some(outcome) = self.outcome {
            for row in further::rows(&outcome.auxiliary, self.true_terms) {
                let mut cells = vec![
                    if row.first {
                        row.title.to_owned()
                    } else {
                        String::new()
                    },
                    row.axis,
                    row.value,
                    "±".to_owned(),
                    row.sigma,
                    row.unit.to_owned(),
                    row.prior,
                    three_digits(1.0 / row.remaining),
                ];
                if truth.is_some() {
                    cells.extend(row.error.unwrap_or(["–", "–"].map(str::to_owned)));
                }
                table.add_row(cells);
            }
        }
        align(table)
    }

    /// Each method's errors, group by group.
    fn group_errors(&self) -> Table {
        let Some(truth) = self.truth.map(to_vector) else {
            return table(&[]);
        };
        let methods: Vec<(&str, &Estimate)> = self
            .closed_form
            .map(|closed| ("closed form", closed.estimate))
            .into_iter()
            .chain(self.outcome.map(|outcome| ("EKF", &outcome.estimate)))
            .collect();
        let mut headings = vec!["largest error".to_owned(), "unit".to_owned()];
        for (name, _) in &methods {
            headings.extend([(*name).to_owned(), "RMS".to_owned(), "RMS σ".to_owned()]);
        }
        if methods.len() == 2 {
            headings.push("gain of σ".to_owned());
        }
        let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
        let mut table = table(&headings);
        for group in Group::all() {
            let mut row = vec![group.title(), group.unit().to_owned()];
            let mut claimed = Vec::new();
            for (_, estimate) in &methods {
                let indices = group.estimated(estimate);
                let of = |v| group.spread(&v, &indices).unwrap_or((f64::NAN, f64::NAN));
                let (largest, rms) = of(estimate.vector() - truth);
                let (_, sigma) = of(estimate.sigma());
                claimed.push(sigma);
                row.extend([largest, rms, sigma].map(three_digits));
            }
            if let [closed, filter] = claimed[..] {
                row.push(three_digits(closed / filter));
            }
            table.add_row(row);
        }
        align(table)
    }
}

fn passes(outcome: &Outcome) -> String {
    let consistency = &outcome.consistency;
    let nis = |nis: &Nis| {
        format!(
            "{} ({} to {})",
            value(nis.mean, 0.01),
            value(nis.interval.0, 0.01),
            value(nis.interval.1, 0.01)
        )
    };
    let observed = [
        ("velocity", consistency.velocity),
        ("table", consistency.table),
    ];
    let observed: Vec<String> = observed
        .iter()
        .filter(|(_, of)| of.count > 0)
        .map(|(name, of)| format!("{name} {}", nis(of)))
        .collect();
    format!(
        "{} after {} passes; NIS with its 95 % interval: {}",
        if outcome.converged {
            "converged"
        } else {
            "NOT CONVERGED"
        },
        outcome.passes.len(),
        observed.join(", "),
    )
}

/// Pairs of a name and a value, the values below each other.
pub(super) fn facts(rows: &[(String, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.chars().count()).max();
    let width = width.unwrap_or(0);
    let mut text = String::new();
    for (name, value) in rows {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {name:<width$}  {value}");
    }
    text
}

/// A table in columns, its sections apart, with its notes.
pub(super) fn columns(of: &side_by_side::Table) -> String {
    let headings: Vec<&str> = of.headings.iter().map(String::as_str).collect();
    let mut table = table(&headings);
    table.add_rows(of.sections.iter().flatten());
    let shown = align(table).to_string();
    let lines: Vec<&str> = shown.lines().map(str::trim_end).collect();
    let width = lines.iter().map(|line| line.chars().count()).max();
    let rule = "─".repeat(width.unwrap_or(0));
    // A heading may take several lines, a row takes one.
    let count: usize = of.sections.iter().map(Vec::len).sum();
    let (heading, mut rows) = lines.split_at(lines.len().saturating_sub(count));
    let mut text = heading.join("\n") + "\n";
    for section in &of.sections {
        let (of_section, others) = rows.split_at(section.len().min(rows.len()));
        let _ = writeln!(text, "{rule}\n{}", of_section.join("\n"));
        rows = others;
    }
    for note in &of.notes {
        let _ = writeln!(text, "{note}");
    }
    text
}

/// A table without frames: first column to the left, all others to the right.
fn table(headings: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(headings);
    table
}

fn align(mut table: Table) -> Table {
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
