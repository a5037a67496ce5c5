//! What the figures say, in sentences.

use std::cmp::Ordering;

use super::tables;
use super::tables::{compared, journey_name, percent, region_name, white_within};
use crate::calibration::{ErrorTermTest, Nis};
use crate::imu::Output;
use crate::report::prelude::*;
use crate::study::accuracy::Containment;
use crate::study::{Accuracy, Figures, NavigationAccuracy, Ratio};

/// Fewer runs than this make a rough interval.
const FEW: usize = 30;
/// NIS that whole pulses leave a filter, whose noise is taken for Gaussian.
const PULSES: (f64, f64) = (0.9, 1.1);

/// Every sentence, the most important first.
pub fn say(document: &mut Document, accuracy: &Accuracy) {
    let mut say = |(good, text): (bool, String)| document.say(good, text);
    say(convergence(accuracy));
    say(against_bound(accuracy));
    say(nees(accuracy));
    let nis = [
        ("zero velocity", &accuracy.velocity),
        ("table attitude", &accuracy.table),
    ];
    let nis = nis.into_iter().filter(|(_, nis)| nis.count > 0);
    nis.clone()
        .for_each(|(name, nis)| say(innovations(accuracy, name, nis)));
    nis.for_each(|(name, nis)| say(whiteness(name, nis)));
    accuracy
        .navigation
        .iter()
        .filter_map(containment)
        .for_each(&mut say);
    for (journey, reason) in &accuracy.not_navigated {
        let journey = journey_name(*journey);
        say((
            false,
            format!("Not navigated from this site, {journey}: {reason}."),
        ));
    }
    form(accuracy).into_iter().for_each(&mut say);
    if let Some(advice) = ErrorTermTest::most_significant(&accuracy.effects, None) {
        say((false, format!("In the first run: {advice}")));
    }
    gain(accuracy).into_iter().for_each(&mut say);
    let runs = accuracy.trials.len();
    if runs < FEW {
        let text =
            format!("{runs} runs are few: the intervals of the ratios are rough below {FEW}.");
        say((false, text));
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
        "{failed} of {runs} runs failed. {without} of them gave no estimate at all and are not in any RMS; \
         the others are."
    );
    (false, text)
}

/// On which side of 1 an interval lies.
fn beside_one(ratio: &Ratio) -> Ordering {
    match ratio.interval {
        (low, _) if low > 1.0 => Ordering::Greater,
        (_, high) if high < 1.0 => Ordering::Less,
        _ => Ordering::Equal,
    }
}

/// What has a ratio that is chosen, named with it.
fn named(
    accuracy: &Accuracy,
    of: impl Fn(&Figures) -> Option<Ratio>,
    chosen: impl Fn(&Ratio) -> bool,
) -> String {
    let all = compared(accuracy).into_iter();
    let all = all.filter_map(|compared| Some((compared.title, of(compared.figures)?)));
    let named = all
        .filter(|(_, ratio)| chosen(ratio))
        .map(|(title, ratio)| {
            let [by, interval] = with_interval(ratio.value, ratio.interval);
            format!("{title} {by} ({interval})")
        });
    named.collect::<Vec<_>>().join(", ")
}

fn against_bound(accuracy: &Accuracy) -> (bool, String) {
    let of = |figures: &Figures| figures.ratio;
    let (form, truth) = (
        accuracy.study.form,
        accuracy.study.scenario.installation.form,
    );
    if !form.holds(truth) {
        let text = format!(
            "The {} form cannot hold the truth, which is {}. The bound is that of the general form; against \
             it the wrong form costs a factor of: {}.",
            form.name(),
            truth.name(),
            named(accuracy, of, |_| true)
        );
        return (false, text);
    }
    let outside = named(accuracy, of, |ratio| beside_one(ratio).is_ne());
    if outside.is_empty() {
        let text = "RMS error over bound is 1 within its 99 % interval everywhere: nothing shows the filter to \
                    be worse than the best there can be.";
        return (true, text.to_owned());
    }
    let text = format!(
        "RMS error over bound is not 1 within its 99 % interval: {outside}. By chance one interval in a \
         hundred misses."
    );
    (false, text)
}

