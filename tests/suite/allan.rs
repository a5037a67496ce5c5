//! `turncal allan` and `turncal noise` as a user meets them.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

use crate::shared::shared;

/// Triad, axis, cluster time in s, deviation in °/h or µg.
const REFERENCE: [(&str, &str, f64, f64); 18] = [
    ("gyro", "x", 0.01, 269.14929041),
    ("gyro", "x", 0.64, 33.735428582),
    ("gyro", "x", 81.92, 2.98436940208),
    ("gyro", "y", 0.01, 399.159919725),
    ("gyro", "y", 0.64, 50.413798091),
    ("gyro", "y", 81.92, 11.6692372166),
    ("gyro", "z", 0.01, 336.432095402),
    ("gyro", "z", 0.64, 42.0068207361),
    ("gyro", "z", 81.92, 8.07178373439),
    ("accel", "x", 0.01, 3269.6656711),
    ("accel", "x", 0.64, 405.549104954),
    ("accel", "x", 81.92, 39.5853321472),
    ("accel", "y", 0.01, 3018.90334094),
    ("accel", "y", 0.64, 381.669466207),
    ("accel", "y", 81.92, 38.8137506063),
    ("accel", "z", 0.01, 4597.30088845),
    ("accel", "z", 0.64, 573.366600305),
    ("accel", "z", 81.92, 93.8225126325),
];

fn turncal(arguments: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    command.args(arguments).assert()
}

fn json(assert: &assert_cmd::assert::Assert) -> Value {
    serde_json::from_slice(&assert.get_output().stdout).unwrap()
}

fn message(assert: &assert_cmd::assert::Assert) -> String {
    String::from_utf8_lossy(&assert.get_output().stderr).into_owned()
}

/// A run of the demo's instrument.
fn simulated(directory: &Path) -> String {
    let run = directory.join("run");
    turncal(&[
        "simulate",
        "demo",
        "--seed",
        "3",
        "-o",
        run.to_str().unwrap(),
    ])
    .success();
    run.join("run.toml").to_str().unwrap().to_owned()
}

#[test]
fn deviations_of_a_real_sensor_are_those_of_an_independent_program() {
    let Some(directory) = shared("real-mems-static") else {
        return;
    };
    let run = directory.join("run.toml");
    let document = json(&turncal(&["allan", run.to_str().unwrap(), "--json"]).success());
    assert_eq!(document["stretch"], "the whole recording");
    // allantools 2024.6, oadev, data_type="freq", of the same samples.
    for (triad, axis, tau, expected) in REFERENCE {
        let axis = &document[triad][axis];
        let taus = axis["tau_s"].as_array().unwrap();
        let at = |t: &Value| (t.as_f64().unwrap() / tau - 1.0).abs() < 1e-9;
        let point = taus.iter().position(at).unwrap();
        let deviation = axis["deviation"][point].as_f64().unwrap();
        assert!(
            (deviation / expected - 1.0).abs() < 1e-9,
            "{tau}: {deviation}"
        );
        let interval = &axis["interval"][point];
        assert!(interval[0].as_f64() < Some(deviation) && interval[1].as_f64() > Some(deviation));
    }
}

#[test]
fn the_noise_of_a_simulated_instrument_comes_back_and_is_read_by_a_run() {
    let root = tempfile::tempdir().unwrap();
    let run = simulated(root.path());
    let document = json(&turncal(&["allan", &run, "--json"]).success());
    // models/imu/navigation-fog.toml and the run say the same.
    let text = fs::read_to_string(&run).unwrap();
    let stated = |key: &str| -> f64 {
        let line = text.lines().find(|line| line.starts_with(key)).unwrap();
        line.split('=').nth(1).unwrap().trim().parse().unwrap()
    };
    for (triad, key) in [
        ("gyro", "angle_random_walk_deg_per_sqrt_h"),
        ("accel", "velocity_random_walk_ug_per_sqrt_hz"),
    ] {
        let found = &document[triad]["triad"]["coefficients"][key];
        let (value, sigma) = (
            found["value"].as_f64().unwrap(),
            found["sigma"].as_f64().unwrap(),
        );
        assert!((value - stated(key)).abs() < 4.0 * sigma, "{key} {found}");
        // A minute at 100 Hz shows white noise to some per cent.
        assert!(sigma < 0.1 * value, "{key} {found}");
        assert_eq!(document["imu_noise"][key].as_f64(), Some(value));
        // A minute shows no floor, so no coefficient.
        let coefficients = &document[triad]["triad"]["coefficients"];
        assert_eq!(coefficients.as_object().unwrap().len(), 2, "{coefficients}");
    }
    // The printed table takes the place of the run's own.
    let printed = document["imu_noise_toml"].as_str().unwrap();
    let from = text.find("[imu.noise]").unwrap();
    let to = from + text[from..].find("\n\n").unwrap();
    fs::write(&run, format!("{}{printed}{}", &text[..from], &text[to..])).unwrap();
    turncal(&["allan", &run]).success();
}

