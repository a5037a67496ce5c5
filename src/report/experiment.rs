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

use std::fmt::Write;
use std::path::Path;

use maud::html;

use super::number::{count, three_digits};
use super::page::{document as html_document, drawn};
use super::side_by_side::Table;
use super::{Figure, ReportError, facts as pairs, terminal, write_files};
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
    let mut text = title(experiment) + "\n";
    let facts = facts(experiment);
    let width = facts.iter().map(|(name, _)| name.chars().count()).max();
    let width = width.unwrap_or(0);
    for (name, value) in facts {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {name:<width$}  {value}");
    }
    for table in tables::tables(experiment) {
        let _ = write!(text, "\n{}\n{}", table.title, terminal::columns(&table));
    }
    text.push_str("\nVerdict\n");
    for sentence in verdict::verdict(experiment) {
        let mark = if sentence.good { ' ' } else { '!' };
        let _ = writeln!(text, "{mark} {}", sentence.text);
    }
    text
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
    write_files(directory, &page(experiment, &figures), &figures)
}

fn page(experiment: &Experiment, figures: &[Figure]) -> String {
    let title = title(experiment);
    let (good, bad): (Vec<_>, Vec<_>) = verdict::verdict(experiment)
        .into_iter()
        .partition(|sentence| sentence.good);
    let body = html! {
        header { h1 { (title) } }
        @if !bad.is_empty() {
            section.warnings { h2 { "To be noted" } ul { @for s in bad { li { (s.text) } } } }
        }
        section { h2 { "What holds" } ul { @for s in good { li { (s.text) } } } }
        section { h2 { "The experiment" } (pairs::facts(facts(experiment))) }
        @for figure in figures { (drawn(figure)) }
        @for Table { title, headings, sections, notes } in tables::tables(experiment) {
            section {
                h2 { (title) }
                (super::tables::table(&headings, sections))
                p.note { (notes.join(" ")) }
            }
        }
    };
    html_document(&title, &body)
}

fn title(experiment: &Experiment) -> String {
    format!(
        "The turntable experiment with {} simulated instruments",
        count(experiment.trials.len())
    )
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

fn minutes(seconds: f64) -> String {
    format!("{} min", three_digits(seconds / MINUTE))
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
