//! A calibration in progress: its expected accuracy so far, and the next move.

use nalgebra::Vector3;

use super::advice::{Advisor, Move};
use super::{GroupSigma, Survey, bound_of_record, by_group, unobserved};
use crate::calibration::{
    Bound, CalibrationError, Estimate, Group, Method, Options, Problem, Solution, UNWATCHED,
};
use crate::earth::Site;
use crate::imu::Instrument;
use crate::lot::{Check, Limit, Sample, Specification, Verdict, checks};
use crate::recording::{Recording, SampleError};
use crate::run::Run;

/// Interval between evaluations, s.
const EVERY: f64 = 1.0;

/// State of a calibration in progress.
#[derive(Debug, Clone)]
pub struct Status {
    /// Duration of the record, s.
    pub duration: f64,
    /// Content of the rows: dwells, turns, contradictions.
    pub survey: Survey,
    /// Time for which the instrument has been at rest, s; zero while it moves.
    pub still: f64,
    /// Expected σ, or the reason why there is none yet.
    pub expected: Result<Attained, CalibrationError>,
    /// The next move; `None` if nothing is missing.
    pub next: Option<Move>,
}

/// Accuracy of the rows so far.
#[derive(Debug, Clone)]
pub struct Attained {
    /// Expected covariance, and its history.
    pub bound: Bound,
    /// For each dwell: the time of its end in s, and the expected σ at that time. If the expected σ are small enough to
    /// decide every limit, those of the last dwell are the σ of a calibration.
    pub history: Vec<(f64, GroupSigma)>,
    /// Parameters that keep more than half of their prior σ.
    pub unobserved: Vec<String>,
    /// Every limit of the specification, for a unit at its nominal values.
    pub checks: Vec<Check>,
}

impl Status {
    /// State of the recording so far.
    pub fn of(run: &Run, specification: Option<&Specification>, advisor: &mut Advisor) -> Self {
        let imu = &run.recording.imu;
        let survey = Survey::of_motion(run);
        let last = survey.rests.last();
        let standing = last.filter(|rest| rest.dwell.samples.end == imu.len());
        let still = standing.map_or(0.0, |rest| rest.dwell.duration(imu));
        let up = last.map_or(Vector3::z(), |rest| rest.force.normalize());
        let bound = bound_of_record(run, &Options::default());
        let expected = bound.map(|bound| Attained::new(run, &survey, bound, specification));
        let next = match &expected {
            Ok(attained) if attained.is_met() => None,
            Ok(Attained { bound, checks, .. }) => {
                advisor.next(run, &up, (bound, checks), specification)
            }
            Err(_) => Some(advisor.first(&survey)),
        };
        Self {
            duration: imu.duration(),
            survey,
            still,
            expected,
            next,
        }
    }

    /// Whether a specification is given and every limit can be decided.
    pub fn is_met(&self) -> bool {
        self.expected.as_ref().is_ok_and(Attained::is_met)
    }
}

impl Attained {
    /// By expected σ, which lack the noise that only a calibration finds; if they are small enough, by a calibration.
    fn new(
        run: &Run,
        survey: &Survey,
        bound: Bound,
        specification: Option<&Specification>,
    ) -> Self {
        let (estimate, sigma) = (&bound.estimate, bound.estimate.sigma());
        let ends = survey.rests.iter().map(|rest| rest.dwell.times(run)[1]);
        let history = ends.filter_map(|end| {
            let mut epochs = bound.history.iter();
            let at_end = epochs.rfind(|epoch| epoch.time <= end + 0.5 * EVERY)?;
            Some((end, by_group(&at_end.sigma, estimate)))
        });
        let mut attained = Self {
            history: history.collect(),
            unobserved: unobserved(&sigma, &bound.prior_sigma, estimate),
            checks: specification.map_or_else(Vec::new, |of| decided(of, estimate)),
            bound,
        };
        if let (true, Some(specification)) = (attained.is_met(), specification) {
            attained.calibrate(run, specification);
        }
        attained
    }

    /// Replaces the checks and the last σ by those of a calibration; no limit is decided if it fails.
    fn calibrate(&mut self, run: &Run, specification: &Specification) {
        let problem = Problem::new(run, &Options::default());
        let calibrated = problem.solve(Method::Ekf, UNWATCHED);
        let calibrated = calibrated.and_then(|mut solution| {
            solution.assess(&problem)?;
            Ok(solution)
        });
        let usable = calibrated.ok().filter(Solution::is_usable);
        let Some(solution) = usable else {
            let open = |check: &mut Check| check.verdict = Verdict::NotDecided;
            return self.checks.iter_mut().for_each(open);
        };
        let estimate = solution.estimate();
        self.checks = decided(specification, estimate);
        if let Some((_, last)) = self.history.last_mut() {
            *last = by_group(&estimate.sigma(), estimate);
        }
    }

