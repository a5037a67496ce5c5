//! What the figures say, in sentences.

use super::super::effects;
use super::super::number::{count, interval, minutes, value, with_interval};
use super::tables::{self, percent};
use super::{compared, journey_name, region_name};
use crate::calibration::outcome::Nis;
use crate::imu::Output;
use crate::study::accuracy::Containment;
use crate::study::{Accuracy, Figures, NavigationAccuracy, Ratio};

/// Fewer runs than this make a rough interval.
const FEW: usize = 30;
/// 99 % of a normal distribution lie within this many σ.
const SIGMAS_99: f64 = 2.576;
/// NIS that whole pulses leave a filter, whose noise is taken for Gaussian.
const PULSES: (f64, f64) = (0.9, 1.1);

/// One thing that a study says.
struct Sentence {
    /// Whether it is as one would wish; if not, a user must know it before trusting the figures.
    good: bool,
    text: String,
}

/// What is as one would wish, and what a user must know before trusting the figures; the most important first.
pub(super) fn verdict(accuracy: &Accuracy) -> (Vec<String>, Vec<String>) {
    let mut sentences = vec![
        convergence(accuracy),
        against_bound(accuracy),
        nees(accuracy),
    ];
    sentences.extend(observations(accuracy).map(|(name, nis)| innovations(accuracy, name, nis)));
    sentences.extend(observations(accuracy).map(|(name, nis)| whiteness(name, nis)));
    sentences.extend(accuracy.navigation.iter().filter_map(containment));
    sentences.extend(not_navigated(accuracy));
    sentences.extend(form(accuracy));
    sentences.extend(effects::advice(&accuracy.effects).map(|advice| Sentence {
        good: false,
        text: format!("In the first run: {advice}"),
    }));
    sentences.extend(gain(accuracy));
    if accuracy.trials.len() < FEW {
        let runs = accuracy.trials.len();
        sentences.push(Sentence {
            good: false,
            text: format!(
                "{runs} runs are few: the intervals of the ratios are rough below {FEW}."
            ),
        });
    }
    let (good, bad): (Vec<_>, Vec<_>) = sentences.into_iter().partition(|s| s.good);
    let texts = |of: Vec<Sentence>| of.into_iter().map(|s| s.text).collect();
    (texts(good), texts(bad))
}

/// What the lag-one correlation of white innovations stays within in 99 of 100 studies.
pub(super) fn white_within(nis: &Nis) -> f64 {
    SIGMAS_99 / (nis.count as f64).sqrt()
}

fn observations(accuracy: &Accuracy) -> impl Iterator<Item = (&'static str, &Nis)> {
    [
        ("zero velocity", &accuracy.velocity),
        ("table attitude", &accuracy.table),
    ]
    .into_iter()
    .filter(|(_, nis)| nis.count > 0)
}

fn convergence(accuracy: &Accuracy) -> Sentence {
    let (runs, failed) = (accuracy.trials.len(), accuracy.failures().count());
    let without = accuracy.trials.iter().filter(|t| t.filtered.is_none());
    let text = if failed == 0 {
        format!("All {} runs converged.", count(runs))
    } else {
        format!(
            "{} of {} runs failed. {} of them gave no estimate at all and are not in any RMS; the \
             others are.",
            count(failed),
            count(runs),
            count(without.count())
        )
    };
    Sentence {
        good: failed == 0,
        text,
    }
}

/// Where an interval lies seen from 1.
fn beside_one(ratio: &Ratio) -> std::cmp::Ordering {
    let (low, high) = ratio.interval;
    match () {
        () if low > 1.0 => std::cmp::Ordering::Greater,
        () if high < 1.0 => std::cmp::Ordering::Less,
        () => std::cmp::Ordering::Equal,
    }
}

