//! How accurate the filter is, and whether its σ are true, over many simulated runs: against the
//! truth, the Cramér–Rao bound, and the closed form on the paper's static positions.
//!
//! Everything is compared in the general form and in the body frame of the table.

mod baseline;
mod trial;

use rayon::prelude::*;

use super::Ratio;
use crate::calibration::outcome::Nis;
use crate::calibration::states::PARAMETERS;
use crate::calibration::{CalibrationError, Group, mean_square_interval};
use crate::imu::InstallationForm;
use crate::models::ModelError;
use crate::simulation::Scenario;
use crate::turntable::TableError;

pub use baseline::Baseline;
pub use trial::{Filtered, Trial};

/// What is studied.
#[derive(Debug, Clone)]
pub struct AccuracyStudy {
    /// What is simulated.
    pub scenario: Scenario,
    /// The filter's installation form; the truth has that of the scenario.
    pub form: InstallationForm,
    /// Number of runs.
    pub runs: u64,
    /// Seed; each run has its own streams of it.
    pub seed: u64,
}

/// A study that cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The closed form's static positions cannot be had.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The path is beyond the table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Not even the bound can be had from a run.
    #[error("run {run} of the study: {source}")]
    Bound {
        /// Its number.
        run: u64,
        /// Why.
        source: CalibrationError,
    },
}

/// The result.
#[derive(Debug, Clone)]
pub struct Accuracy {
    /// What was studied.
    pub study: AccuracyStudy,
    /// How the closed form was made.
    pub baseline: Baseline,
    /// Length of a run of the filter, s.
    pub table_time: f64,
    /// Every run, in order.
    pub trials: Vec<Trial>,
    /// Figures of each group.
    pub groups: Vec<GroupAccuracy>,
    /// NEES/n over all runs; `None` if no run gave an estimate.
    pub anees: Option<Anees>,
    /// NIS of zero velocity over all runs.
    pub velocity: Nis,
    /// NIS of table attitude over all runs.
    pub table: Nis,
}

/// NEES/n averaged over runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anees {
    /// The average.
    pub mean: f64,
    /// n, directions of one run that have a σ.
    pub directions: usize,
    /// 95 % interval of the average if σ are true (χ²).
    pub interval_95: (f64, f64),
    /// 99.8 % interval.
    pub interval_998: (f64, f64),
    /// 95 % interval of a single run.
    pub interval_of_one: (f64, f64),
}

/// Figures of one group of parameters, RMS over its parameters and all runs, in rad/s, m/s² or pure
/// numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupAccuracy {
    /// The group.
    pub group: Group,
    /// RMS error of the filter.
    pub filter: f64,
    /// RMS of the σ that the filter claims.
    pub claimed: f64,
    /// RMS of the Bayesian Cramér–Rao bound.
    pub bound: f64,
    /// Filter over bound.
    pub ratio: Option<Ratio>,
    /// RMS error of the closed form in its own time.
    pub closed_form: Option<f64>,
    /// Closed form in its own time over filter.
    pub gain: Option<Ratio>,
    /// RMS error of the closed form in the filter's time; none if that is too short for it.
    pub closed_form_in_equal_time: Option<f64>,
    /// Closed form in the filter's time over filter.
    pub gain_in_equal_time: Option<Ratio>,
    /// Table time in s against RMS error and RMS bound of the filter.
    pub filter_against_time: Vec<(f64, f64, f64)>,
    /// Table time in s against RMS error of the closed form.
    pub closed_form_against_time: Vec<(f64, f64)>,
}

impl AccuracyStudy {
    /// Makes all runs, on all cores; `done` is told of each. The result does not depend on how many
    /// cores there are.
    ///
    /// # Errors
    /// [`StudyError`] if runs cannot be made. A run that the filter fails on is no error: it is
    /// counted.
    pub fn run(&self, done: &(dyn Fn() + Sync)) -> Result<Accuracy, StudyError> {
        let baseline = Baseline::new(&self.scenario)?;
        let table_time = self.scenario.duration()?;
        let trials: Vec<Trial> = (0..self.runs)
            .into_par_iter()
            .map(|run| {
                let trial = self.trial(&baseline, run);
                done();
                trial
            })
            .collect::<Result<_, _>>()?;
        Ok(Accuracy {
            groups: Group::all()
                .filter_map(|group| GroupAccuracy::new(group, &trials, &baseline, table_time))
                .collect(),
            anees: anees(&trials),
            velocity: pooled(&trials, |filtered| &filtered.velocity),
            table: pooled(&trials, |filtered| &filtered.table),
            study: self.clone(),
            baseline,
            table_time,
            trials,
        })
    }
}

impl Accuracy {
    /// Runs that failed, with the reason.
    pub fn failures(&self) -> impl Iterator<Item = (u64, &str)> {
        self.trials
            .iter()
            .filter_map(|trial| Some((trial.run, trial.failure.as_deref()?)))
    }

