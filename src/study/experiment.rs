//! The paper's turntable experiment (§3.3, Figure 10) as a simulation: instruments are calibrated with the closed form
//! and with the filter, and navigate with the remaining errors.
//!
//! The navigation error of a calibration is `error(t) = (S(t) + Φ(t) X₀) δθ`: S is the effect of the
//! parameter errors δθ during the mission, X₀ their effect on the initial alignment. Both are linear, so
//! each mission is computed once for all calibrations.

mod budget;
mod method;
mod noise;
mod spread;
#[cfg(test)]
mod tests;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::navigation::{Mission, Motion};
use super::ratio::{bootstrap, median};
use super::{Ratio, Study, StudyError};
use crate::calibration::{ParameterVector, parameter};
use crate::imu::{InstallationForm, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad};
use crate::navigation::{SensedErrors, Sensitivity, Trajectory};
use crate::simulation::Scenario;
use crate::units::NAUTICAL_MILE;

pub use budget::{Budget, Part};
pub use method::{Calibrated, Estimator, Method, Trial};
pub use noise::ALIGNMENT_TIME;
pub use spread::Spread;

use budget::ByParameter;

/// Configuration of the study.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ExperimentStudy {
    /// The simulated scenario, with the short filter path.
    pub scenario: Scenario,
    /// Trajectory of the moving body.
    pub trajectory: Trajectory,
    /// Name of the trajectory.
    pub trajectory_name: String,
    /// Duration of each navigation in intervals of [`super::navigation::INTERVAL`].
    pub intervals: u32,
    /// Number of instruments.
    pub samples: u64,
    /// Seed; each instrument has its own random streams.
    pub seed: u64,
}

/// Situation in which an instrument navigates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Situation {
    /// The instrument is stationary and level, heads north, and aligns itself.
    SelfAligned,
    /// The instrument is stationary and level, heads north, and its attitude is given.
    Aligned,
    /// The instrument moves along the trajectory, and its initial attitude is given.
    Moving,
}

impl Situation {
    /// All situations, in the order in which results list them.
    pub const ALL: [Self; 3] = [Self::SelfAligned, Self::Aligned, Self::Moving];
}

/// The result.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Configuration of the study.
    pub study: ExperimentStudy,
    /// Table time of each of [`Method::all`], s.
    pub table_times: Vec<f64>,
    /// Every instrument, in order.
    pub trials: Vec<Trial>,
    /// Results in each of [`Situation::ALL`].
    pub navigations: Vec<Navigated>,
}

/// Results of the methods in one situation.
#[derive(Debug, Clone)]
pub struct Navigated {
    /// The situation.
    pub situation: Situation,
    /// Results of each of [`Method::all`].
    pub methods: Vec<Worth>,
    /// Horizontal position error at the end in nmile, caused only by the noise of alignment and navigation; it is the
    /// same after every calibration.
    pub noise: Spread,
}

/// Accuracy of a method: horizontal position errors in nmile over all instruments.
#[derive(Debug, Clone)]
pub struct Worth {
    /// The method.
    pub method: Method,
    /// Errors at the end, for all instruments that have a calibration, in the order of the instruments.
    pub errors: Vec<f64>,
    /// Distribution of the errors at the end.
    pub at_end: Spread,
    /// 99 % bootstrap interval of the median at the end.
    pub median_interval: (f64, f64),
    /// Maximum error over time, sampled every minute.
    pub largest: Spread,
    /// Errors at the end due to the errors of one triad alone.
    pub by_one: PerSensor<Spread>,
    /// Final median of the closed form in the same misalignment form, divided by the final median of this method;
    /// `None` for the closed form.
    pub gain: Option<Ratio>,
    /// Budget of the final error from the stated covariance.
    pub budget: Budget,
}

impl Study for ExperimentStudy {
    type Trial = Trial;
    type Outcome = Experiment;

    fn runs(&self) -> u64 {
        self.samples
    }

    fn maker(&self) -> Result<impl Fn(u64) -> Result<Trial, StudyError> + Sync, StudyError> {
        let scenarios = method::Scenarios::new(&self.scenario)?;
        Ok(move |run| scenarios.trial(self.seed, run))
    }

    fn outcome(&self, trials: Vec<Trial>) -> Result<Experiment, StudyError> {
        let navigated = Situation::ALL.into_par_iter();
        let navigated = navigated.map(|situation| Ok(self.way(situation)?.navigated(&trials)));
        Ok(Experiment {
            navigations: navigated.collect::<Result<_, StudyError>>()?,
            study: self.clone(),
            table_times: method::Scenarios::new(&self.scenario)?.table_times()?,
            trials,
        })
    }
}

