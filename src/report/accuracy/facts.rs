//! What was studied, as pairs of a name and a value.

use super::super::terms::title;
use crate::calibration::ErrorTerm;
use crate::report::prelude::*;
use crate::study::Accuracy;
use crate::units::DEGREE;

/// Reasons of failure that are shown.
const REASONS: usize = 3;

pub(super) fn facts(accuracy: &Accuracy) -> Facts {
    let (study, scenario) = (&accuracy.study, &accuracy.study.scenario);
    let (form, truth) = (study.form.name(), scenario.installation.form.name());
    let what = format!(
        "{}: instrument {}, table {}, path {}, latitude {}°",
        scenario.name,
        scenario.instrument.name,
        scenario.table_name,
        scenario.path_name,
        three_digits(scenario.site.latitude / DEGREE)
    );
    let aiding = match accuracy.table.count {
        0 => "zero velocity",
        _ => "zero velocity and table attitude",
    };
    let mut facts = Facts::new("The study", [("scenario", what)]);
    facts.push(
        "runs",
        format!("{}, seed {}", count(accuracy.trials.len()), study.seed),
    );
    let forms = format!("filter {form}, truth {truth}; compared in the general form");
    facts.push("installation", forms);
    facts.push("aiding", aiding);
    facts.push("error terms", terms(accuracy));
    facts.push("table time", table_time(accuracy));
    facts.push("failures", failures(accuracy));
    if let Some((median, most)) = passes(accuracy) {
        let median = value(median, if median.fract() == 0.0 { 10.0 } else { 1.0 });
        facts.push("passes", format!("median {median}, most {most}"));
    }
    let rejected = match rejected(accuracy) {
        (0, _) => "none".to_owned(),
        (of, runs) => format!("{} in {} of the runs", count(of), count(runs)),
    };
    facts.push("rejected observations", rejected);
    if let (rejections, tested @ 1..) = accuracy.rejections() {
        let (rejections, tested) = (count(rejections), count(tested));
        facts.push(
            "form",
            format!("the data reject {form} in {rejections} of {tested} runs"),
        );
    }
    facts
}

/// Which error terms the filter had, and which it should have had.
fn terms(accuracy: &Accuracy) -> String {
    let (scenario, unmodelled) = (&accuracy.study.scenario, &accuracy.study.unmodelled);
    let there = ErrorTerm::ALL.into_iter().filter(|&b| scenario.has(b));
    let (left_out, on): (Vec<_>, Vec<_>) = there.partition(|block| unmodelled.contains(block));
    let named = |blocks: &[ErrorTerm]| {
        let titles: Vec<&str> = blocks.iter().map(|&block| title(block)).collect();
        titles.join(", ")
    };
    let on = if on.is_empty() {
        "none".to_owned()
    } else {
        named(&on)
    };
    match &left_out[..] {
        [] => format!("beside K, E and D: {on}"),
        left_out => {
            format!(
                "beside K, E and D: {on}; simulated but not modelled: {}",
                named(left_out)
            )
        }
    }
}

/// Median and largest number of passes; none if no run gave an estimate.
pub(super) fn passes(accuracy: &Accuracy) -> Option<(f64, usize)> {
    let filtered = accuracy.trials.iter().filter_map(|t| t.filtered.as_ref());
    let mut passes: Vec<usize> = filtered.map(|filtered| filtered.passes).collect();
    passes.sort_unstable();
    let most = *passes.last()?;
    let [low, high] = [(passes.len() - 1) / 2, passes.len() / 2].map(|k| passes[k] as f64);
    Some((0.5 * (low + high), most))
}

/// Number of observations that the gate rejected, and in how many runs.
pub(super) fn rejected(accuracy: &Accuracy) -> (usize, usize) {
    let filtered = accuracy.trials.iter().filter_map(|t| t.filtered.as_ref());
    let rejected = filtered.map(|filtered| filtered.rejected);
    rejected.fold((0, 0), |(all, runs), of| {
        (all + of, runs + usize::from(of > 0))
    })
}

fn table_time(accuracy: &Accuracy) -> String {
    let baseline = &accuracy.baseline;
    let cut = match baseline.equal_time() {
        Some(time) => format!(", also cut to {}", minutes(time)),
        None => "; its positions cannot be had in the time of the EKF".to_owned(),
    };
    let (filter, closed) = (minutes(accuracy.table_time), minutes(baseline.table_time));
    let path = &baseline.scenario.path_name;
    format!("EKF {filter}; closed form {closed} on path {path}{cut}")
}

fn failures(accuracy: &Accuracy) -> String {
    let failed = accuracy.failures().count();
    let reasons = accuracy.failures().take(REASONS);
    let reasons = reasons.map(|(run, reason)| format!("run {run}: {reason}"));
    let more = if failed > REASONS { "; …" } else { "" };
    match failed {
        0 => "none".to_owned(),
        _ => format!(
            "{} ({}{more})",
            count(failed),
            reasons.collect::<Vec<_>>().join("; ")
        ),
    }
}
