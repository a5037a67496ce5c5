//! The report of the turntable experiment.

mod data;
mod figures;
mod names;
mod tables;
mod verdict;

use names::{hours, method_kind, timed};

use crate::report::prelude::*;
use crate::study::Experiment;
use crate::study::experiment::{ALIGNMENT_TIME, Estimator};
use crate::units::DEGREE;

/// Everything that is said of the experiment.
pub fn document(experiment: &Experiment) -> Document {
    let instruments = count(experiment.trials.len());
    let title = format!("The turntable experiment with {instruments} simulated instruments");
    let mut document = Document::new(title);
    document.conclusions.heading = "What holds".to_owned();
    document.warnings.heading = "To be noted".to_owned();
    verdict::say(&mut document, experiment);
    document.both(facts(experiment));
    for table in tables::tables(experiment) {
        document.both(table);
    }
    for plot in figures::figures(experiment) {
        document.page(plot);
    }
    document.data = data::data(experiment);
    document
}

fn facts(experiment: &Experiment) -> Facts {
    let (study, scenario) = (&experiment.study, &experiment.study.scenario);
    let time = |estimator| timed(experiment).find(|(m, _)| m.estimator == estimator);
    let times = Estimator::ALL.into_iter().filter_map(|estimator| {
        Some(format!(
            "{} {}",
            method_kind(estimator),
            minutes(time(estimator)?.1)
        ))
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
                "{} h; stationary and level, heading North, and moving along {}; height held to the true one",
                three_digits(hours(experiment)),
                study.trajectory_name
            ),
        ),
        (
            "alignment",
            "stationary: levelled by the calibrated accelerometers, North from the calibrated gyros, or given; \
             moving: given"
                .to_owned(),
        ),
        (
            "noise",
            format!(
                "left out of the errors of the methods, as it is the same for all; the line \"noise alone\" has \
                 what it makes in alignment of {} and navigation",
                minutes(ALIGNMENT_TIME)
            ),
        ),
    ];
    Facts::new("The experiment", rows)
}

#[cfg(test)]
mod tests {
    use super::super::{svg, terminal};
    use super::*;
    use crate::models::{Place, trajectory};
    use crate::simulation::Scenario;
    use crate::study::ExperimentStudy;
    use crate::study::experiment::Method;

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
        let with_two = study.run(&|| {}).unwrap();
        let none = ExperimentStudy {
            samples: 0,
            ..study
        };
        for experiment in [&with_two, &none.run(&|| {}).unwrap()] {
            let document = document(experiment);
            let drawn = svg::drawn(document.plots());
            assert_eq!(drawn.len(), 3);
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
                // Three methods of the closed form, which is not compared with itself.
                assert_eq!(method["closed_form_over_ekf"].is_null(), place < 3);
            }
        }
    }
}
