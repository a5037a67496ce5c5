//! What holds of the report of any experiment.

use serde_json::Value;

use super::*;
use crate::models::{Place, trajectory};
use crate::simulation::Scenario;
use crate::study::ExperimentStudy;

#[test]
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
    let experiment = study.run(&|| {}).unwrap();
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
            assert_eq!(method["closed_form_over_ekf"].is_null(), place < 3);
        }
    }

    let mut failed = study.clone();
    failed.samples = 0;
    let failed = failed.run(&|| {}).unwrap();
    assert!(!summary(&failed).contains("NaN"));
    write(&failed, directory.path()).unwrap();
}
