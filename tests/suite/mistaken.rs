//! What is easily mistaken on the command line: a file of another kind, a name, a header, a rate.

use std::io::Read;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use flate2::read::GzDecoder;

fn turncal(place: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    command.current_dir(place).args(arguments).output().unwrap()
}

/// The log of a simulated sensor in rad/s and m/s², as `imu.csv`.
fn log(place: &Path) -> String {
    let simulated = turncal(place, &["simulate", "mems", "-o", "run"]);
    assert!(simulated.status.success());
    let file = std::fs::File::open(place.join("run").join("imu.csv.gz")).unwrap();
    let mut text = String::new();
    GzDecoder::new(file).read_to_string(&mut text).unwrap();
    std::fs::write(place.join("imu.csv"), &text).unwrap();
    text
}

/// The message with which a calibration is refused.
fn refused(place: &Path, arguments: &[&str]) -> String {
    let of = turncal(place, &[&["calibrate"], arguments, &["-o", "out"]].concat());
    assert_eq!(of.status.code(), Some(1));
    assert!(!place.join("out").exists());
    String::from_utf8(of.stderr).unwrap()
}

#[test]
fn a_file_of_another_kind_and_a_wrong_name_are_told() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    log(place);
    std::fs::write(place.join("calibration.json"), "{\n  \"gyro\": 1\n}\n").unwrap();
    std::fs::write(place.join("erased.csv"), [0; 4096]).unwrap();
    let message = refused(place, &["calibration.json"]);
    assert!(
        message.contains("found JSON") && message.contains("turncal show"),
        "{message}"
    );
    let message = refused(place, &["erased.csv"]);
    assert!(message.contains("NUL bytes"), "{message}");
    let message = refused(place, &["imu.cvs"]);
    assert!(message.contains("Did you mean `imu.csv`?"), "{message}");
}

#[test]
fn exchanged_triads_of_a_header_are_told() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    let text = log(place);
    let exchanged = text.replacen("t,gx,gy,gz,ax,ay,az", "t,ax,ay,az,gx,gy,gz", 1);
    assert_ne!(text, exchanged);
    std::fs::write(place.join("imu.csv"), exchanged).unwrap();
    let message = refused(place, &["imu.csv", "--latitude", "34"]);
    assert!(
        message.contains("gravity in the columns gx gy gz and turns in the columns ax ay az"),
        "{message}"
    );
}

#[test]
fn a_rate_that_fits_no_unit_without_a_time_column_is_asked() {
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    let text = log(place);
    let without_time = text.lines().map(|line| line.split_once(',').unwrap().1);
    let rows: Vec<&str> = without_time.collect();
    std::fs::write(place.join("imu.csv"), rows.join("\n") + "\n").unwrap();
    let message = refused(place, &["imu.csv", "--latitude", "34", "--rate", "200"]);
    assert!(
        message.contains("at 200 Hz") && message.contains("rad/s would fit at about"),
        "{message}"
    );
}
