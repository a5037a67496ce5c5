//! Logs of other programs, written by the formats' own Python packages.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use turncal::calibration::result::Calibration;
use turncal::imu::Sensor;
use turncal::run::Run;

use crate::shared::{read, shared, skipped};

const FORMATS: [&str; 15] = [
    "npz",
    "deflated.npz",
    "npy",
    "mat",
    "plain.mat",
    "mcap",
    "lz4.mcap",
    "plain.mcap",
    "json.mcap",
    "proto.mcap",
    "bag",
    "lz4.bag",
    "bz2.bag",
    "ulg",
    "bin",
];
/// Formats of 32-bit numbers.
const SHORT: [&str; 2] = ["ulg", "bin"];

fn python() -> String {
    std::env::var("TURNCAL_PYTHON").unwrap_or_else(|_| "python3".to_owned())
}

/// Writes a record of accelerometers and gyros as these formats; false where Python or a package is missing.
fn write(log: &Path, directory: &Path, formats: &[&str]) -> bool {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/suite/logs/write.py");
    let mut command = Command::new(python());
    command
        .arg(script)
        .arg(log)
        .arg("0.01")
        .arg(directory)
        .args(formats);
    let Ok(output) = command.output() else {
        skipped("no Python");
        return false;
    };
    let said = String::from_utf8_lossy(&output.stdout);
    let error = String::from_utf8_lossy(&output.stderr);
    if error.contains("ModuleNotFoundError") || said.contains("skipped") {
        skipped(&format!("Python lacks packages: {said}{error}"));
        return false;
    }
    assert!(output.status.success(), "{error}");
    true
}

/// The run of a shared record with another log, drafted by `init`.
fn run_of(log: &Path, text: &str, directory: &Path) -> PathBuf {
    let mut init = assert_cmd::Command::new(env!("CARGO_BIN_EXE_turncal"));
    let output = init
        .arg("init")
        .arg(log)
        .assert()
        .success()
        .get_output()
        .clone();
    let draft = String::from_utf8(output.stdout).unwrap();
    let keys = ["stream =", "accel_from =", "time_unit =", "columns ="];
    let drafted = draft
        .lines()
        .filter(|line| keys.iter().any(|key| line.starts_with(key)));
    let mut lines: Vec<String> = text
        .lines()
        .filter(|line| !line.starts_with("columns = { gyro"))
        .map(str::to_owned)
        .collect();
    let file = lines
        .iter()
        .position(|line| line.starts_with("file = "))
        .unwrap();
    lines[file] = format!("file = {:?}", log.to_str().unwrap());
    let drafted: Vec<String> = drafted.map(str::to_owned).collect();
    lines.splice(file + 1..file + 1, drafted);
    let path = directory.join("run.toml");
    fs::write(&path, lines.join("\n")).unwrap();
    path
}

#[test]
fn every_format_gives_the_samples_of_the_text() {
    let Some(record) = shared("real-mems-lot-0") else {
        return;
    };
    let directory = tempfile::tempdir().unwrap();
    // Enough to draft a run from, and quick.
    let rows: Vec<String> = fs::read_to_string(record.join("imu.log"))
        .unwrap()
        .lines()
        .take(6000)
        .map(str::to_owned)
        .collect();
    let log = directory.path().join("imu.log");
    fs::write(&log, rows.join("\n") + "\n").unwrap();
    if !write(&log, directory.path(), &[]) {
        return;
    }
    let text = fs::read_to_string(record.join("run.toml")).unwrap();
    fs::write(directory.path().join("run.toml"), &text).unwrap();
    let expected = read(directory.path()).recording.imu;
    for format in FORMATS {
        let path = directory.path().join(format!("imu.{format}"));
        let run = Run::read(&run_of(&path, &text, directory.path()))
            .unwrap_or_else(|e| panic!("{format}: {e}"));
        let imu = run.recording.imu;
        assert_eq!(imu.len(), expected.len(), "{format}");
        // 24 bits of the largest value, times the sample's length.
        let limit = if SHORT.contains(&format) { 4e-8 } else { 1e-12 };
        for sensor in Sensor::ALL {
            let pairs = expected.of(sensor).iter().zip(imu.of(sensor));
            let off = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(off < limit, "{format}: {} off by {off}", sensor.name());
        }
    }
}

#[test]
#[ignore = "16 calibrations"]
fn every_format_gives_the_calibration_of_the_text() {
    let Some(record) = shared("real-mems-lot-0") else {
        return;
    };
    let directory = tempfile::tempdir().unwrap();
    if !write(&record.join("imu.log"), directory.path(), &[]) {
        return;
    }
    let calibrated = |run: &Path| {
        let result = directory.path().join("result");
        let mut calibrate = assert_cmd::Command::new(env!("CARGO_BIN_EXE_turncal"));
        calibrate
            .arg("calibrate")
            .arg(run)
            .args(["--force", "-o"])
            .arg(&result);
        calibrate.assert().success();
        Calibration::read(&result.join("calibration.json")).unwrap()
    };
    let text = fs::read_to_string(record.join("run.toml")).unwrap();
    let values = |calibration: &Calibration| {
        let of = |triad: &turncal::calibration::result::TriadRecord| {
            let installation = triad.installation.as_flattened().to_vec();
            [triad.scale.to_vec(), installation, triad.bias.to_vec()].concat()
        };
        [of(&calibration.gyro), of(&calibration.accel)].concat()
    };
    let expected = calibrated(&record.join("run.toml"));
    let sigma = expected.sigma.clone().unwrap();
    let sigma = values(&Calibration::new(sigma.gyro, sigma.accel));
    for format in FORMATS {
        let path = directory.path().join(format!("imu.{format}"));
        let found = values(&calibrated(&run_of(&path, &text, directory.path())));
        for ((found, expected), sigma) in found.iter().zip(values(&expected)).zip(&sigma) {
            let limit = match SHORT.contains(&format) {
                true => 1e-3 * sigma,
                // Of the parameter, or of what it is measured against: one.
                false => 1e-9 * expected.abs().max(1.0),
            };
            assert!(
                (found - expected).abs() <= limit,
                "{format}: {found} {expected}"
            );
        }
    }
}
