//! The figures of the study by name; intervals of ratios are of 99 %.

use serde_json::{Map, Value, json};

use super::compared::white_within;
use super::facts::{passes, rejected};
use crate::calibration::Nis;
use crate::calibration::result::BlockRecord;
use crate::study::accuracy::{Containment, Journey, Region};
use crate::study::navigation::{FORTY_HOURS, INTERVAL};
use crate::study::{Accuracy, Figures};
use crate::units::{DEGREE, NAUTICAL_MILE};

pub(super) fn data(accuracy: &Accuracy) -> Value {
    let study = &accuracy.study;
    let (form, truth) = (study.form, study.scenario.installation.form);
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
        "rejected_observations": rejected(accuracy).0,
        "form_rejections":
            (tested > 0).then(|| json!({ "rejected": rejections, "tested": tested })),
    });
    for of in &accuracy.groups {
        data[of.group.key()] = figures(accuracy, &of.figures, of.group.unit_value());
    }
    let terms = accuracy.error_terms.iter().map(|(term, of)| {
        let data = json!({
            "ekf_rms": of.filter,
            "claimed_rms": of.claimed,
            "bound_rms": of.bound,
            "ratio": of.ratio.map(|r| r.value),
            "ratio_interval": of.ratio.map(|r| r.interval),
        });
        (term.name().to_owned(), data)
    });
    data["blocks"] = Value::Object(terms.collect::<Map<_, _>>());
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

/// One for each mission, or why it cannot be navigated from the scenario's site.
fn navigation(accuracy: &Accuracy) -> Value {
    let mission = |journey, reason: Option<String>, position: Option<Value>, containment: Value| {
        json!({
            "mission": match journey {
                Journey::Standing => "standing",
                Journey::Flight => "flight",
            },
            "hours": f64::from(FORTY_HOURS) * INTERVAL / 3600.0,
            "latitude_deg": accuracy.study.scenario.site.latitude / DEGREE,
            "not_navigated": reason,
            "position_nmile": position,
            "containment": containment,
        })
    };
    let navigated = accuracy.navigation.iter().map(|of| {
        let position = figures(accuracy, &of.figures, NAUTICAL_MILE);
        let containment = of.containment.iter().map(containment).collect();
        mission(of.journey, None, Some(position), containment)
    });
    let others = accuracy.not_navigated.iter();
    let others = others.map(|(journey, reason)| {
        mission(
            *journey,
            Some(reason.to_string()),
            None,
            Value::Array(Vec::new()),
        )
    });
    navigated.chain(others).collect()
}

/// How many runs have their position error within a region that their predicted covariance marks out.
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

fn figures(accuracy: &Accuracy, of: &Figures, unit: f64) -> Value {
    json!({
        "ekf_rms": of.filter / unit,
        "claimed_rms": of.claimed / unit,
        "bound_rms": of.bound / unit,
        "ratio": of.ratio.map(|r| r.value),
        "ratio_interval": of.ratio.map(|r| r.interval),
        "six_position_rms": of.closed_form.map(|rms| rms / unit),
        "gain": of.gain.map(|r| r.value),
        "gain_interval": of.gain.map(|r| r.interval),
        "six_position_rms_equal_time": of.closed_form_in_equal_time.map(|rms| rms / unit),
        "gain_equal_time": of.gain_in_equal_time.map(|r| r.value),
        "gain_equal_time_interval": of.gain_in_equal_time.map(|r| r.interval),
        "ekf_table_time_s": accuracy.table_time,
        "six_position_table_time_s": accuracy.baseline.table_time,
        "six_position_equal_table_time_s": accuracy.baseline.equal_time(),
    })
}
