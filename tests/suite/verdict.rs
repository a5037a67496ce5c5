//! What a user reads first: a verdict, on one screen, that says what to do next.

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

use crate::shared::shared;

fn turncal(arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    let output = command
        .env("COLUMNS", "80")
        .args(arguments)
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let status = output.status.code().expect("it was not killed");
    (status, text(&output.stdout), text(&output.stderr))
}

fn simulated(scenario: &str, place: &Path) -> String {
    let run = place.join(scenario);
    let run = run.to_string_lossy();
    let (status, _, message) = turncal(&["simulate", scenario, "-o", &run]);
    assert_eq!(status, 0, "{message}");
    format!("{run}/run.toml")
}

/// A calibration on one screen: at most 40 lines of 80 columns, the verdict in the second, the next step last.
fn one_screen(run: &str, word: &str) {
    let place = tempfile::tempdir().unwrap();
    let output = place.path().join("result");
    let (_, text, _) = turncal(&["calibrate", run, "-o", &output.to_string_lossy()]);
    let lines: Vec<&str> = text.lines().collect();
    // A path is one word, however long the folder's name is.
    let is_path = |word: &str| word.matches('/').count() > 2;
    let wide = |line: &&&str| line.chars().count() > 80 && !line.split_whitespace().any(is_path);
    assert!(lines.len() <= 40, "{} lines:\n{text}", lines.len());
    assert_eq!(lines.iter().find(wide), None, "{text}");
    assert!(lines[1].starts_with(word), "{text}");
    assert!(text.contains("--verbose"), "{text}");
    assert!(
        text.contains("gyro scale factor K") && text.contains("calibration.json"),
        "{text}"
    );
}

#[test]
fn real_records_fit_on_one_screen() {
    for name in [
        "real-mems-lot-0",
        "real-mems-six-position",
        "nineteen-position-velocity",
    ] {
        if let Some(directory) = shared(name) {
            let run = directory.join("run.toml");
            // Gravity is stated 1 Gal too small there.
            let is_doubted = name == "real-mems-lot-0";
            let word = if is_doubted { "USE WITH CARE" } else { "GOOD" };
            one_screen(&run.to_string_lossy(), word);
        }
    }
}

#[test]
fn noise_that_is_stated_wrongly_is_named_with_the_line_that_states_it() {
    let place = tempfile::tempdir().unwrap();
    let run = simulated("demo", place.path());
    one_screen(&run, "GOOD   24 of 24 parameters determined");
    let result = |run: &str, noise: &str| -> Value {
        let (_, json, message) = turncal(&["calibrate", run, "--json", "--noise", noise]);
        serde_json::from_str(&json).unwrap_or_else(|_| panic!("{message}"))
    };
    let good = serde_json::json!({ "word": "good", "reasons": [] });
    assert_eq!(result(&run, "auto")["verdict"], good);
    let text = std::fs::read_to_string(&run).unwrap();
    let quiet = text.replace(
        "velocity_random_walk_ug_per_sqrt_hz = 5.0",
        "velocity_random_walk_ug_per_sqrt_hz = 0.1",
    );
    assert_ne!(text, quiet);
    std::fs::write(&run, quiet).unwrap();
    let of_estimate = result(&run, "auto");
    assert_eq!(of_estimate["verdict"]["word"], "use with care");
    assert_eq!(
        of_estimate["verdict"]["reasons"],
        serde_json::json!(["W07"])
    );
    let findings = of_estimate["findings"].as_array().unwrap();
    let named = findings.iter().find(|finding| finding["code"] == "W07");
    let line = named.unwrap()["figures"]["lines"][0].as_str().unwrap();
    let stated = line.strip_prefix("velocity_random_walk_ug_per_sqrt_hz = ");
    let stated: f64 = stated.unwrap().parse().unwrap();
    assert!((stated / 5.0 - 1.0).abs() < 0.3, "{line}");
    assert_eq!(result(&run, "stated")["verdict"]["word"], "use with care");
}

