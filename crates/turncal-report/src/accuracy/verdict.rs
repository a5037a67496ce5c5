//! Conclusions from the figures, in sentences.

use std::cmp::Ordering;

use super::tables;
use super::tables::{compared, journey_name, white_within};
use crate::prelude::*;
use crate::terms::title;
use turncal::calibration::{ErrorTerm, Nis};
use turncal::imu::Output;
use turncal::study::{Accuracy, Figures, Ratio};

/// With fewer runs than this, intervals are approximate.
const FEW: usize = 30;
/// Range of NIS due to pulses, which the filter treats as Gaussian noise.
const PULSES: std::ops::RangeInclusive<f64> = 0.9..=1.1;

/// Every sentence, the most important first.
pub fn say(document: &mut Document, accuracy: &Accuracy) {
    let mut sentences = vec![
        convergence(accuracy),
        against_bound(accuracy),
        nees(accuracy),
    ];
    for (name, nis) in accuracy.nis() {
        sentences.extend(innovations(accuracy, name, nis));
    }
    let warn = |text: String| (false, text);
    for of in &accuracy.navigation {
        let not_held = of.containment.iter().filter(|held| !held.as_claimed());
        let not_held: Vec<String> = not_held.map(tables::held).collect();
        sentences.extend((!not_held.is_empty()).then(|| {
            warn(format!(
                "After 40 h, {}, the position error is within its predicted σ more or less often than expected: {}.",
                journey_name(of.journey),
                not_held.join(", ")
            ))
        }));
    }
    sentences.extend(accuracy.not_navigated.iter().map(|(journey, reason)| {
        let journey = journey_name(*journey);
        warn(format!(
            "Not navigated from this site, {journey}: {reason}."
        ))
    }));
    sentences.extend(form(accuracy));
    sentences.extend(not_requested(accuracy).map(warn));
    sentences.extend(gain(accuracy));
    let runs = accuracy.trials.len();
    sentences.extend((runs < FEW).then(|| {
        warn(format!(
            "The intervals of the ratios are only approximate, because {runs} runs are fewer than {FEW}."
        ))
    }));
    for (good, text) in sentences {
        document.say(good, text);
    }
}

fn convergence(accuracy: &Accuracy) -> (bool, String) {
    let (runs, failed) = (count(accuracy.trials.len()), accuracy.failures().count());
    if failed == 0 {
        return (true, format!("All {runs} runs converged."));
    }
    let without = accuracy.trials.iter().filter(|t| t.filtered.is_none());
    let (failed, without) = (count(failed), count(without.count()));
    let text = format!(
        "{failed} of {runs} runs failed. Every RMS excludes the runs without an estimate ({without}) and includes the \
         other failed runs."
    );
    (false, text)
}

/// Position of a number relative to its interval.
fn side(of: f64, (low, high): (f64, f64)) -> (Ordering, &'static str) {
    match of {
        of if of < low => (Ordering::Less, "below"),
        of if of > high => (Ordering::Greater, "above"),
        _ => (Ordering::Equal, "within"),
    }
}

/// Names of the items with a ratio on the chosen side of 1.
fn named(
    accuracy: &Accuracy,
    of: impl Fn(&Figures) -> Option<Ratio>,
    chosen: impl Fn(Ordering) -> bool,
) -> String {
    let named = compared(accuracy).into_iter().filter_map(|compared| {
        let ratio = of(compared.figures)?;
        let [by, interval] = with_interval(ratio.value, ratio.interval);
        let is_chosen = chosen(side(1.0, ratio.interval).0.reverse());
        is_chosen.then(|| format!("{} {by} ({interval})", compared.title))
    });
    named.collect::<Vec<_>>().join(", ")
}

fn against_bound(accuracy: &Accuracy) -> (bool, String) {
    let of = |figures: &Figures| figures.ratio;
    let (form, truth) = accuracy.forms();
    if !form.holds(truth) {
        let text = format!(
            "The {} form cannot represent the truth, which is {}. Relative to the bound for the general form, the \
             errors are larger by these factors: {}.",
            form.name(),
            truth.name(),
            named(accuracy, of, |_| true)
        );
        return (false, text);
    }
    let outside = named(accuracy, of, Ordering::is_ne);
    if outside.is_empty() {
        let text = "In every group, the ratio of RMS error to bound is consistent with 1 (99 % interval), so the \
        errors of the filter are consistent with the optimum.";
        return (true, text.to_owned());
    }
    let text = format!(
        "In these groups, the ratio of RMS error to bound differs from 1 by more than its 99 % interval: \
         {outside}. By chance, this happens for one interval in a hundred."
    );
    (false, text)
}

