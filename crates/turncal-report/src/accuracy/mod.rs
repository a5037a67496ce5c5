//! The report of a study of accuracy.

mod figures;
mod tables;
#[cfg(test)]
mod tests;
mod verdict;

use crate::accuracy::tables::white_within;
use crate::prelude::*;
use crate::terms::{explained, title};
use turncal::calibration::result::BlockRecord;
use turncal::calibration::{ErrorTerm, Nis};
use turncal::study::accuracy::{Containment, Journey, Region};
use turncal::study::navigation::{FORTY_HOURS, INTERVAL};
use turncal::study::{Accuracy, Figures, NavigationAccuracy};

/// The complete report of the study.
pub fn document(accuracy: &Accuracy) -> Document {
    let mut document = Document::new(format!(
        "Accuracy of the filter in {} simulated runs of {}",
        count(accuracy.trials.len()),
        accuracy.study.scenario.name
    ));
    verdict::say(&mut document, accuracy);
    document.both(facts(accuracy));
    document.both(tables::bound(accuracy));
    document.both(tables::gain(accuracy));
    document.both(tables::consistency(accuracy));
    document.both(tables::auxiliary(accuracy));
    document.both(
        explained(&accuracy.effects).note("The evidence for the terms is from the first run."),
    );
    document.pages(figures::figures(accuracy));
    document.data = data(accuracy);
    document
}

/// Scenario and settings of the study.
pub fn facts(accuracy: &Accuracy) -> Facts {
    let (study, scenario) = (&accuracy.study, &accuracy.study.scenario);
    let (form, truth) = accuracy.forms();
    let (form, truth) = (form.name(), truth.name());
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
    let runs = format!("{}, seed {}", count(accuracy.trials.len()), study.seed);
    facts.push("runs", runs);
    let forms = format!(
        "the filter uses the {form} form, and the truth has the {truth} form; both are converted to the general form \
         for comparison"
    );
    facts.push("misalignment", forms);
    facts.push("aiding", aiding);
    facts.push("error terms", terms(accuracy));
    facts.push("table time", table_time(accuracy));
    facts.push("failures", failures(accuracy));
    facts
}

/// The error terms that were estimated, and those that were simulated only.
fn terms(accuracy: &Accuracy) -> String {
    let (scenario, unmodelled) = (&accuracy.study.scenario, &accuracy.study.unmodelled);
    let there = ErrorTerm::ALL.into_iter().filter(|&b| scenario.has(b));
    let (left_out, on): (Vec<_>, Vec<_>) = there.partition(|block| unmodelled.contains(block));
    let named = |blocks: Vec<ErrorTerm>| {
        let names: Vec<&str> = blocks.into_iter().map(title).collect();
        if names.is_empty() {
            "none".to_owned()
        } else {
            names.join(", ")
        }
    };
    let is_complete = left_out.is_empty();
    let mut text = format!("in addition to K, E and D: {}", named(on));
    if !is_complete {
        text += &format!("; simulated but not modelled: {}", named(left_out));
    }
    text
}

/// Median and largest number of passes; `None` if no run gave an estimate.
fn passes(accuracy: &Accuracy) -> Option<(f64, usize)> {
    let mut passes: Vec<usize> = accuracy.filtered().map(|of| of.passes).collect();
    passes.sort_unstable();
    let most = *passes.last()?;
    let [low, high] = [(passes.len() - 1) / 2, passes.len() / 2].map(|k| passes[k] as f64);
    Some((0.5 * (low + high), most))
}

fn table_time(accuracy: &Accuracy) -> String {
    let baseline = &accuracy.baseline;
    let cut = match baseline.equal_time() {
        Some(time) => format!(", also cut to {}", minutes(time)),
        None => "; the positions of the closed form do not fit into the table time of the EKF"
            .to_owned(),
    };
    let (filter, closed) = (minutes(accuracy.table_time), minutes(baseline.table_time));
    let path = &baseline.scenario.path_name;
    format!("EKF {filter}; closed form {closed} on the path {path}{cut}")
}

fn failures(accuracy: &Accuracy) -> String {
    match accuracy.failures().next() {
        None => "none".to_owned(),
        Some((run, reason)) => {
            let failed = count(accuracy.failures().count());
            format!("{failed}, the first in run {run}: {reason}")
        }
    }
}