fn nees(accuracy: &Accuracy) -> (bool, String) {
    let Some(anees) = accuracy.anees else {
        let text = "No run gave an estimate: nothing can be said of its σ.";
        return (false, text.to_owned());
    };
    let within = |(low, high): (f64, f64)| (low..=high).contains(&anees.mean);
    let mean = tables::mean(anees.mean, anees.interval_95);
    let (inner, outer) = (interval(anees.interval_95), interval(anees.interval_998));
    if within(anees.interval_95) {
        let text = format!(
            "ANEES {mean} lies within its 95 % interval {inner}: the claimed σ are true, correlations included."
        );
        return (true, text);
    }
    if within(anees.interval_998) {
        let text = format!(
            "ANEES {mean} lies outside its 95 % interval {inner}, as in one study of twenty, but within that \
             of 99.8 %, {outer}."
        );
        return (true, text);
    }
    let (side, size) = if anees.mean > 1.0 {
        ("above", "small")
    } else {
        ("below", "large")
    };
    let factor = tables::factor(anees.mean.sqrt());
    let text = format!(
        "ANEES {mean} lies {side} its 99.8 % interval {outer}: the claimed σ are too {size}; errors are \
         {factor} times them."
    );
    (false, text)
}

fn innovations(accuracy: &Accuracy, name: &str, nis: &Nis) -> (bool, String) {
    let (low, high) = nis.interval;
    let (mean, shown) = (tables::mean(nis.mean, nis.interval), interval(nis.interval));
    if (low..=high).contains(&nis.mean) {
        return (
            true,
            format!("NIS of {name} {mean} lies within its 99.8 % interval {shown}."),
        );
    }
    let side = if nis.mean > high { "above" } else { "below" };
    let factor = tables::factor(nis.mean.sqrt());
    let mut text = format!(
        "NIS of {name} {mean} lies {side} its 99.8 % interval {shown}: innovations are {factor} times as large \
         as the filter takes them to be."
    );
    let pulses = accuracy.study.scenario.output == Output::Pulse
        && (PULSES.0..=PULSES.1).contains(&nis.mean);
    if pulses {
        text += " Whole pulses are not Gaussian noise: 0.9 to 1.1 is expected of them.";
    }
    (pulses, text)
}

fn whiteness(name: &str, nis: &Nis) -> (bool, String) {
    let within = white_within(nis);
    let (lag, limit) = (value(nis.lag_one, within), value(within, within));
    let white = nis.lag_one.abs() <= within;
    let (lies, are) = if white {
        ("within", "white")
    } else {
        ("outside", "not white")
    };
    let text = format!(
        "Lag-one correlation of the innovations of {name} {lag} lies {lies} ±{limit} (99 %): they are {are}."
    );
    (white, text)
}

fn containment(of: &NavigationAccuracy) -> Option<(bool, String)> {
    let runs = count(of.containment.first()?.runs);
    let good = of.containment.iter().all(Containment::as_claimed);
    let shown = of
        .containment
        .iter()
        .filter(|held| good || !held.as_claimed());
    let shares = shown.map(|held| {
        let found = percent(held.within as f64 / held.runs as f64);
        let claimed = percent(held.region.probability());
        format!(
            "{} {found} % (claimed {claimed} %)",
            region_name(held.region)
        )
    });
    let text = format!(
        "After 40 h, {}, the position error {} within its predicted σ as often as claimed in {runs} runs: {}.",
        journey_name(of.journey),
        if good { "lies" } else { "does not lie" },
        shares.collect::<Vec<_>>().join(", ")
    );
    Some((good, text))
}

fn form(accuracy: &Accuracy) -> Option<(bool, String)> {
    let (rejections, tested @ 1..) = accuracy.rejections() else {
        return None;
    };
    let (form, truth) = (
        accuracy.study.form,
        accuracy.study.scenario.installation.form,
    );
    let mut text = format!(
        "The data reject the {} form against the general one in {} of {} runs.",
        form.name(),
        count(rejections),
        count(tested)
    );
    if form.holds(truth) {
        text += " It is the right one; one run in a thousand rejects it by chance.";
    }
    // Three σ of a Poisson number beyond what chance gives.
    let by_chance = 1e-3 * tested as f64;
    let few = rejections as f64 <= by_chance + 3.0 * by_chance.sqrt();
    Some((form.holds(truth) && few, text))
}

fn gain(accuracy: &Accuracy) -> Vec<(bool, String)> {
    let filter = minutes(accuracy.table_time);
    let closed = minutes(accuracy.baseline.table_time);
    let sides = [Ordering::Greater, Ordering::Equal, Ordering::Less].into_iter();
    let sentences = sides.filter_map(|side| {
        let named = named(accuracy, |f| f.gain, |ratio| beside_one(ratio) == side);
        let than = format!("than the closed form in {closed}");
        let text = match side {
            _ if named.is_empty() => return None,
            Ordering::Greater => {
                format!("In {filter} the EKF is more accurate {than}, by a factor of: {named}.")
            }
            Ordering::Equal => format!(
                "There is no significant difference between the EKF in {filter} and the closed form in {closed}; \
                 the gain is: {named}."
            ),
            Ordering::Less => {
                format!("In {filter} the EKF is less accurate {than}; the gain is: {named}.")
            }
        };
        Some((side.is_ge(), text))
    });
    sentences.collect()
}
