//! `turncal calibrate --follow`: rows are evaluated as they arrive, kept, and finally calibrated.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::Duration;

use turncal::imu::Output as Quantity;
use turncal::models::path_by_hand;
use turncal::simulation::Scenario;
use turncal_files::write_run;

const PATH: &str =
    "z_up, turn x 180, x_up, x_down, turn z 90, y_up, y_down, turn y 180, turn x 90, turn z 180";
const STATED: [&str; 2] = ["--latitude", "34"];

/// Rows of a sensor turned by hand, 100 per second.
fn rows(directory: &Path) -> String {
    let mut scenario = Scenario::load("mems").unwrap();
    scenario.path = path_by_hand(PATH).unwrap();
    let mut run = scenario.simulate(5, 0).unwrap().run;
    run.recording.table = None;
    let whole = directory.join("whole");
    fs::create_dir(&whole).unwrap();
    write_run(&whole, &run, Quantity::Rate, None).unwrap();
    let file = fs::File::open(whole.join("imu.csv.gz")).unwrap();
    std::io::read_to_string(flate2::read::GzDecoder::new(file)).unwrap()
}

fn turncal(directory: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("turncal"));
    command
        .current_dir(directory)
        .arg("calibrate")
        .args(STATED)
        .args(arguments);
    command
}

fn spawned(directory: &Path, arguments: &[&str]) -> Child {
    let mut command = turncal(directory, arguments);
    let command = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command.spawn().unwrap()
}

/// The calibration of the kept rows by the ordinary command.
fn offline(directory: &Path, log: &str) -> Vec<u8> {
    let output = turncal(directory, &[log, "--json"]).output().unwrap();
    assert!(output.status.success());
    output.stdout
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

#[test]
fn rows_of_a_pipe_are_kept_and_calibrated_as_the_file_of_them() {
    let directory = tempfile::tempdir().unwrap();
    let rows = rows(directory.path());
    let mut child = spawned(
        directory.path(),
        &["--follow", "-", "--keep", "kept.csv", "--json"],
    );
    let mut stdin = child.stdin.take().unwrap();
    // Half a row first, the other half later, and the end of input within a row.
    let cut = rows.len() / 2 + 7;
    for part in [&rows[..cut], &rows[cut..rows.len() - 3]] {
        stdin.write_all(part.as_bytes()).unwrap();
        thread::sleep(Duration::from_millis(1500));
    }
    drop(stdin);
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", text(&output));
    let kept = fs::read_to_string(directory.path().join("kept.csv")).unwrap();
    assert_eq!(kept, rows[..rows.len() - 3]);
    assert_eq!(output.stdout, offline(directory.path(), "kept.csv"));
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(told.contains("dwell 1: z up"), "{told}");
    assert!(told.contains("next: "), "{told}");
}

#[test]
fn a_run_toml_describes_rows_and_names_the_file_that_keeps_them() {
    let directory = tempfile::tempdir().unwrap();
    let rows = rows(directory.path());
    let run = fs::read_to_string(directory.path().join("whole/run.toml")).unwrap();
    let run = run.replace("imu.csv.gz", "rows.csv");
    fs::write(directory.path().join("run.toml"), run).unwrap();
    let follow = |source: &str| {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin("turncal"))
            .current_dir(directory.path())
            .args([
                "calibrate",
                "--follow",
                source,
                "--run",
                "run.toml",
                "--json",
            ])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let written = child.stdin.take().unwrap().write_all(rows.as_bytes());
        (child.wait_with_output().unwrap(), written.is_ok())
    };
    let (output, _) = follow("-");
    assert!(output.status.success(), "{}", text(&output));
    assert_eq!(
        fs::read_to_string(directory.path().join("rows.csv")).unwrap(),
        rows
    );
    let offline = Command::new(assert_cmd::cargo::cargo_bin("turncal"))
        .current_dir(directory.path())
        .args(["calibrate", "run.toml", "--json"])
        .output()
        .unwrap();
    assert_eq!(output.stdout, offline.stdout);

    fs::write(directory.path().join("other.csv"), &rows).unwrap();
    let (output, _) = follow("other.csv");
    let told = text(&output);
    assert!(
        !output.status.success() && told.contains("run.toml: [imu] names rows.csv"),
        "{told}"
    );
}

#[test]
fn a_growing_file_ends_when_it_no_longer_grows() {
    let directory = tempfile::tempdir().unwrap();
    let rows = rows(directory.path());
    let log = directory.path().join("imu.csv");
    fs::write(&log, &rows[..rows.len() / 3]).unwrap();
    let child = spawned(
        directory.path(),
        &["--follow", "imu.csv", "--patience", "3", "--json"],
    );
    let mut file = OpenOptions::new().append(true).open(&log).unwrap();
    thread::sleep(Duration::from_secs(1));
    file.write_all(&rows.as_bytes()[rows.len() / 3..]).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(
        output.stdout,
        offline(directory.path(), "imu.csv"),
        "{}",
        text(&output)
    );
}

#[cfg(unix)]
#[test]
fn a_device_that_goes_comes_again_and_a_request_to_end_calibrates_what_was_read() {
    let directory = tempfile::tempdir().unwrap();
    let rows = rows(directory.path());
    let made = Command::new("mkfifo")
        .arg(directory.path().join("device"))
        .status();
    assert!(made.unwrap().success());
    let child = spawned(
        directory.path(),
        &["--follow", "device", "--keep", "kept.csv", "--json"],
    );
    let device: PathBuf = directory.path().join("device");
    let cut = rows[..rows.len() / 2].rfind('\n').unwrap() + 1;
    for part in [&rows[..cut], &rows[cut..]] {
        fs::write(&device, part).unwrap();
        thread::sleep(Duration::from_secs(2));
    }
    // As Ctrl-C, which processes in the background of a shell may ignore.
    let id = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-TERM", &id])
            .status()
            .unwrap()
            .success()
    );
    let output = child.wait_with_output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(told.contains("gone") && told.contains("Ctrl-C"), "{told}");
    assert_eq!(
        fs::read_to_string(directory.path().join("kept.csv")).unwrap(),
        rows
    );
    assert_eq!(
        output.stdout,
        offline(directory.path(), "kept.csv"),
        "{told}"
    );
}

#[test]
fn what_keeps_rows_from_being_read_is_told_while_they_come() {
    let directory = tempfile::tempdir().unwrap();
    let mut child = spawned(directory.path(), &["--follow", "-", "--keep", "kept.csv"]);
    let mut stdin = child.stdin.take().unwrap();
    // Like a serial line at the wrong baud rate.
    let noise: Vec<u8> = (0..4000_u32)
        .map(|k| (k * 7919 % 251) as u8 | 0x80)
        .collect();
    stdin.write_all(&noise).unwrap();
    thread::sleep(Duration::from_secs(2));
    drop(stdin);
    let output = child.wait_with_output().unwrap();
    assert!(!output.status.success());
    let told = text(&output);
    assert!(told.contains("not yet: "), "{told}");
    assert_eq!(fs::read(directory.path().join("kept.csv")).unwrap(), noise);
}
