//! `turncal navigate` as a user meets it.

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;
use turncal::calibration::result::Calibration;
use turncal::calibration::result::TriadRecord;
use turncal::imu::InstallationForm;

use crate::calibration_file::{record, written};
use crate::shared::shared;

fn navigate(calibration: &Path, truth: &Path, more: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    let command = command.arg("navigate").arg(calibration);
    command.arg("--truth").arg(truth).args(more).assert()
}

fn json(assert: &assert_cmd::assert::Assert) -> Value {
    serde_json::from_slice(&assert.get_output().stdout).unwrap()
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    std::array::from_fn(|i| value[i].as_f64().unwrap())
}

#[test]
fn the_cases_of_an_independent_program_agree_hour_by_hour() {
    let Some(reference) = shared("../reference") else {
        return;
    };
    let file = std::fs::File::open(reference.join("nav_cases.json")).unwrap();
    let document: Value = serde_json::from_reader(file).unwrap();
    let root = tempfile::tempdir().unwrap();
    for case in document["cases"].as_array().unwrap() {
        let matrix = |value: &Value| std::array::from_fn(|i| numbers(&value[i]));
        let triad = |scale: &Value, installation: &Value, bias: &Value| TriadRecord {
            scale: numbers(scale),
            installation: matrix(installation),
            bias: numbers(bias),
        };
        let (gyro, accel) = (&case["gyro"], &case["accel"]);
        let truth = Calibration::new(
            triad(&case["Kg"], &gyro["C_true"], &case["Dg"]),
            triad(&case["Ka"], &accel["C_true"], &case["Da"]),
        );
        let found = |of: &Value| triad(&of["K_hat"], &of["C_hat"], &of["D_hat"]);
        let calibration = Calibration {
            installation_form: Some(InstallationForm::ThreeAngle),
            ..Calibration::new(found(gyro), found(accel))
        };
        let name = case["name"].as_str().unwrap();
        let truth = written(root.path(), &format!("{name}-truth.json"), &truth);
        let calibration = written(root.path(), &format!("{name}.json"), &calibration);
        let latitude = case["latitude_deg"].as_f64().unwrap().to_string();
        let sensor = case["use"].as_str().unwrap();
        let options = ["--latitude-deg", &latitude, "--errors", sensor, "--json"];
        let found = json(&navigate(&calibration, &truth, &options).success());
        let series = found["series"].as_array().unwrap();
        let expected = case["nonlinear"].as_array().unwrap();
        assert_eq!(series.len(), expected.len());
        let mut apart = [0f64; 5];
        for (found, expected) in series.iter().zip(expected) {
            let keys = [
                ("t_h", 0, 1e-12),
                ("pitch_deg", 1, 1e-6),
                ("roll_deg", 2, 1e-6),
                ("heading_deg", 3, 1e-6),
                ("velocity_m_s", 8, 1e-3),
                ("position_nmile", 9, 1e-3),
            ];
            for (key, column, within) in keys {
                let difference =
                    (found[key].as_f64().unwrap() - expected[column].as_f64().unwrap()).abs();
                assert!(
                    difference < within,
                    "{name} {key}: {difference} at {expected}"
                );
                if column > 0 {
                    let place = &mut apart[[0, 0, 1, 2, 0, 0, 0, 0, 3, 4][column]];
                    *place = place.max(difference);
                }
            }
        }
        println!("{name}: {apart:?}");
        let largest = &found["max_abs"]["position_nmile"];
        let expected = &case["max_abs"]["pos_nmile"];
        assert!((largest.as_f64().unwrap() - expected.as_f64().unwrap()).abs() < 1e-3);
    }
}

/// A calibration whose east gyro's bias is wrong by 0.01 °/h, with σ 0.02 °/h.
fn calibration() -> Calibration {
    let count = 2e6 * std::f64::consts::PI / 180.0 / 3600.0;
    let mut record = record();
    record.gyro.bias[0] += 0.01 * count;
    record.parameters = vec!["gyro.bias.x".to_owned()];
    record.covariance = vec![vec![(0.02 * count).powi(2)]];
    record
}

