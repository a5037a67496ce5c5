//! The experiment as one JSON document. What is not a number is null.

use std::collections::BTreeMap;

use serde::Serialize;

use super::tables::PAPER;
use super::{hours, miles};
use crate::imu::{InstallationForm, Sensor};
use crate::study::Experiment;
use crate::study::experiment::{ALIGNMENT_TIME, Estimator, Method, Navigated, Situation, Worth};
use crate::units::DEGREE;

#[derive(Serialize)]
struct Document<'a> {
    scenario: &'a str,
    trajectory: &'a str,
    samples: usize,
    seed: u64,
    hours: f64,
    latitude_deg: f64,
    truth_installation_form: InstallationForm,
    alignment_time_s: f64,
    standing_self_aligned: Option<Mission>,
    standing_aligned: Option<Mission>,
    moving: Option<Mission>,
    paper: Vec<Paper>,
}

#[derive(Serialize)]
struct Mission {
    methods: Vec<MethodFigures>,
    noise_alone_nmile: Spread,
}

#[derive(Serialize)]
struct MethodFigures {
    method: &'static str,
    installation_form: InstallationForm,
    table_time_s: f64,
    failures: usize,
    not_converged: usize,
    form_rejections: usize,
    position_nmile: Spread,
    /// 99 %, bootstrap over instruments.
    median_interval: (f64, f64),
    largest_position_nmile: Spread,
    gyro_errors_alone_nmile: Spread,
    accel_errors_alone_nmile: Spread,
    /// Median of the closed form in the same form over that of this method.
    closed_form_over_ekf: Option<f64>,
    /// 99 %.
    closed_form_over_ekf_interval: Option<(f64, f64)>,
    claimed_rms_nmile: f64,
    budget: BTreeMap<String, Part>,
    median_against_time: Vec<Point>,
    /// Of each instrument, in order.
    positions_nmile: Vec<f64>,
}

#[derive(Serialize)]
struct Spread {
    median: f64,
    mean: f64,
    rms: f64,
    below_68_percent: f64,
    below_95_percent: f64,
}

impl Spread {
    fn of(metres: &crate::study::experiment::Spread) -> Self {
        Self {
            median: miles(metres.median),
            mean: miles(metres.mean),
            rms: miles(metres.rms),
            below_68_percent: miles(metres.below_68),
            below_95_percent: miles(metres.below_95),
        }
    }
}

#[derive(Serialize)]
struct Part {
    alone_rms_nmile: f64,
    share: f64,
}

#[derive(Serialize)]
struct Point {
    t_h: f64,
    position_nmile: f64,
}

#[derive(Serialize)]
struct Paper {
    errors: &'static str,
    installation_form: InstallationForm,
    position_nmile: f64,
}

/// All figures of the experiment.
pub fn document(experiment: &Experiment) -> impl Serialize {
    let study = &experiment.study;
    let mission = |situation| {
        let all = experiment.navigations.iter();
        let navigated = all.into_iter().find(|n| n.situation == situation);
        navigated.map(|navigated| mission(experiment, navigated))
    };
    Document {
        scenario: &study.scenario.name,
        trajectory: &study.trajectory_name,
        samples: experiment.trials.len(),
        seed: study.seed,
        hours: hours(experiment),
        latitude_deg: study.scenario.site.latitude / DEGREE,
        truth_installation_form: study.scenario.installation.form,
        alignment_time_s: ALIGNMENT_TIME,
        standing_self_aligned: mission(Situation::SelfAligned),
        standing_aligned: mission(Situation::Aligned),
        moving: mission(Situation::Moving),
        paper: PAPER
            .iter()
            .map(|&(sensor, installation_form, position_nmile)| Paper {
                errors: sensor.name(),
                installation_form,
                position_nmile,
            })
            .collect(),
    }
}

fn mission(experiment: &Experiment, navigated: &Navigated) -> Mission {
    let all = navigated.methods.iter().enumerate();
    Mission {
        methods: all
            .map(|(place, worth)| figures(experiment, place, worth))
            .collect(),
        noise_alone_nmile: Spread::of(&navigated.noise),
    }
}

fn figures(experiment: &Experiment, place: usize, worth: &Worth) -> MethodFigures {
    let Method { estimator, form } = worth.method;
    let calibrations = || {
        let trials = experiment.trials.iter();
        trials.filter_map(|trial| trial.calibrations.get(place))
    };
    let (low, high) = worth.median_interval;
    MethodFigures {
        method: match estimator {
            Estimator::ClosedForm => "six-position",
            Estimator::Filter => "ekf",
            Estimator::LongFilter => "ekf-equal-time",
        },
        installation_form: form,
        table_time_s: experiment
            .table_times
            .get(place)
            .copied()
            .unwrap_or(f64::NAN),
        failures: calibrations().filter(|c| c.is_err()).count(),
        not_converged: calibrations().flatten().filter(|c| !c.converged).count(),
        form_rejections: calibrations().flatten().filter(|c| c.rejects_form).count(),
        position_nmile: Spread::of(&worth.at_end),
        median_interval: (miles(low), miles(high)),
        largest_position_nmile: Spread::of(&worth.largest),
        gyro_errors_alone_nmile: Spread::of(worth.by_one.get(Sensor::Gyro)),
        accel_errors_alone_nmile: Spread::of(worth.by_one.get(Sensor::Accel)),
        closed_form_over_ekf: worth.gain.map(|gain| gain.value),
        closed_form_over_ekf_interval: worth.gain.map(|gain| gain.interval),
        claimed_rms_nmile: miles(worth.budget.claimed),
        budget: worth
            .budget
            .parts
            .iter()
            .map(|part| {
                let (alone_rms_nmile, share) = (miles(part.alone), part.share);
                let part_of_group = Part {
                    alone_rms_nmile,
                    share,
                };
                (part.group.key(), part_of_group)
            })
            .collect(),
        median_against_time: worth
            .against_time
            .iter()
            .map(|&(time, metres)| Point {
                t_h: time / super::HOUR,
                position_nmile: miles(metres),
            })
            .collect(),
        positions_nmile: worth.errors.iter().map(|&metres| miles(metres)).collect(),
    }
}