#[test]
fn a_report_is_written_whole_and_needs_nothing_else() {
    let root = tempfile::tempdir().unwrap();
    let run = simulated(root.path());
    let report = root.path().join("noise");
    turncal(&["allan", &run, "-o", report.to_str().unwrap()]).success();
    for file in ["index.html", "gyro.svg", "accel.svg"] {
        assert!(
            fs::metadata(report.join(file)).unwrap().len() > 1000,
            "{file}"
        );
    }
    let again = turncal(&["allan", &run, "-o", report.to_str().unwrap()]).code(1);
    assert!(message(&again).contains("--force"));
}

#[test]
fn a_label_that_is_not_there_is_answered_with_those_that_are() {
    let root = tempfile::tempdir().unwrap();
    let run = simulated(root.path());
    let failed = turncal(&["allan", &run, "--segment", "z_up"]).code(1);
    assert!(
        message(&failed).contains("no [segments]"),
        "{}",
        message(&failed)
    );
    let text = fs::read_to_string(&run).unwrap();
    fs::write(&run, text + "\n[segments]\nfile = \"s.csv\"\n").unwrap();
    let segments = "start,end,label\n0,60,still\n0,1.0,short\n58,80,turning\n";
    fs::write(root.path().join("run/s.csv"), segments).unwrap();
    let failed = turncal(&["allan", &run, "--segment", "stil"]).code(1);
    assert!(
        message(&failed).contains("`still`, `short`"),
        "{}",
        message(&failed)
    );
    let failed = turncal(&["allan", &run, "--segment", "short"]).code(1);
    assert!(
        message(&failed).contains("at least 256"),
        "{}",
        message(&failed)
    );
    let found = json(&turncal(&["allan", &run, "--segment", "still", "--json"]).success());
    assert_eq!(found["duration_s"], 60.0);
    let moving = json(&turncal(&["allan", &run, "--segment", "turning", "--json"]).success());
    assert_eq!(moving["stands"], false);
    let warnings = moving["warnings"].to_string();
    assert!(warnings.contains("is not stationary"), "{warnings}");
}

#[test]
fn sections_laid_end_to_end_without_labels_are_told_by_the_instrument() {
    let root = tempfile::tempdir().unwrap();
    let run = simulated(root.path());
    let text = fs::read_to_string(&run).unwrap();
    assert!(text.contains("continuous = true"), "{text}");
    fs::write(
        &run,
        text.replace("continuous = true", "continuous = false"),
    )
    .unwrap();
    let document = json(&turncal(&["allan", &run, "--json"]).success());
    assert_eq!(document["stands"], true);
}

#[test]
fn a_noise_figure_is_converted_and_a_wrong_unit_is_answered_with_the_known_ones() {
    let document =
        json(&turncal(&["noise", "0.3", "deg/sqrt(h)", "--rate", "100", "--json"]).success());
    assert_eq!(document["quantity"], "angle random walk");
    let figures = document["figures"].as_array().unwrap();
    let kalibr = figures
        .iter()
        .find(|figure| figure["meaning"].as_str().unwrap().contains("Kalibr"))
        .unwrap();
    assert!((kalibr["value"].as_f64().unwrap() / 8.726_646e-5 - 1.0).abs() < 1e-6);
    let wrong = turncal(&["noise", "0.3", "furlong"]).code(1);
    assert!(message(&wrong).contains("rad/s/√Hz"), "{}", message(&wrong));
    let no_rate = turncal(&["noise", "0.3", "rad"]).code(1);
    assert!(message(&no_rate).contains("--rate"));
    for arguments in [
        &["noise", "0.3"][..],
        &["noise", "many", "rad/s"],
        &["noise", "-1", "rad/s"],
        &["noise", "1", "rad/s", "--rate", "0"],
        &["allan"],
    ] {
        turncal(arguments).code(2);
    }
}
