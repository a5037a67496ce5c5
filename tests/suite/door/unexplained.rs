//! What no noise explains is no calibration.

use std::fs;

use assert_cmd::Command;

fn turncal() -> Command {
    Command::new(env!("CARGO_BIN_EXE_turncal"))
}

#[test]
fn innovations_beyond_any_noise_figure_are_written_and_fail() {
    let directory = tempfile::tempdir().unwrap();
    let run = directory.path().join("run");
    let simulate = ["simulate", "mems", "--seed", "1", "-o"];
    turncal().args(simulate).arg(&run).assert().success();
    let toml = run.join("run.toml");
    let text = fs::read_to_string(&toml).unwrap();
    let stated = "velocity_random_walk_ug_per_sqrt_hz = 60.0";
    assert_eq!(text.matches(stated).count(), 1);
    fs::write(
        &toml,
        text.replace(stated, "velocity_random_walk_ug_per_sqrt_hz = 0.6"),
    )
    .unwrap();
    let output = turncal()
        .args(["calibrate", "--noise", "stated", "--json"])
        .arg(&toml)
        .assert()
        .code(1);
    let output = output.get_output();
    let record: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let findings = record["findings"].as_array().unwrap();
    assert!(
        findings
            .iter()
            .any(|finding| finding["kind"] == "unexplained")
    );
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("do not use the values"), "{said}");
}
