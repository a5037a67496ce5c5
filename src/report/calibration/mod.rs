//! The report of a calibration, and of both methods side by side.

mod facts;
mod figures;
mod path;
mod tables;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::ops::Range;

use super::document::{Document, Table};
use super::number::{count, three_digits, value};
use super::{effects, outlook};
use crate::calibration::outcome::{Estimate, OBSERVED_BELOW, Outcome, to_vector};
use crate::calibration::states::ParameterVector;
use crate::calibration::{BlockEffect, Quality};
use crate::imu::{PerSensor, Triad};
use crate::run::Run;
use crate::run::record::{BodyFrame, TermRecord};
use crate::study::navigation::NavigationStudyError;

pub use super::outlook::Navigated;

/// What a report is made of. Every estimate and the truth have the same installation form and the same body
/// frame.
#[derive(Debug, Clone, Copy)]
pub struct Report<'a> {
    /// Heading of the page.
    pub title: &'a str,
    /// The record.
    pub run: &'a Run,
    /// What fixes the body axes.
    pub body_frame: BodyFrame,
    /// The filter's result, if it ran.
    pub outcome: Option<&'a Outcome>,
    /// What error terms did to it, or would do.
    pub effects: &'a [BlockEffect],
    /// The closed form's result, if there is one.
    pub closed_form: Option<ClosedForm<'a>>,
    /// The true triads, where they are known.
    pub truth: Option<&'a PerSensor<Triad>>,
    /// True auxiliary parameters by name, as far as they are known.
    pub true_terms: &'a BTreeMap<String, TermRecord>,
    /// Residuals at rest and after turns.
    pub quality: Option<&'a Quality>,
    /// Dwells, s.
    pub dwells: &'a [Range<f64>],
    /// Navigation errors by each calibration, the closed form first; or why the run's site has none.
    pub navigation: Result<&'a [Navigated], &'a NavigationStudyError>,
}

/// The closed form's result, the baseline of the comparison.
#[derive(Debug, Clone, Copy)]
pub struct ClosedForm<'a> {
    /// Its estimate with the σ it claims.
    pub estimate: &'a Estimate,
    /// What it was made of, such as `six positions, 60 min of its own`.
    pub note: &'a str,
    /// What must be known before using it.
    pub warnings: &'a [String],
}

impl Report<'_> {
    /// Everything that is said of the calibration. Its figures by name are in the calibration's own file.
    pub fn document(&self) -> Document {
        let mut document = Document::new(self.title);
        document.lead = self.lead();
        document.warnings.items = self.warnings();
        if let Some(estimate) = self.estimate() {
            document.both(self.parameters(estimate));
        }
        document.both(self.groups());
        document.both(
            self.quality
                .map_or_else(Table::default, |of| tables::residuals(of, self.run)),
        );
        if let Some(outcome) = self.outcome {
            document.page(tables::consistency(outcome));
            document.page(tables::passes(outcome));
            document.both(effects::costs(self.effects));
            document.both(effects::explained(self.effects));
        }
        outlook::add(&mut document, self.navigation);
        for plot in self.figures() {
            document.page(plot);
        }
        if let Some(outcome) = self.outcome {
            document.page(tables::weakest(outcome));
        }
        document.page(self.model());
        document.page(facts::run(self.run));
        document
    }

    /// The estimate that the report is about.
    fn estimate(&self) -> Option<&Estimate> {
        let filtered = self.outcome.map(|outcome| &outcome.estimate);
        filtered.or(self.closed_form.map(|closed| closed.estimate))
    }

    fn truth_vector(&self) -> Option<ParameterVector> {
        self.truth.map(to_vector)
    }

    /// Begin and end of the record, s.
    fn time_span(&self) -> (f64, f64) {
        let imu = &self.run.imu;
        (imu.start, imu.start + imu.duration())
    }

    /// Both methods that ran, the closed form first.
    fn methods(&self) -> Vec<(&'static str, &Estimate)> {
        let closed = self
            .closed_form
            .map(|closed| ("closed form", closed.estimate));
        let filter = self.outcome.map(|outcome| ("EKF", &outcome.estimate));
        closed.into_iter().chain(filter).collect()
    }

    /// What must be known before the figures are used.
    fn warnings(&self) -> Vec<String> {
        let of_closed_form = self.closed_form.map_or(&[][..], |closed| closed.warnings);
        let of_outcome = self.outcome.map_or(&[][..], |outcome| &outcome.warnings);
        let mut warnings = [of_closed_form, of_outcome].concat();
        warnings.extend(effects::advice(self.effects));
        warnings
    }

    /// What ran on what.
    fn lead(&self) -> Vec<String> {
        let imu = &self.run.imu;
        let mut run = format!(
            "Run {}: {} s, {} samples at {} Hz, {} dwells; body frame: {}",
            self.run.name,
            value(imu.duration(), 10.0),
            count(imu.len()),
            three_digits(1.0 / imu.period),
            self.dwells.len(),
            self.body_frame.words(),
        );
        if let Some(estimate) = self.estimate() {
            run += &format!("; installation: {}", estimate.form().name());
        }
        let mut lead = vec![run + "."];
        lead.extend(self.outcome.map(|outcome| {
            format!(
                "EKF {} after {} passes; NIS with its 95 % interval: {}.",
                if outcome.converged {
                    "converged"
                } else {
                    "NOT CONVERGED"
                },
                outcome.passes.len(),
                tables::nis(outcome).join(", "),
            )
        }));
        lead.extend(
            self.closed_form
                .map(|closed| format!("Closed form: {}.", closed.note)),
        );
        lead
    }
}

/// Prior over posterior σ, with words where the data did not observe the parameter.
pub(super) fn improvement(prior: f64, posterior: f64) -> String {
    let ratio = prior / posterior;
    if !ratio.is_finite() {
        "–".to_owned()
    } else if ratio * OBSERVED_BELOW < 1.0 {
        format!("{}, not observed", value(ratio, 0.1))
    } else {
        three_digits(ratio)
    }
}
