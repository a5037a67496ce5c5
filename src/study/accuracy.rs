//! Accuracy of the filter and consistency of its σ over many simulated runs, compared with the truth, the Cramér–Rao
//! bound, and the closed form on the static positions of the paper.
//!
//! All values are compared in the general form and in the body frame of the table.

mod baseline;
mod configuration;
mod figures;
mod navigation;
mod trial;

use super::navigation::NavigationStudyError;
use super::{Study, StudyError};
use crate::calibration::{ErrorTerm, Group, Nis, TermEvidence, mean_square_interval};
use crate::imu::InstallationForm;
use crate::simulation::Runs;

use navigation::Way;

pub use baseline::Baseline;
pub use configuration::AccuracyStudy;
pub use figures::Figures;
pub use navigation::{Containment, Journey, NavigationAccuracy, Position, Region};
pub use trial::{Filtered, Trial};

/// Result of the study.
#[derive(Debug, Clone)]
pub struct Accuracy {
    /// The configuration.
    pub study: AccuracyStudy,
    /// The runs of the closed form.
    pub baseline: Baseline,
    /// Length of a run of the filter, s.
    pub table_time: f64,
    /// Every run, in order.
    pub trials: Vec<Trial>,
    /// Figures for each group with at least one estimated parameter, RMS over its parameters, in rad/s, m/s² or pure
    /// numbers.
    pub groups: Vec<(Group, Figures)>,
    /// Navigation accuracy of the calibrations in each mission.
    pub navigation: Vec<NavigationAccuracy>,
    /// Missions that cannot be navigated from the scenario's site.
    pub not_navigated: Vec<(Journey, NavigationStudyError)>,
    /// NEES/n over all runs; `None` if no run gave an estimate.
    pub anees: Option<Anees>,
    /// Figures of each error term that was estimated, RMS over its parameters, in rad or SI.
    pub error_terms: Vec<(ErrorTerm, Figures)>,
    /// Evidence for each error term, from the first run.
    pub effects: Vec<TermEvidence>,
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
    /// n, the number of directions with a σ in one run.
    pub directions: usize,
    /// 95 % interval of the average if the σ are correct (χ²).
    pub interval_95: (f64, f64),
    /// 99.8 % interval.
    pub interval_998: (f64, f64),
}

impl Study for AccuracyStudy {
    type Trial = Trial;
    type Outcome = Accuracy;

    fn runs(&self) -> u64 {
        self.runs
    }

    fn maker(&self) -> Result<impl Fn(u64) -> Result<Trial, StudyError> + Sync, StudyError> {
        let baseline = Baseline::new(&self.scenario)?;
        let simulated = [Runs::new(&self.scenario)?, Runs::new(&baseline.scenario)?];
        Ok(move |run| self.trial(&baseline, &simulated, run))
    }

    fn outcome(&self, trials: Vec<Trial>) -> Result<Accuracy, StudyError> {
        let baseline = Baseline::new(&self.scenario)?;
        let table_time = self.scenario.duration()?;
        let (mut navigation, mut not_navigated) = (Vec::new(), Vec::new());
        for journey in Journey::ALL {
            match Way::of(journey, &self.scenario) {
                Ok(way) => navigation.push(way.worth(&trials)),
                Err(StudyError::Navigation(error)) => not_navigated.push((journey, error)),
                Err(error) => return Err(error),
            }
        }
        let effects = trials.first().map(|trial| trial.effects.clone());
        Ok(Accuracy {
            groups: figures::of_groups(&trials),
            navigation,
            not_navigated,
            error_terms: figures::of_error_terms(&trials),
            effects: effects.unwrap_or_default(),
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
    /// Results of the filter in the runs in which the filter did not fail.
    pub fn filtered(&self) -> impl Iterator<Item = &Filtered> {
        filtered(&self.trials)
    }

    /// The misalignment forms of the filter and of the truth.
    pub fn forms(&self) -> (InstallationForm, InstallationForm) {
        (self.study.form, self.study.scenario.installation.form)
    }

    /// NIS over all runs, for each kind of observation that was used.
    pub fn nis(&self) -> impl Iterator<Item = (&'static str, &Nis)> {
        let kinds = [
            ("zero velocity", &self.velocity),
            ("table attitude", &self.table),
        ];
        kinds.into_iter().filter(|(_, nis)| nis.count > 0)
    }

    /// Runs that failed, with the reason.
    pub fn failures(&self) -> impl Iterator<Item = (u64, &str)> {
        self.trials
            .iter()
            .filter_map(|trial| Some((trial.run, trial.failure.as_deref()?)))
    }

    /// Number of runs whose data reject the filter's misalignment form, and number of runs tested.
    pub fn rejections(&self) -> (usize, usize) {
        let tests = || self.filtered().filter_map(|filtered| filtered.form_test);
        let rejected = tests().filter(|test| test.rejects());
        (rejected.count(), tests().count())
    }
}

fn filtered(trials: &[Trial]) -> impl Iterator<Item = &Filtered> {
    trials.iter().filter_map(|trial| trial.filtered.as_ref())
}

fn anees(trials: &[Trial]) -> Option<Anees> {
    let all = || filtered(trials).filter_map(|filtered| filtered.nees);
    let count: usize = all().map(|nees| nees.count).sum();
    let first = all().next()?;
    Some(Anees {
        mean: all().map(|nees| nees.mean * nees.count as f64).sum::<f64>() / count as f64,
        directions: first.count,
        interval_95: mean_square_interval(count, 0.05),
        interval_998: mean_square_interval(count, 0.002),
    })
}

/// NIS over all runs.
fn pooled(trials: &[Trial], of: impl Fn(&Filtered) -> &Nis) -> Nis {
    let all: Vec<&Nis> = filtered(trials)
        .map(of)
        .filter(|nis| nis.count > 0)
        .collect();
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