#[test]
fn what_a_recording_does_not_show_keeps_its_value_and_the_rest_is_usable() {
    let place = tempfile::tempdir().unwrap();
    let run = simulated("mems", place.path());
    let log = place.path().join("mems").join("imu.csv.gz");
    let mut rows = String::new();
    let file = std::fs::File::open(&log).unwrap();
    std::io::Read::read_to_string(&mut flate2::read::GzDecoder::new(file), &mut rows).unwrap();
    // The first dwell alone.
    let first: Vec<&str> = rows.lines().take(3000).collect();
    let still = place.path().join("mems").join("still.csv");
    std::fs::write(&still, first.join("\n") + "\n").unwrap();
    let text = std::fs::read_to_string(&run).unwrap();
    std::fs::write(&run, text.replace("imu.csv.gz", "still.csv")).unwrap();
    let output = place.path().join("result");
    let output = output.to_string_lossy();
    let to = ["--aiding", "velocity", "-o", &output, "--force"];
    let calibrate = |more: &[&str]| turncal(&[&["calibrate", &run][..], &to, more].concat());
    let (status, screen, message) = calibrate(&[]);
    assert_eq!(status, 0, "{message}");
    assert!(
        screen
            .lines()
            .nth(1)
            .unwrap()
            .starts_with("PARTIAL   gyros: D only"),
        "{screen}"
    );
    let file = format!("{output}/calibration.json");
    let result: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    // The prior of the scenario is a scale factor of one.
    assert_eq!(result["gyro"]["scale"], serde_json::json!([1.0, 1.0, 1.0]));
    assert!(result["sigma"]["gyro"]["scale"][0].as_f64() > Some(0.0));
    let (status, shown, _) = turncal(&["show", &file]);
    assert!(
        status == 0 && shown.contains("PARTIAL   gyros: D only"),
        "{shown}"
    );
    assert_eq!(calibrate(&["--require", "gyro.bias"]).0, 0);
    let (status, _, message) = calibrate(&["--require", "gyro"]);
    assert!(status == 3 && message.contains("gyro.scale.x"), "{message}");
}

#[test]
fn every_finding_is_explained() {
    let (status, list, _) = turncal(&["explain"]);
    assert_eq!(status, 0);
    for line in list.lines().map(str::trim) {
        let code = line.split_whitespace().next().unwrap();
        let (status, text, message) = turncal(&["explain", code]);
        assert!(
            status == 0 && text.starts_with(line) && text.contains("verdict"),
            "{message}"
        );
    }
    let (status, _, message) = turncal(&["explain", "W99"]);
    assert!(
        status == 1 && message.contains("turncal explain"),
        "{message}"
    );
}

#[test]
fn a_specification_that_is_not_met_is_status_three_with_the_limits_that_fail() {
    let place = tempfile::tempdir().unwrap();
    let run = simulated("demo", place.path());
    let specification = place.path().join("specification.toml");
    let specification = specification.to_string_lossy();
    let status_with = |misalignment: &str| {
        let text = format!(
            "format = \"turncal-specification/1\"\nconfidence = 0.95\n[gyro]\ninstallation_arcsec = {misalignment}\n"
        );
        std::fs::write(&*specification, text).unwrap();
        let (status, json, message) = turncal(&[
            "calibrate",
            &run,
            "--specification",
            &specification,
            "--json",
        ]);
        let lot: Value = serde_json::from_str(&json).unwrap_or_else(|_| panic!("{message}"));
        (status, lot)
    };
    let (status, lot) = status_with("{ within = 1000, xz = 10 }");
    assert_eq!((status, &lot["verdict"]["word"]), (3, &Value::from("fail")));
    let reasons = lot["verdict"]["reasons"].as_array().unwrap();
    assert!(
        reasons.len() == 1
            && reasons[0]
                .as_str()
                .unwrap()
                .ends_with("gyro.installation.xz fail")
    );
    assert_eq!(
        lot["units"][0]["values"]["gyro.installation.xz"]["verdict"],
        "fail"
    );
    let (status, lot) = status_with("1000");
    assert_eq!((status, &lot["verdict"]["word"]), (0, &Value::from("pass")));
}
