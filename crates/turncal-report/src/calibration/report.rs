//! Input of the report on a calibration.

use std::collections::BTreeMap;
use std::ops::Range;

use turncal::calibration::result::TermRecord;
use turncal::calibration::{
    Budget, Calibration, Estimate, Finding, Outcome, ParameterVector, Quality, to_vector,
};
use turncal::imu::{BodyFrame, PerSensor, Triad};
use turncal::lot::Specification;
use turncal::recording::TableLog;
use turncal::run::{Aiding, Run};
use turncal::study::navigation::{MethodOutlook, NavigationStudyError};
use turncal::survey::Expected;

/// Input of a report. All estimates and the truth have the same installation form and body frame.
#[derive(Debug, Clone, Copy)]
pub struct Report<'a> {
    /// Heading of the page.
    pub title: &'a str,
    /// The recording.
    pub run: &'a Run,
    /// Observations at rest.
    pub aiding: Aiding,
    /// Definition of the body axes.
    pub body_frame: BodyFrame,
    /// The filter result, if the filter ran.
    pub outcome: Option<&'a Outcome>,
    /// Findings to read before using the results.
    pub findings: &'a [Finding],
    /// Uncertainty budget of the filter result.
    pub budget: Option<&'a Budget>,
    /// The closed-form result, if any.
    pub closed_form: Option<ClosedForm<'a>>,
    /// The calibration as a file.
    pub calibration: &'a Calibration,
    /// The true triads, if known.
    pub truth: Option<&'a PerSensor<Triad>>,
    /// True auxiliary parameters by name, if known.
    pub true_terms: &'a BTreeMap<String, TermRecord>,
    /// Limits of the parameters, if any.
    pub specification: Option<&'a Specification>,
    /// Predicted accuracy, if known.
    pub predicted: Option<&'a Expected>,
    /// Residuals at rest and after turns.
    pub quality: Option<&'a Quality>,
    /// Dwells, s.
    pub dwells: &'a [Range<f64>],
    /// Navigation errors with each calibration, the closed form first; or the reason why there are none.
    pub navigation: Result<&'a [MethodOutlook], &'a NavigationStudyError>,
}

/// The closed-form result, the baseline of the comparison.
#[derive(Debug, Clone, Copy)]
pub struct ClosedForm<'a> {
    /// The estimate of the closed form with its stated σ.
    pub estimate: &'a Estimate,
    /// The data that the closed form used, such as `six positions, 60 min of its own`.
    pub note: &'a str,
}

impl Report<'_> {
    /// The estimate that the report describes.
    pub fn estimate(&self) -> Option<&Estimate> {
        let filtered = self.outcome.map(|outcome| &outcome.estimate);
        filtered.or(self.closed_form.map(|closed| closed.estimate))
    }

    /// The table readings, if observed.
    pub fn table(&self) -> Option<&TableLog> {
        self.run.observed_table(self.aiding)
    }

    /// The true parameters, if known.
    pub fn truth_vector(&self) -> Option<ParameterVector> {
        self.truth.map(to_vector)
    }

    /// Start and end of the recording, s.
    pub fn time_span(&self) -> (f64, f64) {
        let imu = &self.run.recording.imu;
        (imu.start(), imu.end())
    }
}