/// What has a ratio, named with it.
fn named(
    accuracy: &Accuracy,
    of: impl Fn(&Figures) -> Option<Ratio>,
    chosen: impl Fn(&Ratio) -> bool,
) -> Vec<String> {
    let all = compared(accuracy).into_iter();
    let with_ratio = all.filter_map(|m| Some((of(m.figures)?, m.title)));
    with_ratio
        .filter(|(ratio, _)| chosen(ratio))
        .map(|(r, title)| {
            let [by, interval] = with_interval(r.value, r.interval);
            format!("{title} {by} ({interval})")
        })
        .collect()
}

fn against_bound(accuracy: &Accuracy) -> Sentence {
    let of = |figures: &Figures| figures.ratio;
    let (form, truth) = (
        accuracy.study.form,
        accuracy.study.scenario.installation.form,
    );
    if !form.holds(truth) {
        return Sentence {
            good: false,
            text: format!(
                "The {} form cannot hold the truth, which is {}. The bound is that of the general form; \
                 against it the wrong form costs a factor of: {}.",
                form.name(),
                truth.name(),
                named(accuracy, of, |_| true).join(", ")
            ),
        };
    }
    let outside = named(accuracy, of, |ratio| beside_one(ratio).is_ne());
    let text = if outside.is_empty() {
        "RMS error over bound is 1 within its 99 % interval everywhere: nothing shows the filter to \
         be worse than the best there can be."
            .to_owned()
    } else {
        format!(
            "RMS error over bound is not 1 within its 99 % interval: {}. By chance one interval in a \
             hundred misses.",
            outside.join(", ")
        )
    };
    Sentence {
        good: outside.is_empty(),
        text,
    }
}

fn nees(accuracy: &Accuracy) -> Sentence {
    let Some(anees) = accuracy.anees else {
        return Sentence {
            good: false,
            text: "No run gave an estimate: nothing can be said of its σ.".to_owned(),
        };
    };
    let within = |(low, high): (f64, f64)| (low..=high).contains(&anees.mean);
    let mean = tables::mean(anees.mean, anees.interval_95);
    let (inner, outer) = (interval(anees.interval_95), interval(anees.interval_998));
    let (good, text) = if within(anees.interval_95) {
        (
            true,
            format!(
                "ANEES {mean} lies within its 95 % interval {inner}: the claimed σ are true, \
                 correlations included."
            ),
        )
    } else if within(anees.interval_998) {
        (
            true,
            format!(
                "ANEES {mean} lies outside its 95 % interval {inner}, as in one study of twenty, but \
                 within that of 99.8 %, {outer}."
            ),
        )
    } else {
        let (side, size) = if anees.mean > 1.0 {
            ("above", "small")
        } else {
            ("below", "large")
        };
        let factor = tables::factor(anees.mean.sqrt());
        (
            false,
            format!(
                "ANEES {mean} lies {side} its 99.8 % interval {outer}: the claimed σ are too {size}; \
                 errors are {factor} times them."
            ),
        )
    };
    Sentence { good, text }
}

fn innovations(accuracy: &Accuracy, name: &str, nis: &Nis) -> Sentence {
    let (low, high) = nis.interval;
    let mean = tables::mean(nis.mean, nis.interval);
    let shown = interval(nis.interval);
    if (low..=high).contains(&nis.mean) {
        return Sentence {
            good: true,
            text: format!("NIS of {name} {mean} lies within its 99.8 % interval {shown}."),
        };
    }
    let side = if nis.mean > high { "above" } else { "below" };
    let factor = tables::factor(nis.mean.sqrt());
    let mut text = format!(
        "NIS of {name} {mean} lies {side} its 99.8 % interval {shown}: innovations are {factor} times \
         as large as the filter takes them to be."
    );
    let pulses = accuracy.study.scenario.output == Output::Pulse
        && (PULSES.0..=PULSES.1).contains(&nis.mean);
    if pulses {
        text.push_str(" Whole pulses are not Gaussian noise: 0.9 to 1.1 is expected of them.");
    }
    Sentence { good: pulses, text }
}

