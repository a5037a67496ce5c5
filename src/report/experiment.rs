//! The report of the turntable experiment: one set of tables and a verdict for terminal and page,
//! figures, and one JSON document.

mod budget;
mod distribution;
mod document;
mod tables;
#[cfg(test)]
mod tests;
mod time;
mod verdict;

use std::path::Path;

use super::canvas::{Area, DrawError};
use super::number::{count, minutes, three_digits};
use super::study::StudyReport;
use super::{Figure, ReportError, write_files};
use crate::imu::InstallationForm;
use crate::study::experiment::{ALIGNMENT_TIME, Estimator, Method, Navigated, Situation};
use crate::study::navigation::INTERVAL;
use crate::study::{Experiment, experiment::Worth};
use crate::units::{DEGREE, NAUTICAL_MILE};

pub use document::document;

const HOUR: f64 = 3600.0;
const MINUTE: f64 = 60.0;
/// Hours of the paper's experiment.
const PAPER_HOURS: f64 = 40.0;

/// The experiment as text: what was done, the tables, and a verdict in sentences.
pub fn summary(experiment: &Experiment) -> String {
    report(experiment).summary()
}

/// Writes `index.html`, which needs nothing else, and every figure as an SVG file of its own into an
/// existing directory.
///
/// # Errors
/// [`ReportError`] if a figure cannot be drawn or a file not be written.
pub fn write(experiment: &Experiment, directory: &Path) -> Result<(), ReportError> {
    let figures = [
        distribution::figure(experiment)?,
        time::figure(experiment)?,
        budget::figure(experiment)?,
    ];
    write_files(directory, &report(experiment).page(&figures), &figures)
}

fn report(experiment: &Experiment) -> StudyReport {
    StudyReport {
        title: format!(
            "The turntable experiment with {} simulated instruments",
            count(experiment.trials.len())
        ),
        subject: "The experiment",
        facts: facts(experiment),
        tables: tables::tables(experiment),
        verdict: verdict::verdict(experiment),
    }
}

fn facts(experiment: &Experiment) -> Vec<(String, String)> {
    let study = &experiment.study;
    let scenario = &study.scenario;
    let times: Vec<String> = Estimator::ALL
        .into_iter()
        .filter_map(|estimator| {
            let (_, time) = timed(experiment).find(|(m, _)| m.estimator == estimator)?;
            let name = match estimator {
                Estimator::ClosedForm => "closed form",
                Estimator::Filter | Estimator::LongFilter => "EKF",
            };
            Some(format!("{name} {}", minutes(time)))
        })
        .collect();
    let rows = [
        (
            "scenario",
            format!(
                "{}: instrument {}, truth {}, table {}, latitude {}°",
                scenario.name,
                scenario.instrument.name,
                scenario.installation.form.name(),
                scenario.table_name,
                three_digits(scenario.site.latitude / DEGREE)
            ),
        ),
        (
            "instruments",
            format!("{}, seed {}", count(experiment.trials.len()), study.seed),
        ),
        ("table time", times.join(", ")),
        (
            "navigation",
            format!(
                "{} h; standing level, heading North, and moving along {}; height held to the true one",
                three_digits(hours(experiment)),
                study.trajectory_name
            ),
        ),
        (
            "alignment",
            "standing: levelled by the calibrated accelerometers, North from the calibrated gyros, or \
             given; moving: given"
                .to_owned(),
        ),
        (
            "noise",
            format!(
                "left out of the errors of the methods, as it is the same for all; the line \"noise \
                 alone\" has what it makes in alignment of {} and navigation",
                minutes(ALIGNMENT_TIME)
            ),
        ),
    ];
    rows.map(|(name, value)| (name.to_owned(), value)).to_vec()
}

fn hours(experiment: &Experiment) -> f64 {
    f64::from(experiment.study.intervals) * INTERVAL / HOUR
}

/// Every method with its table time, s.
fn timed(experiment: &Experiment) -> impl Iterator<Item = (Method, f64)> {
    Method::all().zip(experiment.table_times.iter().copied())
}

/// Such as `EKF 10 min, six-angle`.
fn method_name(experiment: &Experiment, method: Method) -> String {
    format!(
        "{}, {}",
        estimator_name(experiment, method.estimator),
        method.form.name()
    )
}

/// Such as `EKF 10 min`.
fn estimator_name(experiment: &Experiment, estimator: Estimator) -> String {
    let time = timed(experiment).find(|(method, _)| method.estimator == estimator);
    let time = time.map_or(f64::NAN, |(_, time)| time);
    // To the minute: the tables hold the rest.
    let time = format!("{:.0} min", time / MINUTE);
    match estimator {
        Estimator::ClosedForm => format!("closed form {time}"),
        Estimator::Filter | Estimator::LongFilter => format!("EKF {time}"),
    }
}

fn situation_name(situation: Situation) -> &'static str {
    match situation {
        Situation::SelfAligned => "standing, aligned by itself",
        Situation::Aligned => "standing, alignment given",
        Situation::Moving => "moving, alignment given",
    }
}

/// A figure with a panel for each navigation, one below the other.
fn by_navigation<'a>(
    (file, title): (&'static str, &'static str),
    caption: String,
    navigations: impl IntoIterator<Item = &'a Navigated>,
    height: u32,
    panel: impl Fn(&Area, &Navigated) -> Result<(), DrawError>,
) -> Result<Figure, ReportError> {
    let navigations: Vec<&Navigated> = navigations.into_iter().collect();
    let rows = navigations.len().max(1);
    let size = (1200, height * rows as u32);
    Figure::draw(file, title, caption, size, |area| {
        for (navigated, area) in navigations.iter().zip(area.split_evenly((rows, 1))) {
            panel(&area, navigated)?;
        }
        Ok(())
    })
}

fn miles(metres: f64) -> f64 {
    metres / NAUTICAL_MILE
}

/// What a method is worth in the general form.
fn in_general(navigated: &Navigated, estimator: Estimator) -> Option<&Worth> {
    let general = Method {
        estimator,
        form: InstallationForm::General,
    };
    navigated.methods.iter().find(|w| w.method == general)
}

fn navigated(experiment: &Experiment, situation: Situation) -> Option<&Navigated> {
    let all = experiment.navigations.iter();
    all.into_iter().find(|n| n.situation == situation)
}