#[test]
fn sigma_is_to_the_error_as_the_sigma_of_its_only_cause_to_the_cause() {
    let root = tempfile::tempdir().unwrap();
    let truth = written(root.path(), "truth.json", &record());
    let calibration = written(root.path(), "calibration.json", &calibration());
    for options in [
        &["--latitude-deg", "-34", "--attitude-deg", "-1,2,30"][..],
        &["--trajectory", "flight"],
        &[
            "--trajectory",
            "vehicle",
            "--latitude-deg",
            "-60",
            "--height-m",
            "-10",
        ],
    ] {
        let options = [options, &["--hours", "2", "--json"]].concat();
        let document = json(&navigate(&calibration, &truth, &options).success());
        let last = &document["final"];
        for key in ["heading_deg", "velocity_east_m_s", "position_north_nmile"] {
            let ratio = last["sigma"][key].as_f64().unwrap() / last[key].as_f64().unwrap();
            assert!(
                (ratio.abs() - 2.0).abs() < 0.02,
                "{options:?} {key}: {ratio}"
            );
        }
        assert!(last["position_nmile"].as_f64().unwrap() > 0.1);
    }
    // The accelerometers are exact.
    let options = [
        "--latitude-deg",
        "0",
        "--errors",
        "accel",
        "--json",
        "--hours",
        "1",
    ];
    let document = json(&navigate(&calibration, &truth, &options).success());
    assert!(document["max_abs"]["position_nmile"].as_f64().unwrap() < 1e-6);
}

#[test]
fn a_report_has_a_page_figures_and_a_table_by_the_minute() {
    let root = tempfile::tempdir().unwrap();
    let truth = written(root.path(), "truth.json", &record());
    let calibration = written(root.path(), "calibration.json", &calibration());
    let report = root.path().join("report");
    let options = ["--latitude-deg", "45", "-o", report.to_str().unwrap()];
    let shown = navigate(&calibration, &truth, &options).success();
    let text = String::from_utf8(shown.get_output().stdout.clone()).unwrap();
    assert!(
        text.contains("stationary at latitude 45") && text.contains("nmile/40 h"),
        "{text}"
    );
    let csv = std::fs::read_to_string(report.join("navigation.csv")).unwrap();
    assert_eq!(csv.lines().count(), 2402);
    let page = std::fs::read_to_string(report.join("index.html")).unwrap();
    // Each in three widths.
    assert_eq!(page.matches("<svg").count(), 9);
    for figure in ["attitude.svg", "velocity.svg", "position.svg"] {
        assert!(report.join(figure).exists());
    }
    navigate(&calibration, &truth, &options).failure().code(1);
}

#[test]
fn what_cannot_be_navigated_is_refused_and_says_why() {
    let root = tempfile::tempdir().unwrap();
    let truth = written(root.path(), "truth.json", &record());
    let calibration = written(root.path(), "calibration.json", &calibration());
    let steep = root.path().join("steep.toml");
    std::fs::write(
        &steep,
        "[start]\nlatitude_deg = 0\nlongitude_deg = 0\nheight_m = 0\nheading_deg = 0\nspeed_m_s = 0\n\
         [moves]\nbanks = false\nturn_rate_deg_per_s = 1\nturn_acceleration_deg_per_s2 = 1\n\
         acceleration_m_s2 = 1\njerk_m_s3 = 1\nclimb_rate_m_s = 1\nclimb_acceleration_m_s2 = 1\n\
         [[segment]]\nheight_m = 10\n",
    )
    .unwrap();
    for (options, code, says) in [
        (&["--latitude-deg", "90"][..], 1, "pole"),
        (&["--latitude-deg", "91"], 2, "-90 to 90"),
        (&[], 1, "--latitude-deg"),
        (
            &["--latitude-deg", "5", "--attitude-deg", "1,2"],
            2,
            "found 2",
        ),
        (
            &["--latitude-deg", "5", "--attitude-deg", "90,0,0"],
            2,
            "pitch",
        ),
        (&["--latitude-deg", "5", "--hours", "0"], 2, "1000"),
        (&["--trajectory", "fligth"], 1, "did you mean \"flight\""),
        (
            &["--trajectory", steep.to_str().unwrap()],
            1,
            "segment 1 climbs",
        ),
        (
            &["--trajectory", "flight", "--latitude-deg", "89.8"],
            1,
            "pole",
        ),
    ] {
        let refused = navigate(&calibration, &truth, options).failure().code(code);
        let message = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
        assert!(message.contains(says), "{options:?}: {message}");
    }
}
