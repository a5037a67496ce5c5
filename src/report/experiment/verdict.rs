//! What the experiment says, in sentences.

use super::names::{estimator_name, hours, in_general, method_name, navigated, situation_name};
use super::tables::nmile;
use crate::report::prelude::*;
use crate::study::Experiment;
use crate::study::experiment::{Budget, Estimator, Method, Situation};

/// What is compared with the closed form: in equal time stationary, in a sixth of it moving.
const COMPARED: [(Situation, Estimator); 4] = [
    (Situation::SelfAligned, Estimator::LongFilter),
    (Situation::SelfAligned, Estimator::Filter),
    (Situation::Moving, Estimator::LongFilter),
    (Situation::Moving, Estimator::Filter),
];

/// Says what is better, what makes most of the error, and which calibrations failed.
pub(super) fn say(document: &mut Document, experiment: &Experiment) {
    for text in failures(experiment) {
        document.say(false, text);
    }
    for (situation, estimator) in COMPARED {
        if let Some((better, text)) = compared(experiment, situation, estimator) {
            document.say(better, text);
        }
    }
    let limits = [Situation::SelfAligned, Situation::Moving].into_iter();
    for text in limits.filter_map(|situation| limit(experiment, situation)) {
        document.say(true, text);
    }
}

fn compared(
    experiment: &Experiment,
    situation: Situation,
    estimator: Estimator,
) -> Option<(bool, String)> {
    let navigated = navigated(experiment, situation)?;
    let closed = in_general(navigated, Estimator::ClosedForm)?;
    let filter = in_general(navigated, estimator)?;
    let gain = filter.gain.as_ref()?;
    let [by, interval] = with_interval(gain.value, gain.interval);
    let (low, high) = gain.interval;
    let judged = match () {
        () if low > 1.0 => "the EKF is better",
        () if high < 1.0 => "the closed form is better",
        () => "no significant difference with so many instruments",
    };
    let text = format!(
        "{}, {} h: median {} nmile after {}, {} after {}, ratio {by} ({interval}): {judged}.",
        capital(situation_name(situation)),
        three_digits(hours(experiment)),
        nmile(filter.at_end.median),
        estimator_name(experiment, estimator),
        nmile(closed.at_end.median),
        estimator_name(experiment, Estimator::ClosedForm),
    );
    Some((low > 1.0, text))
}

/// What makes most of what is left.
fn limit(experiment: &Experiment, situation: Situation) -> Option<String> {
    let navigated = navigated(experiment, situation)?;
    let most = |budget: &Budget| {
        let part = budget
            .parts
            .iter()
            .max_by(|a, b| a.share.total_cmp(&b.share))?;
        Some(format!(
            "{} ({} %)",
            part.group.title(),
            value(100.0 * part.share, 10.0)
        ))
    };
    let of = Estimator::ALL.into_iter().map(|estimator| {
        let worth = in_general(navigated, estimator)?;
        Some(format!(
            "{}: {}",
            estimator_name(experiment, estimator),
            most(&worth.budget)?
        ))
    });
    Some(format!(
        "{}, most of the variance is made by: {}. Noise alone would leave a median of {} nmile.",
        capital(situation_name(situation)),
        of.collect::<Option<Vec<_>>>()?.join("; "),
        nmile(navigated.noise.median)
    ))
}

/// Calibrations that failed, did not converge, or whose data reject the form.
fn failures(experiment: &Experiment) -> Vec<String> {
    let trials = &experiment.trials;
    let mut sentences = Vec::new();
    for (place, method) in Method::all().enumerate() {
        let all = || trials.iter().filter_map(|t| t.calibrations.get(place));
        let failed = all().filter(|c| c.is_err()).count();
        let diverged = all().flatten().filter(|c| !c.converged).count();
        let rejected = all().flatten().filter(|c| c.rejects_form).count();
        let (name, of) = (method_name(experiment, method), count(trials.len()));
        if failed > 0 {
            let reason = all()
                .find_map(|c| c.as_ref().err())
                .map_or("", String::as_str);
            let failed = count(failed);
            sentences.push(format!(
                "{name}: {failed} of {of} calibrations failed, the first because: {reason}"
            ));
        }
        if rejected > 0 {
            let rejected = count(rejected);
            sentences.push(format!(
                "{name}: the data reject the form for {rejected} of {of} instruments."
            ));
        }
        if diverged > 0 {
            let diverged = count(diverged);
            sentences.push(format!(
                "{name}: {diverged} of {of} calibrations did not converge; they are counted as they are."
            ));
        }
    }
    sentences
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).collect()
}
