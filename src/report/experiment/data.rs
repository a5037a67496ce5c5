//! The figures of the experiment by name.

use serde_json::{Map, Value, json};

use super::names::{HOUR, hours, miles, navigated};
use super::tables::PAPER;
use crate::imu::Sensor;
use crate::study::Experiment;
use crate::study::experiment::{ALIGNMENT_TIME, Estimator, Situation, Spread, Worth};
use crate::units::DEGREE;

pub(super) fn data(experiment: &Experiment) -> Value {
    let study = &experiment.study;
    let mission = |situation| {
        let navigated = navigated(experiment, situation)?;
        let methods = navigated.methods.iter().enumerate();
        let methods = methods.map(|(place, worth)| method(experiment, place, worth));
        Some(json!({
            "methods": methods.collect::<Value>(),
            "noise_alone_nmile": spread(&navigated.noise),
        }))
    };
    let paper = PAPER.iter().map(|&(sensor, form, position)| {
        json!({ "errors": sensor.name(), "installation_form": form, "position_nmile": position })
    });
    json!({
        "scenario": study.scenario.name,
        "trajectory": study.trajectory_name,
        "samples": experiment.trials.len(),
        "seed": study.seed,
        "hours": hours(experiment),
        "latitude_deg": study.scenario.site.latitude / DEGREE,
        "truth_installation_form": study.scenario.installation.form,
        "alignment_time_s": ALIGNMENT_TIME,
        "standing_self_aligned": mission(Situation::SelfAligned),
        "standing_aligned": mission(Situation::Aligned),
        "moving": mission(Situation::Moving),
        "paper": paper.collect::<Value>(),
    })
}

fn spread(metres: &Spread) -> Value {
    json!({
        "median": miles(metres.median),
        "mean": miles(metres.mean),
        "rms": miles(metres.rms),
        "below_68_percent": miles(metres.below_68),
        "below_95_percent": miles(metres.below_95),
    })
}

/// Intervals are of 99 %, by bootstrap over instruments.
fn method(experiment: &Experiment, place: usize, worth: &Worth) -> Value {
    let calibrations = || {
        experiment
            .trials
            .iter()
            .filter_map(|t| t.calibrations.get(place))
    };
    let (low, high) = worth.median_interval;
    let budget = worth.budget.parts.iter().map(|part| {
        let data = json!({ "alone_rms_nmile": miles(part.alone), "share": part.share });
        (part.group.key(), data)
    });
    let against_time = worth.against_time.iter();
    let against_time = against_time
        .map(|&(time, metres)| json!({ "t_h": time / HOUR, "position_nmile": miles(metres) }));
    json!({
        "method": match worth.method.estimator {
            Estimator::ClosedForm => "six-position",
            Estimator::Filter => "ekf",
            Estimator::LongFilter => "ekf-equal-time",
        },
        "installation_form": worth.method.form,
        "table_time_s": experiment.table_times.get(place),
        "failures": calibrations().filter(|c| c.is_err()).count(),
        "not_converged": calibrations().flatten().filter(|c| !c.converged).count(),
        "form_rejections": calibrations().flatten().filter(|c| c.rejects_form).count(),
        "position_nmile": spread(&worth.at_end),
        "median_interval": [miles(low), miles(high)],
        "largest_position_nmile": spread(&worth.largest),
        "gyro_errors_alone_nmile": spread(worth.by_one.get(Sensor::Gyro)),
        "accel_errors_alone_nmile": spread(worth.by_one.get(Sensor::Accel)),
        "closed_form_over_ekf": worth.gain.map(|gain| gain.value),
        "closed_form_over_ekf_interval": worth.gain.map(|gain| gain.interval),
        "claimed_rms_nmile": miles(worth.budget.claimed),
        "budget": budget.collect::<Map<_, _>>(),
        "median_against_time": against_time.collect::<Value>(),
        "positions_nmile": worth.errors.iter().map(|&metres| miles(metres)).collect::<Value>(),
    })
}
