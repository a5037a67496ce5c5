//! What holds of the report of any experiment.

use serde_json::Value;

use super::*;
use crate::models::{Place, trajectory};
use crate::simulation::Scenario;
use crate::study::ExperimentStudy;

fn study(samples: u64) -> ExperimentStudy {
    let mut scenario = Scenario::load("experiment").unwrap();
    scenario.integrator.period = 0.1;
    let (trajectory, trajectory_name) = trajectory("vehicle", &Place::Embedded).unwrap();
    ExperimentStudy {
        seed: 5,
        scenario,
        trajectory,
        trajectory_name,
        intervals: 120,
        samples,
    }
}

#[test]
fn an_experiment_without_a_calibration_is_reported() {
    let failed = study(0).run(&|| {}).unwrap();
    assert!(!summary(&failed).contains("NaN"));
    let directory = tempfile::tempdir().unwrap();
    write(&failed, directory.path()).unwrap();
    let page = std::fs::read_to_string(directory.path().join("index.html")).unwrap();
    assert!(!page.contains("NaN") && page.contains("budget.svg"));
}

#[test]
#[ignore = "long: two instruments on the table for an hour each"]
fn an_experiment_is_reported_whole() {
    let experiment = study(2).run(&|| {}).unwrap();
    let directory = tempfile::tempdir().unwrap();
    write(&experiment, directory.path()).unwrap();
    let read = |name: &str| std::fs::read_to_string(directory.path().join(name)).unwrap();
    let page = read("index.html");
    for name in ["distribution", "time", "budget"] {
        assert!(read(&format!("{name}.svg")).starts_with("<svg width=\"1200\""));
        assert!(page.contains(&format!("{name}.svg")));
    }
    for text in [&page, &summary(&experiment)] {
        assert!(!text.contains("NaN") && !text.contains("inf"));
    }

    let document: Value = serde_json::to_value(document(&experiment)).unwrap();
    assert_eq!(document["samples"], 2);
    for situation in ["standing_self_aligned", "standing_aligned", "moving"] {
        let methods = document[situation]["methods"].as_array().unwrap();
        assert_eq!(methods.len(), Method::all().count());
        for (place, method) in methods.iter().enumerate() {
            let number = |key: &str| method["position_nmile"][key].as_f64().unwrap();
            assert!(number("median") > 0.0 && number("below_95_percent") >= number("median"));
            // Three methods of the closed form, which is not compared with itself.
            let gain = &method["closed_form_over_ekf"];
            assert_eq!(gain.is_null(), place < 3);
            if let Some(gain) = gain.as_f64() {
                let mut closed_forms = methods[..3].iter();
                let form = &method["installation_form"];
                let closed_form = closed_forms.find(|m| &m["installation_form"] == form);
                let median = &closed_form.unwrap()["position_nmile"]["median"];
                let expected = median.as_f64().unwrap() / number("median");
                assert!((gain / expected - 1.0).abs() < 1e-9, "{gain} {expected}");
            }
        }
    }
}
