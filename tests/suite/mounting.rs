//! Axes that are not as `run.toml` has them, as a user meets them.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;

fn turncal(arguments: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    command.args(arguments).assert()
}

fn simulated(directory: &Path) -> PathBuf {
    let run = directory.join("run");
    turncal(&[
        "simulate",
        "mems",
        "--seed",
        "3",
        "-o",
        run.to_str().unwrap(),
    ])
    .success();
    run.join("run.toml")
}

fn with_columns(run: &Path, line: &str) -> String {
    let text = fs::read_to_string(run).unwrap();
    let lines = text.lines().map(|old| {
        if old.starts_with("columns = { time = \"t\", gyro") {
            line
        } else {
            old
        }
    });
    lines.collect::<Vec<_>>().join("\n")
}

fn calibration(run: &Path, method: &str) -> Value {
    let said = turncal(&[
        "calibrate",
        run.to_str().unwrap(),
        "--method",
        method,
        "--json",
    ]);
    let mut record: Value = serde_json::from_slice(&said.success().get_output().stdout).unwrap();
    // The run.toml is another each time.
    record["provenance"]["inputs"].take();
    record
}

#[test]
fn the_line_that_is_named_puts_a_wrong_mounting_right() {
    let directory = tempfile::tempdir().unwrap();
    let run = simulated(directory.path());
    let right = fs::read_to_string(&run).unwrap();
    let expected = calibration(&run, "six-position");
    // As if the log had gyro z with its sign turned round and accelerometers x and y in each other's place.
    let wrong =
        r#"columns = { time = "t", gyro = ["gx", "gy", "-gz"], accel = ["ay", "ax", "az"] }"#;
    let line = r#"columns = { time = "t", gyro = ["gx", "gy", "gz"], accel = ["ax", "ay", "az"] }"#;
    fs::write(&run, with_columns(&run, wrong)).unwrap();
    for method in ["ekf", "six-position"] {
        let output = directory.path().join(method);
        let target = output.to_str().unwrap();
        let said = turncal(&[
            "calibrate",
            run.to_str().unwrap(),
            "--method",
            method,
            "-o",
            target,
        ]);
        let said = said.failure().code(1);
        let message = String::from_utf8_lossy(&said.get_output().stderr).into_owned();
        assert!(message.contains(line), "{message}");
        assert!(!output.exists());
    }
    let checked = turncal(&["check", run.to_str().unwrap(), "--json"]).success();
    let checked: Value = serde_json::from_slice(&checked.get_output().stdout).unwrap();
    assert!(checked["findings"][0].as_str().unwrap().contains(line));
    fs::write(&run, with_columns(&run, line)).unwrap();
    assert_eq!(fs::read_to_string(&run).unwrap().trim(), right.trim());
    assert_eq!(calibration(&run, "six-position"), expected);
}

#[test]
fn a_gyro_that_is_half_as_sensitive_as_stated_is_named_with_its_axis() {
    let directory = tempfile::tempdir().unwrap();
    let run = simulated(directory.path());
    let right = fs::read_to_string(&run).unwrap();
    let stated = "[imu.prior.gyro]\nscale = 1.0\n";
    assert!(right.contains(stated), "{right}");
    let twice = right.replace(stated, "[imu.prior.gyro]\nscale = [2.0, 1.0, 1.0]\n");
    fs::write(&run, twice).unwrap();
    for method in ["ekf", "six-position"] {
        let said = turncal(&["calibrate", run.to_str().unwrap(), "--method", method]);
        let said = said.failure().code(1);
        let message = String::from_utf8_lossy(&said.get_output().stderr).into_owned();
        assert!(message.contains("gyro x is 0.5"), "{method}: {message}");
    }
}
