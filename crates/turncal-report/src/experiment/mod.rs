//! Report on the turntable experiment.

mod figures;
mod tables;

use crate::experiment::tables::{
    PAPER, estimator_name, hours, in_general, method_kind, method_name, navigated, situation_name,
    table_time,
};
use crate::prelude::*;
use turncal::imu::Sensor;
use turncal::study::Experiment;
use turncal::study::experiment::{ALIGNMENT_TIME, Budget, Estimator, Method, Situation, Worth};

/// The complete report on the experiment.
pub fn document(experiment: &Experiment) -> Document {
    let instruments = count(experiment.trials.len());
    let title = format!("The turntable experiment with {instruments} simulated instruments");
    let mut document = Document::new(title);
    say(&mut document, experiment);
    document.both(facts(experiment));
    tables::tables(experiment)
        .into_iter()
        .for_each(|table| document.both(table));
    document.page(figures::distribution(experiment));
    document.data = data(experiment);
    document
}

fn facts(experiment: &Experiment) -> Facts {
    let (study, scenario) = (&experiment.study, &experiment.study.scenario);
    let times = Estimator::ALL.into_iter().filter_map(|estimator| {
        let time = minutes(table_time(experiment, estimator)?);
        Some(format!("{} {time}", method_kind(estimator)))
    });
    let rows = [
        (
            "scenario",
            format!(
                "{}: instrument {}, truth {}, table {}, latitude {}°",
                scenario.name,
                scenario.instrument.name,
                scenario.installation.form.name(),
                scenario.table_name,
                three_digits(scenario.site.latitude / DEGREE)
            ),
        ),
        ("instruments", format!("{}, seed {}", count(experiment.trials.len()), study.seed)),
        ("table time", times.collect::<Vec<_>>().join(", ")),
        (
            "navigation",
            format!(
                "{} h; stationary and level, heading North, and moving along {}; the height is fixed to its true \
                 value",
                three_digits(hours(experiment)),
                study.trajectory_name
            ),
        ),
        (
            "alignment",
            "stationary: level from the calibrated accelerometers and North from the calibrated gyros, or a given \
             attitude; moving: a given attitude"
                .to_owned(),
        ),
        (
            "noise",
            format!(
                "not included in the errors of the methods, because it is the same for all of them; the line \"noise \
                 alone\" shows its effect on an alignment of {} and on navigation",
                minutes(ALIGNMENT_TIME)
            ),
        ),
    ];
    Facts::new("The experiment", rows)
}

