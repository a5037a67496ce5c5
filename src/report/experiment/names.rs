//! How methods and situations are spoken of, and where what is said of them stands.

use crate::imu::InstallationForm;
use crate::study::Experiment;
use crate::study::experiment::{Estimator, Method, Navigated, Situation, Worth};
use crate::study::navigation::INTERVAL;
use crate::units::NAUTICAL_MILE;

pub(super) const HOUR: f64 = 3600.0;
/// Hours of the paper's experiment.
pub(super) const PAPER_HOURS: f64 = 40.0;

pub(super) fn hours(experiment: &Experiment) -> f64 {
    f64::from(experiment.study.intervals) * INTERVAL / HOUR
}

/// Every method with its table time, s.
pub(super) fn timed(experiment: &Experiment) -> impl Iterator<Item = (Method, f64)> {
    Method::all().zip(experiment.table_times.iter().copied())
}

/// Such as `EKF 10 min, six-angle`.
pub(super) fn method_name(experiment: &Experiment, method: Method) -> String {
    let estimator = estimator_name(experiment, method.estimator);
    format!("{estimator}, {}", method.form.name())
}

pub(super) fn method_kind(estimator: Estimator) -> &'static str {
    match estimator {
        Estimator::ClosedForm => "closed form",
        Estimator::Filter | Estimator::LongFilter => "EKF",
    }
}

/// Such as `EKF 10 min`, to the minute: the facts hold the rest.
pub(super) fn estimator_name(experiment: &Experiment, estimator: Estimator) -> String {
    let time = timed(experiment).find(|(method, _)| method.estimator == estimator);
    let minutes = time.map_or(f64::NAN, |(_, time)| time / 60.0);
    format!("{} {minutes:.0} min", method_kind(estimator))
}

pub(super) fn situation_name(situation: Situation) -> &'static str {
    match situation {
        Situation::SelfAligned => "stationary, self-aligned",
        Situation::Aligned => "stationary, alignment given",
        Situation::Moving => "moving, alignment given",
    }
}

pub(super) fn miles(metres: f64) -> f64 {
    metres / NAUTICAL_MILE
}

/// What a method is worth in the general form.
pub(super) fn in_general(navigated: &Navigated, estimator: Estimator) -> Option<&Worth> {
    let general = Method {
        estimator,
        form: InstallationForm::General,
    };
    navigated.methods.iter().find(|w| w.method == general)
}

pub(super) fn navigated(experiment: &Experiment, situation: Situation) -> Option<&Navigated> {
    experiment
        .navigations
        .iter()
        .find(|n| n.situation == situation)
}