impl ExperimentStudy {
    /// The mission of a situation.
    fn mission(&self, situation: Situation) -> Mission {
        match situation {
            Situation::SelfAligned | Situation::Aligned => {
                Mission::standing_level(&self.scenario.site, self.intervals)
            }
            Situation::Moving => Mission {
                motion: Motion::Moving(self.trajectory.clone()),
                intervals: self.intervals,
                interval: super::navigation::INTERVAL,
            },
        }
    }

    fn way(&self, situation: Situation) -> Result<Way, StudyError> {
        let mission = self.mission(situation);
        let instrument = ideal();
        let mut start = Sensitivity::zeros();
        let mut aligned = None;
        if let (Situation::SelfAligned, Motion::Standing(at)) = (situation, &mission.motion) {
            let by_sensed = noise::by_itself(at);
            if let Ok(sensed) = SensedErrors::new(&instrument) {
                start = by_sensed * sensed.at(&at.steady());
            }
            aligned = Some(by_sensed);
        }
        let exposures = mission.exposure_from(start, &instrument)?;
        let noise = noise::position(&mission, aligned, &self.scenario.instrument.noise)?;
        Ok(Way {
            situation,
            noise: noise::spread(&(noise / NAUTICAL_MILE.powi(2))),
            minutes: exposures
                .iter()
                .map(|at| (at.time, at.position() / NAUTICAL_MILE))
                .collect(),
        })
    }
}

/// The instrument used to compute missions; the effect of an error differs between instruments by less than 1 %.
fn ideal() -> PerSensor<Triad> {
    PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General))
}

/// A mission, computed once.
struct Way {
    situation: Situation,
    noise: Spread,
    /// Time, and effect of each parameter error on the position.
    minutes: Vec<(f64, ByParameter)>,
}

impl Way {
    fn navigated(&self, trials: &[Trial]) -> Navigated {
        Navigated {
            situation: self.situation,
            methods: Method::all()
                .enumerate()
                .map(|(place, method)| self.worth(place, method, trials))
                .collect(),
            noise: self.noise,
        }
    }

    fn worth(&self, place: usize, method: Method, trials: &[Trial]) -> Worth {
        let calibrated: Vec<&Calibrated> = trials.iter().filter_map(|t| t.of(place)).collect();
        let all = || calibrated.iter().map(|c| &c.error);
        let errors: Vec<f64> = all().map(|error| self.at_end(error)).collect();
        let largest = |error: &ParameterVector| {
            let lengths = self.minutes.iter().map(|(_, by)| (by * error).norm());
            lengths.fold(0.0, f64::max)
        };
        let interval = bootstrap(errors.len(), |chosen| median(&errors, chosen));
        Worth {
            method,
            at_end: Spread::of(errors.iter().copied()),
            median_interval: interval.map_or((f64::NAN, f64::NAN), |(_, interval)| interval),
            largest: Spread::of(all().map(largest)),
            by_one: PerSensor::from_fn(|sensor| {
                Spread::of(all().map(|error| self.at_end(&of_triad(error, sensor))))
            }),
            gain: self.gain(place, method, trials),
            budget: Budget::new(self.end(), &calibrated),
            errors,
        }
    }

    /// Ratio over the instruments calibrated by both methods.
    fn gain(&self, place: usize, method: Method, trials: &[Trial]) -> Option<Ratio> {
        let baseline = Method::all()
            .position(|m| m.estimator == Estimator::ClosedForm && m.form == method.form)
            .filter(|&baseline| baseline != place)?;
        let both = trials
            .iter()
            .filter_map(|t| t.of(baseline).zip(t.of(place)));
        let (over, under): (Vec<f64>, Vec<f64>) = both
            .map(|(a, b)| (self.at_end(&a.error), self.at_end(&b.error)))
            .unzip();
        Ratio::of_medians(&over, &under)
    }

    fn at_end(&self, error: &ParameterVector) -> f64 {
        (self.end() * error).norm()
    }

    fn end(&self) -> ByParameter {
        let last = self.minutes.last();
        last.map_or_else(ByParameter::zeros, |last| last.1)
    }
}

/// The errors of one triad, with the other exact.
fn of_triad(error: &ParameterVector, sensor: Sensor) -> ParameterVector {
    let mut only = ParameterVector::zeros();
    let first = parameter(sensor, 0);
    only.fixed_rows_mut::<PER_TRIAD>(first)
        .copy_from(&error.fixed_rows::<PER_TRIAD>(first));
    only
}