    /// Whether a specification is given and every limit can be decided.
    pub fn is_met(&self) -> bool {
        let decided = |check: &Check| check.verdict == Verdict::Pass;
        !self.checks.is_empty() && self.checks.iter().all(decided)
    }
}

/// A unit at its nominal values against every limit of an estimated parameter: it passes if the σ of an estimate are
/// small enough to decide the limit.
pub fn decided(specification: &Specification, estimate: &Estimate) -> Vec<Check> {
    let sigma = estimate.in_general_form().sigma();
    let mut specification = specification.clone();
    // Parameters that the body frame fixes have no error.
    specification
        .limits
        .retain(|limit| sigma[limit.parameter] > 0.0);
    checks(&specification, |parameter| {
        let mut limits = specification.limits.iter();
        let limit = limits.find(|limit| limit.parameter == parameter)?;
        Some(Sample {
            value: limit.nominal,
            sigma: sigma[parameter],
        })
    })
}

/// σ of a group's parameters that decides its tightest limit for a unit at its nominal values; `None` without a limit.
pub fn needed(specification: &Specification, group: Group) -> Option<f64> {
    let of_group = |limit: &&Limit| Group::of(limit.parameter) == group;
    let limits = specification.limits.iter().filter(of_group);
    let tightest = limits.map(|limit| limit.within).reduce(f64::min)?;
    Some(specification.deciding_sigma(tightest))
}

/// A calibration in progress, whose samples are pushed as they arrive. It has no thread of its own.
///
/// Rates are in rad/s and specific forces in m/s², along right-front-up body axes, one sample per period.
#[derive(Debug, Clone)]
pub struct Session {
    instrument: Instrument,
    site: Site,
    period: f64,
    specification: Option<Specification>,
    advisor: Advisor,
    gyro: Vec<Vector3<f64>>,
    accel: Vec<Vector3<f64>>,
    evaluated: usize,
}

impl Session {
    /// A session without samples, for an instrument with this sample period in s.
    pub fn new(instrument: Instrument, site: Site, period: f64) -> Self {
        Self {
            instrument,
            site,
            period,
            specification: None,
            advisor: Advisor::default(),
            gyro: Vec::new(),
            accel: Vec::new(),
            evaluated: 0,
        }
    }

    /// Sets the limits that the calibration is to decide.
    pub fn to_decide(self, specification: Specification) -> Self {
        Self {
            specification: Some(specification),
            ..self
        }
    }

    /// Adds samples; returns `None` until another second of samples has arrived. An evaluation takes some tens of
    /// milliseconds, and as long as a calibration once the specification seems to be met.
    ///
    /// # Errors
    /// [`SampleError`] if a number is not finite, the triads differ in length, or the period is not positive. The
    /// samples are then not added.
    pub fn push(
        &mut self,
        gyro: &[Vector3<f64>],
        accel: &[Vector3<f64>],
    ) -> Result<Option<Status>, SampleError> {
        if gyro.is_empty() && accel.is_empty() {
            return Ok(None);
        }
        Recording::from_samples("", 0.0, self.period, gyro.to_vec(), accel.to_vec())?;
        let integral = |of: &Vector3<f64>| of * self.period;
        self.gyro.extend(gyro.iter().map(integral));
        self.accel.extend(accel.iter().map(integral));
        let new = (self.gyro.len() - self.evaluated) as f64 * self.period;
        (new >= EVERY).then(|| self.status()).transpose()
    }

    /// The state with all samples so far.
    ///
    /// # Errors
    /// [`SampleError`] if there are none.
    pub fn status(&mut self) -> Result<Status, SampleError> {
        self.evaluated = self.gyro.len();
        let run = self.run()?;
        Ok(Status::of(
            &run,
            self.specification.as_ref(),
            &mut self.advisor,
        ))
    }

    /// The run of all samples so far, ready for calibration.
    ///
    /// # Errors
    /// [`SampleError`] if there are none.
    pub fn run(&self) -> Result<Run, SampleError> {
        let (gyro, accel) = (self.gyro.clone(), self.accel.clone());
        let recording = Recording::from_samples("session", 0.0, self.period, gyro, accel)?;
        Ok(Run::new(recording, self.instrument.clone(), self.site))
    }
}
