//! Properties of the report of any study.

use std::sync::OnceLock;

use serde_json::Value;

use super::super::{svg, terminal};
use super::*;
use turncal::calibration::{Group, TermEvidence};
use turncal::imu::{InstallationForm, Term};
use turncal::navigation::NearPole;
use turncal::simulation::Scenario;
use turncal::study::{AccuracyStudy, Study, UNWATCHED};

/// Three runs of the demo at a low sample rate.
fn small() -> Accuracy {
    static STUDY: OnceLock<Accuracy> = OnceLock::new();
    let study = || {
        let mut scenario = Scenario::load("demo").unwrap();
        scenario.integrator.period = 0.05;
        let (form, runs, seed) = (InstallationForm::General, 3, 7);
        let study = AccuracyStudy {
            scenario,
            form,
            unmodelled: Vec::new(),
            auto_terms: true,
            noise: Default::default(),
            runs,
            seed,
        };
        study.run(UNWATCHED).unwrap()
    };
    STUDY.get_or_init(study).clone()
}

/// The same study, as if the filter had failed in every run.
fn all_failed() -> Accuracy {
    let mut accuracy = small();
    for trial in &mut accuracy.trials {
        trial.failure = Some("singular <IMU>".to_owned());
        trial.filtered = None;
    }
    let positions = accuracy.navigation.iter_mut();
    let positions = positions.map(|navigated| {
        navigated.containment.clear();
        for position in &mut navigated.positions {
            position.filter = None;
        }
        &mut navigated.figures
    });
    let groups = accuracy.groups.iter_mut().map(|(_, figures)| figures);
    for figures in groups.chain(positions) {
        (figures.filter, figures.claimed) = (f64::NAN, f64::NAN);
        (figures.ratio, figures.gain, figures.gain_in_equal_time) = (None, None, None);
    }
    accuracy.anees = None;
    for nis in [&mut accuracy.velocity, &mut accuracy.table] {
        (nis.mean, nis.lag_one, nis.count) = (f64::NAN, f64::NAN, 0);
    }
    accuracy
}

fn json(accuracy: &Accuracy) -> Value {
    document(accuracy).data
}

/// Sentences that report a problem.
fn doubts(accuracy: &Accuracy) -> String {
    document(accuracy).warnings.items.join("\n")
}

fn summary(accuracy: &Accuracy) -> String {
    terminal::text(&document(accuracy), None)
}

#[test]
fn every_figure_is_drawn_whether_the_filter_works_or_not() {
    for accuracy in [small(), all_failed()] {
        let document = document(&accuracy);
        assert_eq!(svg::drawn(document.plots()).len(), 2);
        let names: Vec<&str> = document.plots().map(|plot| plot.file.as_str()).collect();
        assert_eq!(names, ["ratio.svg", "gain.svg"]);
        let text = summary(&accuracy);
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    }
    insta::assert_snapshot!(terminal::layout(&document(&small()), 100));
}

#[test]
fn a_document_gives_every_group_in_the_unit_of_its_key() {
    let accuracy = small();
    let document = json(&accuracy);
    assert_eq!(document["runs"], 3);
    assert_eq!(document["failures"], 0);
    for (group, key) in Group::all().zip([
        "gyro.scale_ppm",
        "gyro.installation_arcsec",
        "gyro.bias_deg_per_h",
        "accel.scale_ppm",
        "accel.installation_arcsec",
        "accel.bias_ug",
    ]) {
        let (_, of) = accuracy.groups.iter().find(|of| of.0 == group).unwrap();
        let number = |name: &str| document[key][name].as_f64().unwrap();
        assert_eq!(number("ekf_rms"), of.filter / group.unit_value());
        let (ekf, bound) = (number("ekf_rms"), number("bound_rms"));
        assert!((ekf / bound / number("ratio") - 1.0).abs() < 1e-9);
        let (closed, gain) = (number("six_position_rms"), number("gain"));
        assert!((closed / ekf / gain - 1.0).abs() < 1e-9);
        assert_eq!(number("ekf_table_time_s"), accuracy.table_time);
    }
    assert!(document["anees_interval"][1].as_f64().unwrap() > 1.0);
}

