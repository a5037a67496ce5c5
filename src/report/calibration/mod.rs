//! The report of a calibration, and of both methods side by side.

mod budget;
mod facts;
mod figures;
mod methods;
mod path;
mod report;
mod tables;
mod temperature;
#[cfg(test)]
mod tests;
mod verdict;

use super::{effects, outlook};
use crate::report::prelude::*;

pub use super::outlook::Navigated;
pub use report::{ClosedForm, Report};

impl Report<'_> {
    /// Everything that is said of the calibration. Its figures by name are in the calibration's own file.
    pub fn document(&self) -> Document {
        let mut document = Document::new(self.title);
        document.lead = vec![self.verdict()];
        document.lead.extend(self.lead());
        let estimate = self.estimate();
        let unseen = estimate.and_then(|estimate| budget::unseen(self, estimate));
        document.lead.extend(unseen);
        document.warnings.items = self.warnings();
        document.page(facts::item(self));
        document.both(self.groups());
        outlook::in_a_line(&mut document, self.navigation);
        document.fold("Every parameter");
        if let Some(estimate) = self.estimate() {
            document.both(self.parameters(estimate));
        }
        document.fold("Residuals, consistency, error terms");
        document.both(
            self.quality
                .map_or_else(Table::default, |of| tables::residuals(of, self.table())),
        );
        if let Some(outcome) = self.outcome {
            temperature::add(&mut document, outcome);
            document.page(tables::consistency(outcome));
            document.page(tables::passes(outcome));
            document.both(effects::costs(self.effects));
            document.both(effects::explained(self.effects));
        }
        if let (Some(of), Some(estimate)) = (self.budget, self.estimate()) {
            document.fold("Uncertainty budget");
            document.page(budget::table(of, estimate));
            document.page(budget::figure(of, estimate));
            document.page(budget::left_off(self, estimate));
        }
        document.fold("Navigation");
        outlook::add(&mut document, self.navigation);
        if let Some(plot) = outlook::figure(self.navigation.unwrap_or_default()) {
            document.page(plot);
        }
        document.fold("Figures");
        for plot in self.figures() {
            document.page(plot);
        }
        document.fold("Observability, model, method and run");
        if let Some(outcome) = self.outcome {
            document.page(tables::weakest(outcome));
        }
        document.page(self.model());
        document.page(facts::run(self));
        document
    }

    /// What must be known before the figures are used.
    fn warnings(&self) -> Vec<String> {
        self.findings.iter().map(ToString::to_string).collect()
    }

    /// What ran on what.
    fn lead(&self) -> Vec<String> {
        let imu = &self.run.recording.imu;
        let mut run = match self.outcome.map_or(0, |outcome| outcome.alone.len()) {
            0 | 1 => format!(
                "Run {}: {} s, {} samples at {} Hz",
                self.run.recording.name,
                value(imu.duration(), 10.0),
                count(imu.len()),
                three_digits(1.0 / imu.period),
            ),
            recordings => format!("Campaign of {recordings} recordings of one instrument"),
        };
        run += &format!(
            ", {} dwells; body frame: {}",
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
