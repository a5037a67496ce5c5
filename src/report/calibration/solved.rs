//! A calibration with its checks and its report.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use super::{ClosedForm as ClosedFormPart, Navigated, Report};
use crate::calibration::result::{InputFile, TermRecord};
use crate::calibration::{
    Assessment, Calibration, CalibrationError, ClosedForm, Estimate, Method, Problem, Reference,
    Solution,
};
use crate::formats::input_digests;
use crate::imu::{PerSensor, Triad};
use crate::report::Document;
use crate::run::{Aiding, Run};
use crate::study::navigation::{Mission, NavigationStudyError};
use crate::survey::{self, Expected};

/// A true calibration, in the general form, with its error terms.
pub struct Truth {
    /// Both triads.
    pub triads: PerSensor<Triad>,
    /// Error terms by name.
    pub terms: BTreeMap<String, TermRecord>,
}

/// A calibration with its checks.
pub struct Calibrated {
    /// The calibration.
    pub calibration: Calibration,
    assessment: Assessment,
}

impl Calibrated {
    /// Checks a solution.
    ///
    /// # Errors
    /// [`CalibrationError`] if the problem is not the one of the solution.
    pub fn new(problem: &Problem, solution: &mut Solution) -> Result<Self, CalibrationError> {
        let assessment = solution.assess(problem)?;
        Ok(Self {
            calibration: solution.calibration(problem, &assessment),
            assessment,
        })
    }

    /// Adds the files that a run.toml or campaign.toml names.
    pub fn of_files(mut self, path: &Path, run: &Run) -> Self {
        stamp(&mut self.calibration, path);
        let is_log = path.extension().is_none_or(|end| end != "toml");
        // No run.toml names the second file of a log.
        for file in run.recording.files.iter().skip(1).filter(|_| is_log) {
            add(&mut self.calibration, file);
        }
        self
    }

    /// Its report.
    pub fn document(
        &self,
        (problem, name): (&Problem, &str),
        solution: &Solution,
        method: Method,
        truth: Option<&Truth>,
    ) -> Document {
        let run = problem.run();
        let method = match method {
            Method::Ekf => "EKF",
            Method::SixPosition => "closed form",
        };
        let assessment = &self.assessment;
        let triads = truth.map(|truth| &truth.triads);
        let navigation = navigate(run, &[(method, solution.estimate())], triads);
        let findings = solution.findings(assessment);
        let note = solution.closed_form().map(note).unwrap_or_default();
        let dwells = dwell_times(problem);
        let form = solution.estimate().form();
        let in_form =
            triads.map(|truth| PerSensor::from_fn(|sensor| truth.get(sensor).in_form(form)));
        let predicted = predicted(problem, solution);
        let no_terms = BTreeMap::new();
        let report = Report {
            title: name,
            run,
            aiding: problem.model.aiding,
            body_frame: self.calibration.body_frame,
            outcome: solution.outcome(),
            findings: &findings,
            effects: &assessment.error_terms,
            budget: assessment.budget.as_ref(),
            predicted: predicted.as_ref(),
            quality: Some(&assessment.quality),
            true_terms: truth.map_or(&no_terms, |truth| &truth.terms),
            closed_form: solution.closed_form().map(|closed_form| ClosedFormPart {
                estimate: &closed_form.estimate,
                note: &note,
            }),
            truth: in_form.as_ref(),
            dwells: &dwells,
            navigation: navigation.as_deref(),
        };
        report.document()
    }
}

/// Predicted accuracy of a single recording; none for several recordings.
fn predicted(problem: &Problem, solution: &Solution) -> Option<Expected> {
    let path = match (solution.closed_form(), problem.model.aiding) {
        (Some(_), _) => return None,
        (None, Aiding::Table) => survey::Path::TableAiding,
        (None, Aiding::Velocity) => survey::Path::VelocityAiding,
    };
    let outcome = solution.outcome()?;
    (outcome.alone.len() < 2)
        .then(|| Expected::of(problem.run(), path).ok())
        .flatten()
}

/// Records the input files in a calibration.
pub fn stamp(calibration: &mut Calibration, path: &Path) {
    if let Some(provenance) = &mut calibration.provenance {
        provenance.inputs.clear();
    }
    add(calibration, path);
}

fn add(calibration: &mut Calibration, path: &Path) {
    if let Some(provenance) = &mut calibration.provenance {
        let inputs = input_digests(path).into_iter();
        let inputs = inputs.map(|(name, sha256)| InputFile { name, sha256 });
        provenance.inputs.extend(inputs);
    }
}

/// Short description of the data used by a closed form.
pub fn note(closed_form: &ClosedForm) -> String {
    let PerSensor { gyro, accel } = closed_form.positions;
    let turns = closed_form.turns;
    let from = match closed_form.reference {
        Reference::Table => {
            format!("{gyro} positions for the gyros, {accel} for the accelerometers")
        }
        Reference::Labels => format!("{accel} labelled positions and {turns} labelled turns"),
        Reference::Gravity => {
            format!("gravity in {accel} dwells and its direction change over {turns} turns")
        }
    };
    let minutes = closed_form.standing_time / 60.0;
    let digits = usize::from(minutes < 10.0);
    format!("{from}, {minutes:.digits$} min at rest")
}

/// Simulates stationary, level navigation at the site of the run with the calibration of each method, for a duration
/// suited to both.
///
/// # Errors
/// [`NavigationStudyError`] if there is no such duration.
pub fn navigate(
    run: &Run,
    methods: &[(&'static str, &Estimate)],
    truth: Option<&PerSensor<Triad>>,
) -> Result<Vec<Navigated>, NavigationStudyError> {
    let estimates: Vec<&Estimate> = methods.iter().map(|(_, estimate)| *estimate).collect();
    let mission = Mission::suited(&run.site, &estimates)?;
    let all = methods.par_iter().map(|&(method, estimate)| {
        let outlook = mission.outlook(estimate, truth)?;
        Ok(Navigated { method, outlook })
    });
    all.collect()
}

/// Start and end of each dwell, s.
pub fn dwell_times(problem: &Problem) -> Vec<Range<f64>> {
    let imu = &problem.run().recording.imu;
    let dwells = problem.dwells();
    dwells
        .map(|dwell| imu.time(dwell.samples.start)..imu.time(dwell.samples.end))
        .collect()
}
