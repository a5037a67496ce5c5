//! The study as one JSON document. What is not a number is null.

use std::collections::BTreeMap;

use serde::Serialize;

use super::facts::{passes, rejected};
use super::merit::journey_name;
use super::verdict::white_within;
use crate::calibration::Nis;
use crate::imu::InstallationForm;
use crate::calibration::result::BlockRecord;
use crate::study::accuracy::{self, Region};
use crate::study::navigation::{FORTY_HOURS, INTERVAL};
use crate::study::{Accuracy, Figures, Ratio};
use crate::units::{DEGREE, NAUTICAL_MILE};

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
    groups: BTreeMap<String, Merit>,
    /// Each block of states beside K, E and D that was estimated, in SI.
    blocks: BTreeMap<&'static str, Block>,
    /// What blocks of states did to the filter in the first run, or would have done.
    test_error_terms: Vec<BlockRecord>,
    /// One for each mission.
    navigation: Vec<Navigation>,
}

#[derive(Serialize)]
struct Block {
    ekf_rms: f64,
    claimed_rms: f64,
    bound_rms: f64,
    ratio: Option<f64>,
    ratio_interval: Option<(f64, f64)>,
}

#[derive(Serialize)]
struct Navigation {
    mission: &'static str,
    hours: f64,
    latitude_deg: f64,
    /// Why it cannot be navigated from the scenario's site; then there are no figures.
    not_navigated: Option<String>,
    position_nmile: Option<Merit>,
    containment: Vec<Containment>,
}

/// How many runs have their position error within a region that their predicted covariance marks out.
#[derive(Serialize)]
struct Containment {
    region: &'static str,
    /// Semi-axes of the region in σ.
    sigmas: f64,
    probability: f64,
    runs: usize,
    within: usize,
    /// 99 % if the covariance is true.
    within_interval: (usize, usize),
    as_claimed: bool,
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
struct Merit {
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
            .map(|of| {
                let unit = of.group.unit_value();
                (of.group.key(), merit(accuracy, &of.figures, unit))
            })
            .collect(),
        blocks: accuracy
            .further
            .iter()
            .map(|of| {
                let block = Block {
                    ekf_rms: of.filter,
                    claimed_rms: of.claimed,
                    bound_rms: of.bound,
                    ratio: of.ratio.map(|r| r.value),
                    ratio_interval: of.ratio.map(|r| r.interval),
                };
                (of.block.name(), block)
            })
            .collect(),
        test_error_terms: accuracy.effects.iter().map(BlockRecord::from).collect(),
        navigation: navigation(accuracy),
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

fn navigation(accuracy: &Accuracy) -> Vec<Navigation> {
    let mission = |journey| Navigation {
        mission: journey_name(journey),
        hours: f64::from(FORTY_HOURS) * INTERVAL / 3600.0,
        latitude_deg: accuracy.study.scenario.site.latitude / DEGREE,
        not_navigated: None,
        position_nmile: None,
        containment: Vec::new(),
    };
    let navigated = accuracy.navigation.iter().map(|of| Navigation {
        position_nmile: Some(merit(accuracy, &of.figures, NAUTICAL_MILE)),
        containment: of.containment.iter().map(containment).collect(),
        ..mission(of.journey)
    });
    let others = accuracy.not_navigated.iter();
    let others = others.map(|(journey, reason)| Navigation {
        not_navigated: Some(reason.to_string()),
        ..mission(*journey)
    });
    navigated.chain(others).collect()
}

fn containment(of: &accuracy::Containment) -> Containment {
    let (region, sigmas) = match of.region {
        Region::East => ("east", 1.0),
        Region::North => ("north", 1.0),
        Region::Ellipse(sigmas) => ("ellipse", sigmas),
    };
    Containment {
        region,
        sigmas,
        probability: of.region.probability(),
        runs: of.runs,
        within: of.within,
        within_interval: of.interval,
        as_claimed: of.as_claimed(),
    }
}

fn merit(accuracy: &Accuracy, of: &Figures, unit: f64) -> Merit {
    let shown = |rms: Option<f64>| rms.map(|rms| rms / unit);
    let split = |ratio: Option<Ratio>| (ratio.map(|r| r.value), ratio.map(|r| r.interval));
    let (ratio, ratio_interval) = split(of.ratio);
    let (gain, gain_interval) = split(of.gain);
    let (gain_equal_time, gain_equal_time_interval) = split(of.gain_in_equal_time);
    Merit {
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