fn whiteness(name: &str, nis: &Nis) -> Sentence {
    let within = white_within(nis);
    let (lag, within_shown) = (value(nis.lag_one, within), value(within, within));
    let good = nis.lag_one.abs() <= within;
    let verb = if good { "lies within" } else { "lies outside" };
    let rest = if good { "white" } else { "not white" };
    Sentence {
        good,
        text: format!(
            "Lag-one correlation of the innovations of {name} {lag} {verb} ±{within_shown} (99 %): they \
             are {rest}."
        ),
    }
}

fn containment(of: &NavigationAccuracy) -> Option<Sentence> {
    let runs = of.containment.first()?.runs;
    let all = || of.containment.iter();
    let shown = |chosen: &dyn Fn(&&Containment) -> bool| -> String {
        let shares: Vec<String> = all()
            .filter(chosen)
            .map(|held| {
                let found = held.within as f64 / held.runs as f64;
                format!(
                    "{} {} % (claimed {} %)",
                    region_name(held.region),
                    percent(found),
                    percent(held.region.probability())
                )
            })
            .collect();
        shares.join(", ")
    };
    let good = all().all(Containment::as_claimed);
    let journey = journey_name(of.journey);
    let runs = count(runs);
    let text = if good {
        format!(
            "After 40 h, {journey}, the position error lies within its predicted σ as often as claimed \
             in {runs} runs: {}.",
            shown(&|_| true)
        )
    } else {
        format!(
            "After 40 h, {journey}, the position error does not lie within its predicted σ as often as \
             claimed in {runs} runs: {}.",
            shown(&|held| !held.as_claimed())
        )
    };
    Some(Sentence { good, text })
}

fn not_navigated(accuracy: &Accuracy) -> impl Iterator<Item = Sentence> {
    let all = accuracy.not_navigated.iter();
    all.map(|(journey, reason)| Sentence {
        good: false,
        text: format!(
            "Not navigated from this site, {}: {reason}.",
            journey_name(*journey)
        ),
    })
}

fn form(accuracy: &Accuracy) -> Option<Sentence> {
    let (rejections, tested @ 1..) = accuracy.rejections() else {
        return None;
    };
    let (form, truth) = (
        accuracy.study.form,
        accuracy.study.scenario.installation.form,
    );
    let holds = form.holds(truth);
    let mut text = format!(
        "The data reject the {} form against the general one in {} of {} runs.",
        form.name(),
        count(rejections),
        count(tested)
    );
    if holds {
        text.push_str(" It is the right one; one run in a thousand rejects it by chance.");
    }
    // Three σ of a Poisson number beyond what chance gives.
    let by_chance = 1e-3 * tested as f64;
    Some(Sentence {
        good: holds && rejections as f64 <= by_chance + 3.0 * by_chance.sqrt(),
        text,
    })
}

fn gain(accuracy: &Accuracy) -> Vec<Sentence> {
    let (filter, closed) = (
        minutes(accuracy.table_time),
        minutes(accuracy.baseline.table_time),
    );
    let chosen = |side| named(accuracy, |f| f.gain, move |r| beside_one(r) == side);
    [
        (
            std::cmp::Ordering::Greater,
            format!("In {filter} the EKF is more accurate than the closed form in {closed}, by a factor of"),
        ),
        (
            std::cmp::Ordering::Equal,
            format!("No difference is shown between the EKF in {filter} and the closed form in {closed}; the gain is"),
        ),
        (
            std::cmp::Ordering::Less,
            format!("In {filter} the EKF is less accurate than the closed form in {closed}; the gain is"),
        ),
    ]
    .into_iter()
    .filter_map(|(side, what)| {
        let groups = chosen(side);
        (!groups.is_empty()).then(|| Sentence {
            good: side.is_ge(),
            text: format!("{what}: {}.", groups.join(", ")),
        })
    })
    .collect()
}