#[test]
fn a_study_without_an_estimate_counts_its_failures_and_has_null_for_what_it_cannot_say() {
    let accuracy = all_failed();
    let document = json(&accuracy);
    assert_eq!(document["failures"], 3);
    assert_eq!(document["failure_reasons"][1]["run"], 1);
    assert!(document["anees"].is_null() && document["gyro.scale_ppm"]["ekf_rms"].is_null());
    assert!(doubts(&accuracy).contains("3 of 3 runs failed"));
    assert!(summary(&accuracy).contains("run 0: singular"));
}

#[test]
fn sigma_that_are_too_small_are_called_so() {
    let mut accuracy = small();
    let anees = accuracy.anees.as_mut().unwrap();
    anees.mean = 1.0;
    assert!(!doubts(&accuracy).contains("ANEES"));
    accuracy.anees.as_mut().unwrap().mean = 4.0;
    let doubts = doubts(&accuracy);
    assert!(doubts.contains("too small"), "{doubts}");
    assert!(doubts.contains("2.000 times"), "{doubts}");
}

#[test]
fn a_group_in_which_the_closed_form_is_better_is_named() {
    let mut accuracy = small();
    let gain = accuracy.groups[5].1.gain.as_mut().unwrap();
    (gain.value, gain.interval) = (0.5, (0.4, 0.6));
    let doubts = doubts(&accuracy);
    let line = doubts
        .lines()
        .find(|l| l.contains("less accurate"))
        .unwrap();
    assert!(line.contains("accel bias D 0.50 (0.40…0.60)"), "{line}");
    assert!(!line.contains("gyro scale"), "{line}");
}

#[test]
fn a_form_that_cannot_hold_the_truth_is_charged_with_what_it_costs() {
    let mut accuracy = small();
    assert!(!doubts(&accuracy).contains("cannot represent"));
    accuracy.study.form = InstallationForm::ThreeAngle;
    assert!(
        doubts(&accuracy).contains("three-angle form cannot represent the truth, which is general")
    );
    assert_eq!(json(&accuracy)["form_holds_truth"], false);
    accuracy.study.scenario.installation.form = InstallationForm::ThreeAngle;
    assert!(!doubts(&accuracy).contains("cannot represent"));
}

#[test]
fn an_error_term_that_is_present_although_not_requested_is_named() {
    let mut accuracy = small();
    for (present, is_named) in [(0.5, false), (0.9995, true)] {
        accuracy.effects = vec![TermEvidence {
            term: ErrorTerm::Instrument(Term::SizeEffect),
            present,
            shown: is_named,
            remaining: 0.1,
            sigma_factors: [None; 6],
        }];
        let doubts = doubts(&accuracy);
        assert_eq!(doubts.contains("accel lever arm"), is_named, "{doubts}");
        assert_eq!(json(&accuracy)["block_effects"][0]["present"], present);
    }
}

#[test]
fn position_errors_are_in_nautical_miles_and_a_mission_that_cannot_be_flown_says_why() {
    let mut accuracy = small();
    let document = json(&accuracy);
    let missions: Vec<&Value> = document["navigation"].as_array().unwrap().iter().collect();
    assert_eq!(missions.len(), 2);
    for (mission, of) in missions.into_iter().zip(&accuracy.navigation) {
        let position = &mission["position_nmile"];
        let ekf = position["ekf_rms"].as_f64().unwrap();
        assert!((ekf * 1852.0 / of.figures.filter - 1.0).abs() < 1e-12);
        assert_eq!(mission["containment"].as_array().unwrap().len(), 4);
        assert_eq!(mission["containment"][0]["runs"], 3);
    }
    assert!(summary(&accuracy).contains("position, flight"));

    let flight = accuracy.navigation.pop().unwrap();
    let pole = NearPole { latitude: 1.57 };
    accuracy.not_navigated = vec![(flight.journey, pole.into())];
    assert!(doubts(&accuracy).contains("Not navigated from this site, flight"));
    let document = json(&accuracy);
    assert_eq!(document["navigation"][1]["mission"], "flight");
    assert!(document["navigation"][1]["position_nmile"].is_null());
}

#[test]
fn position_errors_beyond_their_predicted_sigma_are_called_so() {
    let mut accuracy = small();
    let held = &mut accuracy.navigation[0].containment[1];
    (held.within, held.interval) = (0, (1, 3));
    let doubts = doubts(&accuracy);
    assert!(
        doubts.contains(
            "stationary, the position error is within its predicted σ more or less often"
        ),
        "{doubts}"
    );
    assert!(
        doubts.contains("north within 1σ 0.0 % (claimed 68.3 %)"),
        "{doubts}"
    );
}
