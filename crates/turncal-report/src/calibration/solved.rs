//! Report on a solved problem.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{ClosedForm as ClosedFormPart, Report};
use crate::Document;
use turncal::calibration::result::TermRecord;
use turncal::calibration::{ClosedForm, Problem, Reference};
use turncal::imu::{PerSensor, Triad};
use turncal::lot::Specification;
use turncal::study::{CheckedCalibration, Consequences};

/// The true calibration in the general form, with its error terms.
pub struct Truth {
    /// Both triads.
    pub triads: PerSensor<Triad>,
    /// Error terms by name.
    pub terms: BTreeMap<String, TermRecord>,
}

/// The report on the calibration of a problem with this name, and on its effect on navigation.
pub fn document(
    (problem, name): (&Problem, &str),
    (checked, consequences): (&CheckedCalibration, &Consequences),
    truth: Option<&Truth>,
) -> Document {
    within((problem, name), (checked, consequences), truth, None)
}

/// Adds the limits that the calibration must meet.
pub fn within(
    (problem, name): (&Problem, &str),
    (checked, consequences): (&CheckedCalibration, &Consequences),
    truth: Option<&Truth>,
    specification: Option<&Specification>,
) -> Document {
    let CheckedCalibration {
        solution,
        assessment,
        calibration,
    } = checked;
    let note = solution.closed_form().map(note).unwrap_or_default();
    let form = solution.estimate().form();
    let in_form =
        truth.map(|truth| PerSensor::from_fn(|sensor| truth.triads.get(sensor).in_form(form)));
    let no_terms = BTreeMap::new();
    let report = Report {
        title: name,
        run: problem.run(),
        aiding: problem.model.aiding,
        body_frame: calibration.body_frame,
        outcome: solution.outcome(),
        findings: solution.findings(),
        calibration,
        budget: assessment.budget.as_ref(),
        specification,
        predicted: consequences.predicted.as_ref(),
        quality: Some(&assessment.quality),
        true_terms: truth.map_or(&no_terms, |truth| &truth.terms),
        closed_form: solution.closed_form().map(|closed_form| ClosedFormPart {
            estimate: &closed_form.estimate,
            note: &note,
        }),
        truth: in_form.as_ref(),
        dwells: &dwell_times(problem),
        navigation: consequences.navigation.as_deref(),
    };
    report.document()
}

/// Short description of the data that a closed form used.
pub fn note(closed_form: &ClosedForm) -> String {
    let PerSensor { gyro, accel } = closed_form.positions;
    let turns = closed_form.turns;
    let from = match closed_form.reference {
        Reference::Table => {
            format!("{gyro} positions for the gyros, {accel} for the accelerometers")
        }
        Reference::Labels => format!("{accel} labelled positions and {turns} labelled turns"),
        Reference::Gravity => {
            format!("gravity in {accel} dwells and the change of its direction over {turns} turns")
        }
        Reference::GravityAlone => format!("the magnitude of gravity in {accel} dwells"),
    };
    let minutes = closed_form.standing_time / 60.0;
    let digits = usize::from(minutes < 10.0);
    format!("{from}, {minutes:.digits$} min at rest")
}

/// Start and end of each dwell, s.
pub fn dwell_times(problem: &Problem) -> Vec<Range<f64>> {
    let imu = &problem.run().recording.imu;
    let dwells = problem.dwells();
    dwells
        .map(|dwell| imu.time(dwell.samples.start)..imu.time(dwell.samples.end))
        .collect()
}
