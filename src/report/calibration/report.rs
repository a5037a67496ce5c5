//! What the report of a calibration is made of.

use std::collections::BTreeMap;
use std::ops::Range;

use super::super::navigation::Navigated;
use crate::calibration::result::TermRecord;
use crate::calibration::{
    Budget, ErrorTermTest, Estimate, Finding, Outcome, ParameterVector, Quality, to_vector,
};
use crate::imu::{BodyFrame, PerSensor, Triad};
use crate::recording::TableLog;
use crate::run::{Aiding, Run};
use crate::study::navigation::NavigationStudyError;
use crate::survey::Expected;

/// What a report is made of. Every estimate and the truth have the same installation form and the same body
/// frame.
#[derive(Debug, Clone, Copy)]
pub struct Report<'a> {
    /// Heading of the page.
    pub title: &'a str,
    /// The record.
    pub run: &'a Run,
    /// What was observed at rest.
    pub aiding: Aiding,
    /// What fixes the body axes.
    pub body_frame: BodyFrame,
    /// The filter's result, if it ran.
    pub outcome: Option<&'a Outcome>,
    /// What must be known before the figures are used.
    pub findings: &'a [Finding],
    /// What error terms did to it, or would do.
    pub effects: &'a [ErrorTermTest],
    /// Where the uncertainty of the filter's result comes from.
    pub budget: Option<&'a Budget>,
    /// The closed form's result, if there is one.
    pub closed_form: Option<ClosedForm<'a>>,
    /// The true triads, where they are known.
    pub truth: Option<&'a PerSensor<Triad>>,
    /// True auxiliary parameters by name, as far as they are known.
    pub true_terms: &'a BTreeMap<String, TermRecord>,
    /// What was to be expected of such a record, where that is known.
    pub predicted: Option<&'a Expected>,
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
}

impl Report<'_> {
    /// The estimate that the report is about.
    pub(super) fn estimate(&self) -> Option<&Estimate> {
        let filtered = self.outcome.map(|outcome| &outcome.estimate);
        filtered.or(self.closed_form.map(|closed| closed.estimate))
    }

    /// The table's readings, where they were observed.
    pub(super) fn table(&self) -> Option<&TableLog> {
        self.run.observed_table(self.aiding)
    }

    pub(super) fn truth_vector(&self) -> Option<ParameterVector> {
        self.truth.map(to_vector)
    }

    /// Begin and end of the record, s.
    pub(super) fn time_span(&self) -> (f64, f64) {
        let imu = &self.run.recording.imu;
        (imu.start(), imu.end())
    }

    /// Both methods that ran, the closed form first.
    pub(super) fn methods(&self) -> Vec<(&'static str, &Estimate)> {
        let closed = self
            .closed_form
            .map(|closed| ("closed form", closed.estimate));
        let filter = self.outcome.map(|outcome| ("EKF", &outcome.estimate));
        closed.into_iter().chain(filter).collect()
    }
}
