//! What the experiment says, in sentences.

use super::super::number::{count, ratio, three_digits, value};
use super::super::study::Sentence;
use super::tables::nmile;
use super::{estimator_name, hours, in_general, method_name, navigated, situation_name};
use crate::study::Experiment;
use crate::study::experiment::{Budget, Estimator, Method, Situation};

/// What is compared with the closed form: in equal time standing, in a sixth of it moving.
pub(super) const COMPARED: [(Situation, Estimator); 4] = [
    (Situation::SelfAligned, Estimator::LongFilter),
    (Situation::SelfAligned, Estimator::Filter),
    (Situation::Moving, Estimator::LongFilter),
    (Situation::Moving, Estimator::Filter),
];

pub(super) fn verdict(experiment: &Experiment) -> Vec<Sentence> {
    let mut sentences = failures(experiment);
    for (situation, estimator) in COMPARED {
        sentences.extend(compared(experiment, situation, estimator));
    }
    for situation in [Situation::SelfAligned, Situation::Moving] {
        sentences.extend(limit(experiment, situation));
    }
    sentences
}

fn compared(
    experiment: &Experiment,
    situation: Situation,
    estimator: Estimator,
) -> Option<Sentence> {
    let navigated = navigated(experiment, situation)?;
    let closed = in_general(navigated, Estimator::ClosedForm)?;
    let filter = in_general(navigated, estimator)?;
    let gain = filter.gain.as_ref()?;
    let [by, interval] = ratio(gain);
    let (low, high) = gain.interval;
    let judged = if low > 1.0 {
        "the EKF is better"
    } else if high < 1.0 {
        "the closed form is better"
    } else {
        "not told apart by so many instruments"
    };
    Some(Sentence {
        good: low > 1.0,
        text: format!(
            "{}, {} h: median {} nmile after {}, {} after {}, ratio {by} ({interval}): {judged}.",
            capital(situation_name(situation)),
            three_digits(hours(experiment)),
            nmile(filter.at_end.median),
            estimator_name(experiment, estimator),
            nmile(closed.at_end.median),
            estimator_name(experiment, Estimator::ClosedForm),
        ),
    })
}

/// What makes most of what is left.
fn limit(experiment: &Experiment, situation: Situation) -> Option<Sentence> {
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
    let of = Estimator::ALL
        .into_iter()
        .map(|estimator| {
            let worth = in_general(navigated, estimator)?;
            let name = estimator_name(experiment, estimator);
            Some(format!("{name}: {}", most(&worth.budget)?))
        })
        .collect::<Option<Vec<_>>>()?;
    Some(Sentence {
        good: true,
        text: format!(
            "{}, most of the variance is made by: {}. Noise alone would leave a median of {} nmile.",
            capital(situation_name(situation)),
            of.join("; "),
            nmile(navigated.noise.median)
        ),
    })
}

/// Calibrations that failed, did not converge, or whose data reject the form.
fn failures(experiment: &Experiment) -> Vec<Sentence> {
    let trials = &experiment.trials;
    let mut sentences = Vec::new();
    for (place, method) in Method::all().enumerate() {
        let all = || trials.iter().filter_map(|t| t.calibrations.get(place));
        let failed = all().filter(|c| c.is_err()).count();
        let wandering = all().flatten().filter(|c| !c.converged).count();
        let rejected = all().flatten().filter(|c| c.rejects_form).count();
        let name = method_name(experiment, method);
        if failed > 0 {
            let reason = all().find_map(|c| c.as_ref().err());
            sentences.push(format!(
                "{name}: {} of {} calibrations failed, the first because: {}",
                count(failed),
                count(trials.len()),
                reason.map_or("", String::as_str)
            ));
        }
        if rejected > 0 {
            sentences.push(format!(
                "{name}: the data reject the form for {} of {} instruments.",
                count(rejected),
                count(trials.len())
            ));
        }
        if wandering > 0 {
            sentences.push(format!(
                "{name}: {} of {} calibrations did not converge; they are counted as they are.",
                count(wandering),
                count(trials.len())
            ));
        }
    }
    sentences
        .into_iter()
        .map(|text| Sentence { good: false, text })
        .collect()
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}