/// The figures of an experiment as JSON.
pub fn data(experiment: &Experiment) -> Value {
    let study = &experiment.study;
    let mission = |situation| {
        let navigated = navigated(experiment, situation)?;
        let methods = navigated.methods.iter().enumerate();
        let methods = methods.map(|(place, worth)| method(experiment, place, worth));
        Some(json!({
            "methods": methods.collect::<Value>(),
            "noise_alone_nmile": navigated.noise,
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

/// Intervals are 99 %, by bootstrap over instruments.
fn method(experiment: &Experiment, place: usize, worth: &Worth) -> Value {
    let trials = experiment.trials.iter();
    let calibrations = || trials.clone().filter_map(|t| t.calibrations.get(place));
    let budget = worth.budget.parts.iter().map(|part| {
        let data = json!({ "alone_rms_nmile": part.alone, "share": part.share });
        (part.group.key(), data)
    });
    json!({
        "method": worth.method.estimator,
        "installation_form": worth.method.form,
        "table_time_s": experiment.table_times.get(place),
        "failures": calibrations().filter(|c| c.is_err()).count(),
        "not_converged": calibrations().flatten().filter(|c| !c.converged).count(),
        "form_rejections": calibrations().flatten().filter(|c| c.rejects_form).count(),
        "position_nmile": worth.at_end,
        "median_interval": worth.median_interval,
        "largest_position_nmile": worth.largest,
        "gyro_errors_alone_nmile": worth.by_one.get(Sensor::Gyro),
        "accel_errors_alone_nmile": worth.by_one.get(Sensor::Accel),
        "closed_form_over_ekf": worth.gain.map(|gain| gain.value),
        "closed_form_over_ekf_interval": worth.gain.map(|gain| gain.interval),
        "claimed_rms_nmile": worth.budget.claimed,
        "budget": budget.collect::<Map<_, _>>(),
        "positions_nmile": worth.errors,
    })
}

/// Filter compared with the closed form: equal time if stationary, a sixth of it if moving.
const COMPARED: [(Situation, Estimator); 4] = [
    (Situation::SelfAligned, Estimator::LongFilter),
    (Situation::SelfAligned, Estimator::Filter),
    (Situation::Moving, Estimator::LongFilter),
    (Situation::Moving, Estimator::Filter),
];

/// Reports the better method, the largest error contribution, and failed calibrations.
pub fn say(document: &mut Document, experiment: &Experiment) {
    for text in failures(experiment) {
        document.say(false, text);
    }
    for (situation, estimator) in COMPARED {
        if let Some((better, text)) = compared(experiment, situation, estimator) {
            document.say(better, text);
        }
    }
    let limits = [Situation::SelfAligned, Situation::Moving].into_iter();
    for text in limits.filter_map(|situation| limit(experiment, situation)) {
        document.say(true, text);
    }
}

fn compared(
    experiment: &Experiment,
    situation: Situation,
    estimator: Estimator,
) -> Option<(bool, String)> {
    let navigated = navigated(experiment, situation)?;
    let closed = in_general(navigated, Estimator::ClosedForm)?;
    let filter = in_general(navigated, estimator)?;
    let gain = filter.gain.as_ref()?;
    let [by, interval] = with_interval(gain.value, gain.interval);
    let (low, high) = gain.interval;
    let judged = match () {
        () if low > 1.0 => "the EKF is better",
        () if high < 1.0 => "the closed form is better",
        () => "no significant difference for this number of instruments",
    };
    let text = format!(
        "{}, {} h: median error {} nmile after {}, {} after {}, ratio {by} ({interval}): {judged}.",
        capital(situation_name(situation)),
        three_digits(hours(experiment)),
        three_digits(filter.at_end.median),
        estimator_name(experiment, estimator),
        three_digits(closed.at_end.median),
        estimator_name(experiment, Estimator::ClosedForm),
    );
    Some((low > 1.0, text))
}

/// The largest contribution to the remaining navigation error.
fn limit(experiment: &Experiment, situation: Situation) -> Option<String> {
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
    let of = Estimator::ALL.into_iter().map(|estimator| {
        let most = most(&in_general(navigated, estimator)?.budget)?;
        Some(format!("{}: {most}", estimator_name(experiment, estimator)))
    });
    Some(format!(
        "{}, these groups contribute most to the variance: {}. Noise alone would give a median of {} nmile.",
        capital(situation_name(situation)),
        of.collect::<Option<Vec<_>>>()?.join("; "),
        three_digits(navigated.noise.median)
    ))
}

/// Calibrations that failed, did not converge, or have data that reject the form.
fn failures(experiment: &Experiment) -> Vec<String> {
    let trials = &experiment.trials;
    let mut sentences = Vec::new();
    for (place, method) in Method::all().enumerate() {
        let all = || trials.iter().filter_map(|t| t.calibrations.get(place));
        let failed: Vec<&String> = all().filter_map(|c| c.as_ref().err()).collect();
        let rejected = all().flatten().filter(|c| c.rejects_form).count();
        let diverged = all().flatten().filter(|c| !c.converged).count();
        let (name, of) = (method_name(experiment, method), count(trials.len()));
        let mut say = |number: usize, what: &str| {
            if number > 0 {
                sentences.push(format!("{name}: {} of {of} {what}", count(number)));
            }
        };
        let first = failed.first().map_or("", |reason| reason.as_str());
        say(
            failed.len(),
            &format!("calibrations failed; the reason for the first failure is: {first}"),
        );
        say(
            rejected,
            "instruments have data that the misalignment form does not fit.",
        );
        say(
            diverged,
            "calibrations did not converge; the figures include them.",
        );
    }
    sentences
}

#[cfg(test)]
mod tests {
    use super::super::{svg, terminal};
    use super::*;
    use turncal::models::{Place, trajectory};
    use turncal::simulation::Scenario;
    use turncal::study::experiment::Method;
    use turncal::study::{ExperimentStudy, Study, UNWATCHED};

    #[test]
    #[ignore = "slow: an experiment whole"]
    fn an_experiment_is_reported_whole_whether_its_filter_works_or_not() {
        let mut scenario = Scenario::load("experiment").unwrap();
        scenario.integrator.period = 0.1;
        let (trajectory, trajectory_name) = trajectory("vehicle", &Place::Embedded).unwrap();
        let study = ExperimentStudy {
            seed: 5,
            scenario,
            trajectory,
            trajectory_name,
            intervals: 120,
            samples: 2,
        };
        let with_two = study.run(UNWATCHED).unwrap();
        let none = ExperimentStudy {
            samples: 0,
            ..study
        };
        for experiment in [&with_two, &none.run(UNWATCHED).unwrap()] {
            let document = document(experiment);
            let drawn = svg::drawn(document.plots());
            assert_eq!(drawn.len(), 1);
            let text = terminal::text(&document, Some(100));
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        }
        insta::assert_snapshot!(terminal::layout(&document(&with_two), 120));

        let data = document(&with_two).data;
        assert_eq!(data["samples"], 2);
        for situation in ["standing_self_aligned", "standing_aligned", "moving"] {
            let methods = data[situation]["methods"].as_array().unwrap();
            assert_eq!(methods.len(), Method::all().count());
            for (place, method) in methods.iter().enumerate() {
                let number = |key: &str| method["position_nmile"][key].as_f64().unwrap();
                assert!(number("median") > 0.0 && number("below_95_percent") >= number("median"));
                // The first three methods are closed forms, which are not compared with themselves.
                assert_eq!(method["closed_form_over_ekf"].is_null(), place < 3);
            }
        }
    }
}
