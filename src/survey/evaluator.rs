//! Accuracy of a recording in progress, and the next move.

use nalgebra::SVector;

use super::advice::{Advisor, Move};
use super::attained::{Attained, Reached, are_decided, decided};
use super::{Survey, bound_of_record, by_group, unobserved};
use crate::calibration::result::MagRecord;
use crate::calibration::{
    Bound, CalibrationError, Finding, MagneticEstimate, MagneticMatrix, Method, Options,
    ParameterVector, Problem, Progress, Verdict, Word,
};
use crate::lot::{self, Specification};
use crate::magnetic::MagneticVector;
use crate::run::Run;

/// A recording is calibrated again after it has grown by this factor. Together, all calibrations then take at most
/// three times as long as the last one.
pub const GROWTH: f64 = 1.5;
/// Spacing of the epochs of a history, s.
const EPOCH: f64 = 1.0;

/// State of a calibration in progress.
#[derive(Debug, Clone)]
pub struct Status {
    /// Duration of the recording, s.
    pub duration: f64,
    /// Content of the rows: dwells, turns and contradictions.
    pub survey: Survey,
    /// Time for which the instrument has been at rest, s; zero while it moves.
    pub still: f64,
    /// Expected σ, or the reason why σ cannot be predicted yet.
    pub expected: Result<Attained, CalibrationError>,
    /// The last calibration, from the rows at that time; `None` if it failed.
    pub calibrated: Option<InterimCalibration>,
    /// The next move; `None` if no further move is needed.
    pub next: Option<Move>,
    /// Whether this move is recommended because the magnetometer lacks its attitude.
    pub is_for_magnetometer: bool,
}

/// A calibration of the rows so far. Only a calibration shows the actual noise, unmodelled errors, and the resulting σ.
#[derive(Debug, Clone)]
pub struct InterimCalibration {
    /// Duration of the recording at the time of the calibration, s.
    pub duration: f64,
    /// Verdict.
    pub verdict: Verdict,
    /// Findings.
    pub findings: Vec<Finding>,
    /// Whether a specification is given and the σ are small enough to decide every limit.
    pub is_met: bool,
    /// σ relative to those of the bound: parameters, and constants of the magnetometer.
    inflation: (ParameterVector, MagneticVector),
}

/// Evaluates a recording repeatedly while it grows.
#[derive(Debug, Clone, Default)]
pub struct Evaluator {
    options: Options,
    specification: Option<Specification>,
    advisor: Advisor,
    calibrated: Option<InterimCalibration>,
    /// Duration of the recording at the last attempt to calibrate it, s.
    attempted: f64,
}

impl Evaluator {
    /// An evaluator with these options and, optionally, limits that must be decided.
    pub fn new(options: Options, specification: Option<Specification>) -> Self {
        Self {
            options,
            specification,
            ..Self::default()
        }
    }

    /// The limits that must be decided.
    pub fn specification(&self) -> Option<&Specification> {
        self.specification.as_ref()
    }

    /// State of the recording so far; calibrates the recording first if a calibration is due.
    pub fn status(&mut self, run: &Run, progress: Progress) -> Status {
        let status = self.outlook(run);
        let Some(due) = self.due(run, &status) else {
            return status;
        };
        self.take(due.calibrate(progress));
        self.outlook(run)
    }

    /// State of the recording so far, without a calibration: the σ are those of the last calibration, changed by the
    /// expected effect of later rows.
    pub fn outlook(&mut self, run: &Run) -> Status {
        let imu = &run.recording.imu;
        let survey = Survey::of_motion(run);
        let last = survey.rests.last();
        let standing = last.filter(|rest| rest.dwell.samples.end == imu.len());
        let still = standing.map_or(0.0, |rest| rest.dwell.duration(imu));
        let expected = bound_of_record(run, &self.options);
        let expected = expected.map(|bound| self.of_bound(run, &survey, bound));
        let calibrated = self.calibrated.clone();
        let next = match &expected {
            _ if calibrated.as_ref().is_some_and(|of| of.is_met) => None,
            Ok(attained) => {
                self.advisor
                    .next((run, &survey), attained, self.specification.as_ref())
            }
            Err(_) => Some((self.advisor.first(&survey), false)),
        };
        Status {
            duration: imu.duration(),
            survey,
            still,
            expected,
            calibrated,
            next: next.map(|(next, _)| next),
            is_for_magnetometer: next.is_some_and(|(_, is_for_magnetometer)| is_for_magnetometer),
        }
    }

