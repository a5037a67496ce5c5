//! The one sentence that a reader wants first.

use super::report::Report;
use crate::calibration::{Estimate, Finding, ParameterVector};
use crate::report::prelude::*;

impl Report<'_> {
    /// Whether the calibration may be used, and what is weakest of it.
    pub(super) fn verdict(&self) -> String {
        if self.outcome.is_some_and(|outcome| !outcome.converged) {
            return "Not calibrated: the filter did not converge; values and σ may not be used."
                .to_owned();
        }
        if self.findings.iter().any(Finding::is_unexplained) {
            return "Not calibrated: no noise explains what the calibration leaves; values may not be used."
                .to_owned();
        }
        let Some(estimate) = self.estimate() else {
            return "Not calibrated.".to_owned();
        };
        let estimated = estimate.estimated().count();
        let hidden = self.outcome.map_or(0, |outcome| outcome.unobserved().len());
        let parameters = match hidden {
            0 => format!("{} parameters", count(estimated)),
            _ => format!(
                "{} of {} parameters; the data do not show the others",
                count(estimated - hidden),
                count(estimated)
            ),
        };
        let warnings = match self.findings.len() {
            0 => "no warnings".to_owned(),
            1 => "one warning, to be read first".to_owned(),
            n => format!("{n} warnings, to be read first"),
        };
        let weakest = self.outcome.and_then(|outcome| {
            let prior = &outcome.prior_sigma;
            let index = weakest(estimate, prior)?;
            let group = Group::of(index);
            let own = estimate.sigma()[index] / group.unit_value();
            let (title, axis) = (group.title(), axis_name(estimate.form(), index));
            Some(format!(
                "; least determined: {title} {axis}, {} {} (1σ)",
                sigma(own),
                group.unit()
            ))
        });
        format!(
            "Calibrated: {parameters}; {warnings}{}.",
            weakest.unwrap_or_default()
        )
    }
}

/// The parameter of which the data left most of what was uncertain before.
fn weakest(estimate: &Estimate, prior: &ParameterVector) -> Option<usize> {
    let sigma = estimate.sigma();
    let left = |i: &usize| sigma[*i] / prior[*i];
    let known = estimate.estimated().filter(|i| left(i).is_finite());
    known.max_by(|a, b| left(a).total_cmp(&left(b)))
}
