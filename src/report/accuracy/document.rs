//! The study as one JSON document. What is not a number is null.

use std::collections::BTreeMap;

use serde::Serialize;

use super::facts::{passes, rejected};
use super::verdict::white_within;
use crate::calibration::outcome::Nis;
use crate::imu::InstallationForm;
use crate::study::{Accuracy, GroupAccuracy, Ratio};

#[derive(Serialize)]
struct Document<'a> {
    scenario: &'a str,
    path: &'a str,
    seed: u64,
    installation_form: InstallationForm,
    truth_installation_form: InstallationForm,
    /// Whether the filter's form can hold the truth; if not, the bound is that of the general form.
    form_holds_truth: bool,
    runs: usize,
    failures: usize,
    failure_reasons: Vec<Failure<'a>>,
    anees: Option<f64>,
    anees_interval: Option<(f64, f64)>,
    anees_interval_998: Option<(f64, f64)>,
    /// Directions of one run that have a σ.
    anees_directions: Option<usize>,
    nis: Innovations,
    passes: Option<Passes>,
    rejected_observations: usize,
    form_rejections: Option<FormRejections>,
    #[serde(flatten)]
    groups: BTreeMap<String, Group>,
}

#[derive(Serialize)]
struct Failure<'a> {
    run: u64,
    reason: &'a str,
}

#[derive(Serialize)]
struct Innovations {
    velocity: Option<Consistency>,
    table: Option<Consistency>,
}

#[derive(Serialize)]
struct Consistency {
    mean: f64,
    interval_998: (f64, f64),
    lag_one: f64,
    /// 99 % if the innovations are white.
    lag_one_interval: (f64, f64),
    scalars: usize,
}

#[derive(Serialize)]
struct Passes {
    median: f64,
    largest: usize,
}

#[derive(Serialize)]
struct FormRejections {
    rejected: usize,
    tested: usize,
}

/// Figures in the unit that the key names. Intervals are of 99 %.
#[derive(Serialize)]
struct Group {
    ekf_rms: f64,
    claimed_rms: f64,
    bound_rms: f64,
    ratio: Option<f64>,
    ratio_interval: Option<(f64, f64)>,
    six_position_rms: Option<f64>,
    gain: Option<f64>,
    gain_interval: Option<(f64, f64)>,
    six_position_rms_equal_time: Option<f64>,
    gain_equal_time: Option<f64>,
    gain_equal_time_interval: Option<(f64, f64)>,
    ekf_table_time_s: f64,
    six_position_table_time_s: f64,
    six_position_equal_table_time_s: Option<f64>,
}

/// All figures of the study.
pub fn document(accuracy: &Accuracy) -> impl Serialize {
    let study = &accuracy.study;
    let (form, truth) = (study.form, study.scenario.installation.form);
    let (rejections, tested) = accuracy.rejections();
    Document {
        scenario: &study.scenario.name,
        path: &study.scenario.path_name,
        seed: study.seed,
        installation_form: form,
        truth_installation_form: truth,
        form_holds_truth: form.holds(truth),
        runs: accuracy.trials.len(),
        failures: accuracy.failures().count(),
        failure_reasons: accuracy
            .failures()
            .map(|(run, reason)| Failure { run, reason })
            .collect(),
        anees: accuracy.anees.map(|anees| anees.mean),
        anees_interval: accuracy.anees.map(|anees| anees.interval_95),
        anees_interval_998: accuracy.anees.map(|anees| anees.interval_998),
        anees_directions: accuracy.anees.map(|anees| anees.directions),
        nis: Innovations {
            velocity: consistency(&accuracy.velocity),
            table: consistency(&accuracy.table),
        },
        passes: passes(accuracy).map(|(median, largest)| Passes { median, largest }),
        rejected_observations: rejected(accuracy).0,
        form_rejections: (tested > 0).then_some(FormRejections {
            rejected: rejections,
            tested,
        }),
        groups: accuracy
            .groups
            .iter()
            .map(|of| (of.group.key(), group(accuracy, of)))
            .collect(),
    }
}

fn consistency(nis: &Nis) -> Option<Consistency> {
    let white = white_within(nis);
    (nis.count > 0).then_some(Consistency {
        mean: nis.mean,
        interval_998: nis.interval,
        lag_one: nis.lag_one,
        lag_one_interval: (-white, white),
        scalars: nis.count,
    })
}

fn group(accuracy: &Accuracy, of: &GroupAccuracy) -> Group {
    let unit = of.group.unit_value();
    let shown = |rms: Option<f64>| rms.map(|rms| rms / unit);
    let split = |ratio: Option<Ratio>| (ratio.map(|r| r.value), ratio.map(|r| r.interval));
    let (ratio, ratio_interval) = split(of.ratio);
    let (gain, gain_interval) = split(of.gain);
    let (gain_equal_time, gain_equal_time_interval) = split(of.gain_in_equal_time);
    Group {
        ekf_rms: of.filter / unit,
        claimed_rms: of.claimed / unit,
        bound_rms: of.bound / unit,
        ratio,
        ratio_interval,
        six_position_rms: shown(of.closed_form),
        gain,
        gain_interval,
        six_position_rms_equal_time: shown(of.closed_form_in_equal_time),
        gain_equal_time,
        gain_equal_time_interval,
        ekf_table_time_s: accuracy.table_time,
        six_position_table_time_s: accuracy.baseline.table_time,
        six_position_equal_table_time_s: accuracy.baseline.equal_time(),
    }
}