fn nees(accuracy: &Accuracy) -> (bool, String) {
    let Some(of) = accuracy.anees else {
        let text = "No run gave an estimate, so the σ cannot be validated.";
        return (false, text.to_owned());
    };
    let mean = tables::mean(of.mean, of.interval_95);
    let (inner, outer) = (interval(of.interval_95), interval(of.interval_998));
    let is_inside = side(of.mean, of.interval_95).0.is_eq();
    let text = match side(of.mean, of.interval_998) {
        _ if is_inside => format!(
            "ANEES {mean} is within its 95 % interval {inner}, so the stated covariance, including its correlations, \
             is correct."
        ),
        (Ordering::Equal, _) => format!(
            "ANEES {mean} is within its 99.8 % interval {outer}, but outside its 95 % interval {inner}; by chance, \
             this happens in one study in twenty."
        ),
        (_, side) => format!(
            "ANEES {mean} is {side} its 99.8 % interval {outer}: the stated σ are too {} (the errors are {} times the \
             σ).",
            if of.mean > 1.0 { "small" } else { "large" },
            tables::factor(of.mean.sqrt())
        ),
    };
    (side(of.mean, of.interval_998).0.is_eq(), text)
}

/// Sentences on innovations that have the wrong size or are not white.
fn innovations(accuracy: &Accuracy, name: &str, nis: &Nis) -> Vec<(bool, String)> {
    let mut sentences = Vec::new();
    if let (Ordering::Less | Ordering::Greater, side) = side(nis.mean, nis.interval) {
        let mut text = format!(
            "The NIS of {name} ({}) is {side} its 99.8 % interval {}: the innovations are {} times as large as the \
             filter predicts.",
            tables::mean(nis.mean, nis.interval),
            interval(nis.interval),
            tables::factor(nis.mean.sqrt())
        );
        let is_pulse = accuracy.study.scenario.output == Output::Pulse;
        let pulses = is_pulse && PULSES.contains(&nis.mean);
        if pulses {
            text += " For pulses, values from 0.9 to 1.1 are normal, because the rounding of pulses is not Gaussian.";
        }
        sentences.push((pulses, text));
    }
    let within = white_within(nis);
    if nis.lag_one.abs() > within {
        let text = format!(
            "The innovations of {name} are not white: their lag-one correlation {} is outside ±{} (99 %).",
            value(nis.lag_one, within),
            value(within, within)
        );
        sentences.push((false, text));
    }
    sentences
}

fn form(accuracy: &Accuracy) -> Option<(bool, String)> {
    let (rejections, tested @ 1..) = accuracy.rejections() else {
        return None;
    };
    let (form, truth) = accuracy.forms();
    let mut text = format!(
        "The {} form is rejected in favour of the general form in {} of {} runs.",
        form.name(),
        count(rejections),
        count(tested)
    );
    if form.holds(truth) {
        text += " This form is correct; by chance, one run in a thousand rejects the correct form.";
    }
    // Three σ of a Poisson count beyond its mean by chance.
    let by_chance = 1e-3 * tested as f64;
    let few = rejections as f64 <= by_chance + 3.0 * by_chance.sqrt();
    Some((form.holds(truth) && few, text))
}

/// Error terms that the first run shows although they were not requested.
fn not_requested(accuracy: &Accuracy) -> Option<String> {
    let study = &accuracy.study;
    let is_requested =
        |term: ErrorTerm| study.scenario.has(term) && !study.unmodelled.contains(&term);
    let shown = accuracy.effects.iter();
    let shown = shown.filter(|of| of.shown && !is_requested(of.term));
    let names: Vec<&str> = shown.map(|of| title(of.term)).collect();
    (!names.is_empty()).then(|| {
        format!(
            "The first run shows error terms that were not requested (probability above 99.9 %): {}.",
            names.join(", ")
        )
    })
}

fn gain(accuracy: &Accuracy) -> Vec<(bool, String)> {
    let filter = minutes(accuracy.table_time);
    let closed = minutes(accuracy.baseline.table_time);
    let sides = [Ordering::Greater, Ordering::Equal, Ordering::Less].into_iter();
    let sentences = sides.filter_map(|side| {
        let named = named(accuracy, |f| f.gain, |of| of == side);
        let judged = match side {
            Ordering::Greater => "is more accurate than",
            Ordering::Equal => "does not differ significantly from",
            Ordering::Less => "is less accurate than",
        };
        let text =
            format!("In {filter} the EKF {judged} the closed form in {closed} (gain: {named}).");
        (!named.is_empty()).then_some((side.is_ge(), text))
    });
    sentences.collect()
}