/// The figures of a study as JSON.
pub fn data(accuracy: &Accuracy) -> Value {
    let study = &accuracy.study;
    let (form, truth) = accuracy.forms();
    let (rejections, tested) = accuracy.rejections();
    let failures = accuracy
        .failures()
        .map(|(run, reason)| json!({ "run": run, "reason": reason }));
    let mut data = json!({
        "scenario": study.scenario.name,
        "path": study.scenario.path_name,
        "seed": study.seed,
        "installation_form": form,
        "truth_installation_form": truth,
        "form_holds_truth": form.holds(truth),
        "runs": accuracy.trials.len(),
        "failures": accuracy.failures().count(),
        "failure_reasons": failures.collect::<Value>(),
        "anees": accuracy.anees.map(|anees| anees.mean),
        "anees_interval": accuracy.anees.map(|anees| anees.interval_95),
        "anees_interval_998": accuracy.anees.map(|anees| anees.interval_998),
        "anees_directions": accuracy.anees.map(|anees| anees.directions),
        "nis": { "velocity": nis(&accuracy.velocity), "table": nis(&accuracy.table) },
        "passes": passes(accuracy).map(|(median, most)| json!({ "median": median, "largest": most })),
        "form_rejections":
            (tested > 0).then(|| json!({ "rejected": rejections, "tested": tested })),
    });
    for (group, of) in &accuracy.groups {
        data[group.key()] = figures(accuracy, of, group.unit_value());
    }
    let terms = accuracy.error_terms.iter();
    let terms = terms.map(|(term, of)| (term.name().to_owned(), against_bound(of, 1.0)));
    data["blocks"] = Value::Object(terms.collect());
    let effects: Vec<BlockRecord> = accuracy.effects.iter().map(BlockRecord::from).collect();
    data["block_effects"] = json!(effects);
    data["navigation"] = navigation(accuracy);
    data
}

fn nis(nis: &Nis) -> Option<Value> {
    let white = white_within(nis);
    (nis.count > 0).then(|| {
        json!({
            "mean": nis.mean,
            "interval_998": nis.interval,
            "lag_one": nis.lag_one,
            "lag_one_interval": [-white, white],
            "scalars": nis.count,
        })
    })
}

/// One per mission, or the reason why it cannot be navigated from the site of the scenario.
fn navigation(accuracy: &Accuracy) -> Value {
    let mission = |journey, of: Option<&NavigationAccuracy>, reason: Option<String>| {
        let containment = of
            .into_iter()
            .flat_map(|of| &of.containment)
            .map(containment);
        json!({
            "mission": match journey {
                Journey::Standing => "standing",
                Journey::Flight => "flight",
            },
            "hours": f64::from(FORTY_HOURS) * INTERVAL / 3600.0,
            "latitude_deg": accuracy.study.scenario.site.latitude / DEGREE,
            "not_navigated": reason,
            "position_nmile": of.map(|of| figures(accuracy, &of.figures, NAUTICAL_MILE)),
            "containment": containment.collect::<Value>(),
        })
    };
    let navigated = accuracy.navigation.iter();
    let navigated = navigated.map(|of| mission(of.journey, Some(of), None));
    let others = accuracy.not_navigated.iter();
    let others = others.map(|(journey, reason)| mission(*journey, None, Some(reason.to_string())));
    navigated.chain(others).collect()
}

/// Number of runs whose position error is within a region given by the predicted covariance.
fn containment(of: &Containment) -> Value {
    let (region, sigmas) = match of.region {
        Region::East => ("east", 1.0),
        Region::North => ("north", 1.0),
        Region::Ellipse(sigmas) => ("ellipse", sigmas),
    };
    json!({
        "region": region,
        "sigmas": sigmas,
        "probability": of.region.probability(),
        "runs": of.runs,
        "within": of.within,
        "within_interval": of.interval,
        "as_claimed": of.as_claimed(),
    })
}

fn against_bound(of: &Figures, unit: f64) -> Value {
    json!({
        "ekf_rms": of.filter / unit,
        "claimed_rms": of.claimed / unit,
        "bound_rms": of.bound / unit,
        "ratio": of.ratio.map(|r| r.value),
        "ratio_interval": of.ratio.map(|r| r.interval),
    })
}

fn figures(accuracy: &Accuracy, of: &Figures, unit: f64) -> Value {
    let gain = json!({
        "six_position_rms": of.closed_form.map(|rms| rms / unit),
        "gain": of.gain.map(|r| r.value),
        "gain_interval": of.gain.map(|r| r.interval),
        "six_position_rms_equal_time": of.closed_form_in_equal_time.map(|rms| rms / unit),
        "gain_equal_time": of.gain_in_equal_time.map(|r| r.value),
        "gain_equal_time_interval": of.gain_in_equal_time.map(|r| r.interval),
        "ekf_table_time_s": accuracy.table_time,
        "six_position_table_time_s": accuracy.baseline.table_time,
        "six_position_equal_table_time_s": accuracy.baseline.equal_time(),
    });
    joined(against_bound(of, unit), gain)
}
