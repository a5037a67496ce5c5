//! What was studied, as pairs of a name and a value.

use super::super::document::Facts;
use super::super::number::{count, minutes, three_digits, value};
use super::super::terms::title;
use crate::calibration::ErrorTerm;
use crate::study::Accuracy;
use crate::units::DEGREE;

/// Reasons of failure that are shown.
const REASONS: usize = 3;

pub(super) fn facts(accuracy: &Accuracy) -> Facts {
    let study = &accuracy.study;
    let scenario = &study.scenario;
    let aiding = if accuracy.table.count > 0 {
        "zero velocity and table attitude"
    } else {
        "zero velocity"
    };
    let mut rows = vec![
        (
            "scenario",
            format!(
                "{}: instrument {}, table {}, path {}, latitude {}°",
                scenario.name,
                scenario.instrument.name,
                scenario.table_name,
                scenario.path_name,
                three_digits(scenario.site.latitude / DEGREE)
            ),
        ),
        (
            "runs",
            format!("{}, seed {}", count(accuracy.trials.len()), study.seed),
        ),
        (
            "installation",
            format!(
                "filter {}, truth {}; compared in the general form",
                study.form.name(),
                scenario.installation.form.name()
            ),
        ),
        ("aiding", aiding.to_owned()),
        ("error terms", terms(accuracy)),
        ("table time", table_time(accuracy)),
        ("failures", failures(accuracy)),
    ];
    if let Some((median, most)) = passes(accuracy) {
        let median = value(median, if median.fract() == 0.0 { 10.0 } else { 1.0 });
        rows.push(("passes", format!("median {median}, most {most}")));
    }
    let (observations, runs) = rejected(accuracy);
    rows.push((
        "rejected observations",
        match observations {
            0 => "none".to_owned(),
            _ => format!("{} in {} of the runs", count(observations), count(runs)),
        },
    ));
    if let (rejections, tested @ 1..) = accuracy.rejections() {
        let form = study.form.name();
        rows.push((
            "form",
            format!(
                "the data reject {form} in {} of {} runs",
                count(rejections),
                count(tested)
            ),
        ));
    }
    Facts::new("The study", rows)
}

/// Which error terms the filter had, and which it should have had.
fn terms(accuracy: &Accuracy) -> String {
    let (scenario, unmodelled) = (&accuracy.study.scenario, &accuracy.study.unmodelled);
    let there = ErrorTerm::ALL.into_iter().filter(|&b| scenario.has(b));
    let (left_out, on): (Vec<_>, Vec<_>) = there.partition(|block| unmodelled.contains(block));
    let named = |blocks: &[ErrorTerm]| {
        let titles: Vec<&str> = blocks.iter().map(|&block| title(block)).collect();
        match titles[..] {
            [] => "none".to_owned(),
            _ => titles.join(", "),
        }
    };
    let mut text = format!("beside K, E and D: {}", named(&on));
    if !left_out.is_empty() {
        text.push_str(&format!(
            "; simulated but not modelled: {}",
            named(&left_out)
        ));
    }
    text
}

/// Median and largest number of passes; none if no run gave an estimate.
pub(super) fn passes(accuracy: &Accuracy) -> Option<(f64, usize)> {
    let filtered = accuracy.trials.iter().filter_map(|t| t.filtered.as_ref());
    let mut passes: Vec<usize> = filtered.map(|filtered| filtered.passes).collect();
    passes.sort_unstable();
    let most = *passes.last()?;
    let middle = [(passes.len() - 1) / 2, passes.len() / 2].map(|k| passes[k] as f64);
    Some((0.5 * (middle[0] + middle[1]), most))
}

/// Number of observations that the gate left out, and in how many runs.
pub(super) fn rejected(accuracy: &Accuracy) -> (usize, usize) {
    let filtered = accuracy.trials.iter().filter_map(|t| t.filtered.as_ref());
    filtered.fold((0, 0), |(observations, runs), f| {
        (
            observations + f.rejected,
            runs + usize::from(f.rejected > 0),
        )
    })
}

fn table_time(accuracy: &Accuracy) -> String {
    let baseline = &accuracy.baseline;
    let mut text = format!(
        "EKF {}; closed form {} on path {}",
        minutes(accuracy.table_time),
        minutes(baseline.table_time),
        baseline.scenario.path_name
    );
    match baseline.equal_time() {
        Some(time) => {
            text.push_str(&format!(", also cut to {}", minutes(time)));
        }
        None => text.push_str("; its positions cannot be had in the time of the EKF"),
    }
    text
}

fn failures(accuracy: &Accuracy) -> String {
    let failed = accuracy.failures().count();
    if failed == 0 {
        return "none".to_owned();
    }
    let reasons: Vec<String> = accuracy
        .failures()
        .take(REASONS)
        .map(|(run, reason)| format!("run {run}: {reason}"))
        .collect();
    let more = if failed > REASONS { "; …" } else { "" };
    format!("{} ({}{more})", count(failed), reasons.join("; "))
}
