//! Studies of many runs.

use assert_cmd::Command;
use serde_json::Value;

fn study(arguments: &[&str], threads: &str) -> Vec<u8> {
    let mut turncal = Command::cargo_bin("turncal").unwrap();
    let output = turncal
        .args(["study", "accuracy", "--json"])
        .args(arguments)
        .env("RAYON_NUM_THREADS", threads)
        .assert()
        .success();
    output.get_output().stdout.clone()
}

#[test]
fn a_study_does_not_depend_on_the_number_of_threads() {
    let arguments = ["--runs", "5", "--seed", "8"];
    let one = study(&arguments, "1");
    assert_eq!(one, study(&arguments, "2"));

    let document: Value = serde_json::from_slice(&one).unwrap();
    assert_eq!(document["runs"], 5);
    assert_eq!(document["failures"], 0);
    for group in [
        "gyro.scale_ppm",
        "gyro.installation_arcsec",
        "gyro.bias_deg_per_h",
        "accel.scale_ppm",
        "accel.installation_arcsec",
        "accel.bias_ug",
    ] {
        let of = |key: &str| document[group][key].as_f64().unwrap();
        let [low, high] = [0, 1].map(|k| document[group]["ratio_interval"][k].as_f64().unwrap());
        assert!(low <= of("ratio") && of("ratio") <= high, "{group}");
        let quotient = of("ekf_rms") / of("bound_rms");
        assert!((of("ratio") / quotient - 1.0).abs() < 1e-9, "{group}");
        let gain = of("six_position_rms") / of("ekf_rms");
        assert!((of("gain") / gain - 1.0).abs() < 1e-9, "{group}");
    }
    for (place, name) in ["standing", "flight"].into_iter().enumerate() {
        let mission = &document["navigation"][place];
        assert_eq!(mission["mission"], name);
        let of = |key: &str| mission["position_nmile"][key].as_f64().unwrap();
        let quotient = of("ekf_rms") / of("bound_rms");
        assert!((of("ratio") / quotient - 1.0).abs() < 1e-9, "{name}");
        // The filter's σ are those of the bound but for where they are linearised.
        assert!(
            (of("claimed_rms") / of("bound_rms") - 1.0).abs() < 0.05,
            "{name}"
        );
        for held in mission["containment"].as_array().unwrap() {
            assert_eq!(held["runs"], 5);
        }
    }
}