    /// Number of runs whose data reject the filter's installation form, and of those tested.
    pub fn rejections(&self) -> (usize, usize) {
        let tests = || {
            let filtered = self.trials.iter().filter_map(|t| t.filtered.as_ref());
            filtered.filter_map(|f| f.form_test)
        };
        (
            tests().filter(|test| test.rejects()).count(),
            tests().count(),
        )
    }
}

impl GroupAccuracy {
    /// None if the form and the body frame leave nothing of the group to be estimated.
    fn new(group: Group, trials: &[Trial], baseline: &Baseline, table_time: f64) -> Option<Self> {
        let estimated = |&i: &usize| trials.iter().any(|trial| trial.bound[i] > 0.0);
        let indices: Vec<usize> = (0..PARAMETERS)
            .filter(|&i| Group::of(i) == group)
            .filter(estimated)
            .collect();
        if indices.is_empty() {
            return None;
        }
        let count = indices.len() as f64;
        // For each run that has what is asked for, the sum of squares of the group.
        let squares = |of: &dyn Fn(&Trial, usize) -> Option<f64>| -> Vec<f64> {
            let sum = |trial| indices.iter().map(|&i| of(trial, i)).sum::<Option<f64>>();
            trials.iter().filter_map(sum).collect()
        };
        let rms = |squares: &[f64]| {
            let runs = squares.len() as f64;
            (squares.iter().sum::<f64>() / (runs * count)).sqrt()
        };
        let some_rms = |squares: &[f64]| (!squares.is_empty()).then(|| rms(squares));
        // A ratio takes only runs that have both.
        let ratio = |over: &dyn Fn(&Trial, usize) -> Option<f64>,
                     under: &dyn Fn(&Trial, usize) -> Option<f64>| {
            let both = |t: &Trial, i: usize| over(t, i).zip(under(t, i));
            Ratio::of(
                &squares(&|t, i| both(t, i).map(|pair| pair.0)),
                &squares(&|t, i| both(t, i).map(|pair| pair.1)),
            )
        };
        let filter = |t: &Trial, i: usize| Some(t.filtered.as_ref()?.error[i].powi(2));
        let claimed = |t: &Trial, i: usize| Some(t.filtered.as_ref()?.sigma[i].powi(2));
        let bound = |t: &Trial, i: usize| Some(t.bound[i].powi(2));
        let closed = |part: usize| {
            move |t: &Trial, i: usize| Some(t.closed_form.get(part)?.as_ref()?[i].powi(2))
        };
        let (own, equal) = (closed(Baseline::OWN_TIME), closed(Baseline::EQUAL_TIME));
        let moments = trial::moments(table_time);
        let track = |m: usize| {
            move |t: &Trial, i: usize| Some(t.filtered.as_ref()?.track.get(m)?[i].powi(2))
        };
        let bound_track =
            |m: usize| move |t: &Trial, i: usize| Some(t.bound_track.get(m)?[i].powi(2));
        Some(Self {
            group,
            filter: rms(&squares(&filter)),
            claimed: rms(&squares(&claimed)),
            bound: rms(&squares(&bound)),
            ratio: ratio(&filter, &bound),
            closed_form: some_rms(&squares(&own)),
            gain: ratio(&own, &filter),
            closed_form_in_equal_time: some_rms(&squares(&equal)),
            gain_in_equal_time: ratio(&equal, &filter),
            filter_against_time: moments
                .enumerate()
                .map(|(m, time)| {
                    (
                        time,
                        rms(&squares(&track(m))),
                        rms(&squares(&bound_track(m))),
                    )
                })
                .collect(),
            closed_form_against_time: baseline
                .parts()
                .filter_map(|(part, time)| Some((time, some_rms(&squares(&closed(part)))?)))
                .collect(),
        })
    }
}

fn anees(trials: &[Trial]) -> Option<Anees> {
    let all = || {
        let filtered = trials.iter().filter_map(|trial| trial.filtered.as_ref());
        filtered.filter_map(|filtered| filtered.nees)
    };
    let count: usize = all().map(|nees| nees.count).sum();
    let first = all().next()?;
    Some(Anees {
        mean: all().map(|nees| nees.mean * nees.count as f64).sum::<f64>() / count as f64,
        directions: first.count,
        interval_95: mean_square_interval(count, 0.05),
        interval_998: mean_square_interval(count, 0.002),
        interval_of_one: first.interval,
    })
}

/// One NIS of all runs.
fn pooled(trials: &[Trial], of: impl Fn(&Filtered) -> &Nis) -> Nis {
    let filtered = trials.iter().filter_map(|trial| trial.filtered.as_ref());
    let all: Vec<&Nis> = filtered.map(of).filter(|nis| nis.count > 0).collect();
    let count = all.iter().map(|nis| nis.count).sum::<usize>();
    let mean = |value: &dyn Fn(&Nis) -> f64| {
        let sum: f64 = all.iter().map(|nis| value(nis) * nis.count as f64).sum();
        sum / count as f64
    };
    Nis {
        mean: mean(&|nis| nis.mean),
        count,
        interval: mean_square_interval(count, 0.002),
        lag_one: mean(&|nis| nis.lag_one),
    }
}
