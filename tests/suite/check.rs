//! `turncal check` as a user meets it.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use serde_json::Value;

use crate::shared::shared;

fn check(arguments: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    command.arg("check").args(arguments).assert()
}

fn document(run: &Path) -> Value {
    let said = check(&[run.to_str().unwrap(), "--json"]).success();
    serde_json::from_slice(&said.get_output().stdout).unwrap()
}

fn simulated(directory: &Path) -> PathBuf {
    let run = directory.join("run");
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    let simulate = [
        "simulate",
        "demo",
        "--seed",
        "3",
        "-o",
        run.to_str().unwrap(),
    ];
    command.args(simulate).assert().success();
    run.join("run.toml")
}

fn findings(document: &Value) -> Vec<&str> {
    let findings = document["findings"].as_array().unwrap();
    findings
        .iter()
        .map(|finding| finding.as_str().unwrap())
        .collect()
}

#[test]
fn positions_and_turns_made_by_hand_agree_with_their_labels() {
    for name in ["real-mems-six-position", "real-mems-raw-sections"] {
        let Some(directory) = shared(name) else {
            continue;
        };
        let document = document(&directory.join("run.toml"));
        let segments = document["segments"].as_array().unwrap();
        assert_eq!(segments.len(), 9);
        for segment in segments {
            assert_eq!(segment["agrees"], true, "{name} {segment}");
        }
        for way in ["x up", "x down", "y up", "y down", "z up", "z down"] {
            assert!(document["ways_up"][way].as_u64() > Some(0), "{name} {way}");
        }
    }
}

#[test]
fn a_wrong_label_is_said_by_name() {
    let Some(directory) = shared("real-mems-raw-sections") else {
        return;
    };
    let place = tempfile::tempdir().unwrap();
    for file in ["imu.csv.gz", "run.toml"] {
        fs::copy(directory.join(file), place.path().join(file)).unwrap();
    }
    let labels = fs::read_to_string(directory.join("segments.csv")).unwrap();
    let labels = labels
        .replace("y_up", "y_DOWN")
        .replace("y_down", "y_up")
        .replace("y_DOWN", "y_down");
    fs::write(
        place.path().join("segments.csv"),
        labels.replace("rot_z+360", "rot_z-360"),
    )
    .unwrap();
    let document = document(&place.path().join("run.toml"));
    let said = findings(&document).join("\n");
    assert!(
        said.contains("Section `y_down` at 10.2 s has a different axis up, 178°"),
        "{said}"
    );
    assert!(
        said.contains("Section `rot_z-360` at 39.0 s turns by +356"),
        "{said}"
    );
}

#[test]
fn expected_sigma_are_those_of_the_calibration() {
    let Some(directory) = shared("three-axis-counts") else {
        return;
    };
    let document = document(&directory.join("run.toml"));
    let methods = document["methods"].as_array().unwrap();
    let of = |name: &str| {
        methods
            .iter()
            .find(|method| method["method"].as_str().unwrap().ends_with(name))
            .unwrap()
    };
    let table = &of("table")["sigma"];
    for (group, known) in [
        ("gyro.scale_ppm", 0.27),
        ("gyro.installation_arcsec", 0.33),
        ("gyro.bias_deg_per_h", 0.0034),
        // 0.43, and gravity that is stated to a milligal.
        ("accel.scale_ppm", 1.11),
        ("accel.installation_arcsec", 0.34),
        ("accel.bias_ug", 0.41),
    ] {
        let sigma = table[group].as_f64().unwrap();
        assert!((sigma / known - 1.0).abs() < 0.06, "{group} {sigma}");
    }
    assert_eq!(of("table")["not_observed"].as_array().unwrap().len(), 0);
    assert!(
        !of("six-position")["not_observed"]
            .as_array()
            .unwrap()
            .is_empty()
    );
}

#[test]
fn every_fault_of_a_log_is_named() {
    let place = tempfile::tempdir().unwrap();
    let run = simulated(place.path());
    let log = run.with_file_name("imu.csv.gz");
    let mut text = String::new();
    let file = fs::File::open(&log).unwrap();
    std::io::Read::read_to_string(&mut GzDecoder::new(file), &mut text).unwrap();
    let sound = document(&run);
    assert_eq!(
        sound["fault_samples"].as_object().unwrap().len(),
        0,
        "{}",
        sound["fault_samples"]
    );
    let mut rows: Vec<String> = text.lines().map(str::to_owned).collect();
    // Of the first turn: its fastest axis stays where it is for a second, another one meets its end.
    let turn = &sound["turns"][0];
    let (start, end) = (
        turn["start_s"].as_f64().unwrap(),
        turn["end_s"].as_f64().unwrap(),
    );
    let period = sound["sample_period_s"].as_f64().unwrap();
    let middle = 1 + (0.5 * (start + end) / period) as usize;
    let fields = |row: &str| -> Vec<String> { row.split(',').map(str::to_owned).collect() };
    let stuck = fields(&rows[middle]);
    for row in &mut rows[middle..middle + (1.0 / period) as usize] {
        let mut values = fields(row);
        values[5] = stuck[5].clone();
        *row = values.join(",");
    }
    for row in [900, 2300, 4100, 6200, 8800, 9000, 9700] {
        let mut values = fields(&rows[row]);
        values[3] = "32767".to_owned();
        rows[row] = values.join(",");
    }
    rows.insert(701, rows[700].clone());
    rows.drain(3000..3003);
    let file = fs::File::create(&log).unwrap();
    let mut gz = GzEncoder::new(file, flate2::Compression::fast());
    gz.write_all((rows.join("\n") + "\n").as_bytes()).unwrap();
    gz.finish().unwrap();
    let document = document(&run);
    let samples = &document["fault_samples"];
    assert_eq!(samples["missing"], 3, "{samples}");
    assert_eq!(samples["duplicate"], 1, "{samples}");
    assert_eq!(samples["saturated"], 7, "{samples}");
    assert!(
        samples["stuck"].as_u64() >= Some((0.9 / period) as u64),
        "{samples}"
    );
    for kind in ["missing", "duplicated", "saturated", "stuck"] {
        assert!(
            findings(&document)
                .iter()
                .any(|finding| finding.contains(kind)),
            "{kind}"
        );
    }
}

#[test]
fn a_page_is_written_whole_and_what_cannot_be_read_fails() {
    let place = tempfile::tempdir().unwrap();
    let run = simulated(place.path());
    let report = place.path().join("report");
    let arguments = [run.to_str().unwrap(), "-o", report.to_str().unwrap()];
    check(&arguments).success();
    for file in ["index.html", "record.svg"] {
        assert!(
            fs::metadata(report.join(file)).unwrap().len() > 1000,
            "{file}"
        );
    }
    check(&arguments).code(1);
    fs::write(&run, "format = 1").unwrap();
    check(&[run.to_str().unwrap()]).code(1);
}