    /// The calibration that is due in this state: a calibration is due each time the recording has grown by half, and
    /// when every limit seems to be decided.
    pub fn due(&mut self, run: &Run, status: &Status) -> Option<Due> {
        let attained = status.expected.as_ref().ok()?;
        let seems_met = status.duration > self.attempted && attained.is_met();
        if status.duration < GROWTH * self.attempted && !seems_met {
            return None;
        }
        self.attempted = status.duration;
        Some(Due {
            run: run.clone(),
            options: self.options.clone(),
            specification: self.specification.clone(),
            bound: attained.bound.clone(),
        })
    }

    /// Accepts the result of the calibration that was due.
    pub fn take(&mut self, calibrated: Option<InterimCalibration>) {
        self.calibrated = calibrated;
    }

    fn of_bound(&self, run: &Run, survey: &Survey, bound: Bound) -> Attained {
        let estimate = &bound.estimate;
        let one = (ParameterVector::repeat(1.0), MagneticVector::repeat(1.0));
        let calibrated = self.calibrated.as_ref();
        let (inflation, of_magnetometer) = calibrated.map_or(one, |of| of.inflation);
        let ends = survey.rests.iter().map(|rest| rest.dwell.times(run)[1]);
        let history = ends.filter_map(|end| {
            let mut epochs = bound.history.iter();
            let at_end = epochs.rfind(|epoch| epoch.time <= end + 0.5 * EPOCH)?;
            let sigma = at_end.sigma.component_mul(&inflation);
            let magnetic = at_end.magnetic.map(|of| of.component_mul(&of_magnetometer));
            Some(Reached {
                time: end,
                sigma: by_group(&sigma, estimate),
                magnetic: magnetic.and_then(|sigma| shown(run, &bound, &sigma)),
            })
        });
        let history = history.collect();
        let mut inflated = estimate.clone();
        for (i, part) in inflation.iter().enumerate() {
            inflated.covariance.row_mut(i).scale_mut(*part);
            inflated.covariance.column_mut(i).scale_mut(*part);
        }
        let mut checks = self
            .specification
            .as_ref()
            .map_or_else(Vec::new, |of| decided(of, &inflated));
        let is_usable = |of: &InterimCalibration| of.verdict.word != Word::Failed;
        if !self.calibrated.as_ref().is_some_and(is_usable) {
            checks
                .iter_mut()
                .for_each(|check| check.verdict = lot::Verdict::NotDecided);
        }
        Attained {
            history,
            unobserved: unobserved(&inflated.sigma(), &bound.prior_sigma, estimate),
            checks,
            inflation,
            bound,
        }
    }
}

/// RMS σ of matrix and bias in the quantity of the log, if the output depends on the field.
fn shown(run: &Run, bound: &Bound, sigma: &MagneticVector) -> Option<[(f64, String); 2]> {
    let mut estimate = bound.magnetic.clone().filter(MagneticEstimate::is_shown)?;
    estimate.covariance = MagneticMatrix::from_diagonal(&sigma.component_mul(sigma));
    let log = run.recording.magnetometer.as_ref()?;
    MagRecord::of_estimate(&estimate, log)?.shown_sigma()
}

/// Found σ divided by expected σ; one if either is not known.
fn ratio<const N: usize>(found: &SVector<f64, N>, expected: &SVector<f64, N>) -> SVector<f64, N> {
    found.zip_map(expected, |found, expected| {
        let is_known = found > 0.0 && expected > 0.0;
        if is_known { found / expected } else { 1.0 }
    })
}

/// Rows to calibrate, possibly in another thread.
#[derive(Debug)]
pub struct Due {
    run: Run,
    options: Options,
    specification: Option<Specification>,
    bound: Bound,
}

impl Due {
    /// Calibrates the rows; `None` if that fails, or progress is stopped.
    pub fn calibrate(&self, progress: Progress) -> Option<InterimCalibration> {
        let problem = Problem::new(&self.run, &self.options);
        let solution = problem.solve(Method::Ekf, progress).ok()?;
        let findings = solution.findings().to_vec();
        let verdict = Verdict::of(&findings);
        let found = solution.outcome().and_then(|of| of.magnetic.as_ref());
        let [found, expected] = [found, self.bound.magnetic.as_ref()]
            .map(|of| of.map(MagneticEstimate::sigma).unwrap_or_default());
        let is_met = verdict.word != Word::Failed
            && self.specification.as_ref().is_some_and(|specification| {
                are_decided(&decided(specification, solution.estimate()))
            });
        Some(InterimCalibration {
            duration: self.run.recording.imu.duration(),
            verdict,
            findings,
            is_met,
            inflation: (
                ratio(&solution.estimate().sigma(), &self.bound.estimate.sigma()),
                ratio(&found, &expected),
            ),
        })
    }
}

impl Status {
    /// Whether a specification is given and the σ of the last calibration decide every limit.
    pub fn is_met(&self) -> bool {
        self.calibrated.as_ref().is_some_and(|of| of.is_met)
    }
}
