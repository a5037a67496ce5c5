//! A calibration in progress: its expected accuracy so far, and the next move.

use nalgebra::Vector3;

use super::advice::{Advisor, Move};
use super::{Survey, bound_of_record};
use crate::calibration::{
    Bound, CalibrationError, Group, OBSERVED_BELOW, Options, ParameterVector, parameter_name,
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
    pub expected: Result<Progress, CalibrationError>,
    /// The next move; `None` if nothing is missing.
    pub next: Option<Move>,
}

/// RMS σ of each group's parameters, rad/s or m/s² normalised; `None` if all are fixed.
pub type GroupSigma = Vec<(Group, Option<f64>)>;

/// Expected σ of the rows so far.
#[derive(Debug, Clone)]
pub struct Progress {
    /// Covariance, and its history.
    pub bound: Bound,
    /// For each dwell: the time of its end in s, and the expected RMS σ of each group's parameters at that time, rad/s
    /// or m/s² normalised.
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
        let expected = bound.map(|bound| Progress::new(run, &survey, bound, specification));
        let next = match &expected {
            Ok(progress) if progress.is_met() => None,
            Ok(Progress { bound, checks, .. }) => {
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
        self.expected.as_ref().is_ok_and(Progress::is_met)
    }
}

impl Progress {
    fn new(
        run: &Run,
        survey: &Survey,
        bound: Bound,
        specification: Option<&Specification>,
    ) -> Self {
        let sigma = bound.estimate.sigma();
        let ends = survey.rests.iter().map(|rest| rest.dwell.times(run)[1]);
        let history = ends.filter_map(|end| {
            let before = bound
                .history
                .iter()
                .take_while(|epoch| epoch.time <= end + 0.5 * EVERY);
            let at_end = before.last()?;
            let groups = Group::all().map(|group| {
                let indices = group.estimated(&bound.estimate);
                (group, rms(&at_end.sigma, &indices))
            });
            Some((end, groups.collect()))
        });
        let form = bound.estimate.form();
        let hidden = |&k: &usize| sigma[k] > OBSERVED_BELOW * bound.prior_sigma[k];
        let hidden = bound.estimate.estimated().filter(hidden);
        Self {
            history: history.collect(),
            unobserved: hidden.filter_map(|k| parameter_name(form, k)).collect(),
            checks: specification
                .map(|of| decided(of, &bound))
                .unwrap_or_default(),
            bound,
        }
    }

    /// Whether a specification is given and every limit can be decided.
    pub fn is_met(&self) -> bool {
        let decided = |check: &Check| check.verdict == Verdict::Pass;
        !self.checks.is_empty() && self.checks.iter().all(decided)
    }
}

/// A unit at its nominal values against every limit of an estimated parameter: it passes if the expected σ are small
/// enough to decide the limit.
pub fn decided(specification: &Specification, bound: &Bound) -> Vec<Check> {
    let sigma = bound.estimate.in_general_form().sigma();
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

fn rms(sigma: &ParameterVector, indices: &[usize]) -> Option<f64> {
    let sum: f64 = indices.iter().map(|&k| sigma[k].powi(2)).sum();
    (!indices.is_empty()).then(|| (sum / indices.len() as f64).sqrt())
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

    /// Adds samples; returns `None` until another second of samples has arrived.
    ///
    /// # Errors
    /// [`SampleError`] if a number is not finite, the triads differ in length, or the period is not positive. The
    /// samples are then not added.
    pub fn push(
        &mut self,
        gyro: &[Vector3<f64>],
        accel: &[Vector3<f64>],
    ) -> Result<Option<Status>, SampleError> {
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
