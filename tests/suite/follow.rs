//! `turncal calibrate --follow`: rows are evaluated as they arrive, kept, and finally calibrated.

use std::f64::consts::PI;
use std::fs::{self, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use nalgebra::{SMatrix, Vector3};
use turncal::calibration::{Method, Options, Problem, UNWATCHED};
use turncal::imu::Output as Quantity;
use turncal::models::path_by_hand;
use turncal::recording::Magnetometer;
use turncal::run::{Run, motion};
use turncal::simulation::Scenario;
use turncal::survey::{Evaluator, Move, Status};
use turncal::turntable::{BodyStep, Moves, Rotation};
use turncal_files::write_run;

use crate::shared::shared;

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
        !output.status.success() && told.contains("run.toml: [imu] gives the log rows.csv"),
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
    assert!(
        told.contains("disappeared") && told.contains("Ctrl-C"),
        "{told}"
    );
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

/// A sensor with a magnetometer that is turned by hand along the path and then makes these moves; the magnetometer has
/// values only in some dwells.
fn with_magnetometer(moves: &[Move], has_values: impl Fn(usize, usize) -> bool) -> Run {
    let mut scenario = Scenario::load("nine-axis").unwrap();
    scenario.path = path_by_hand(PATH).unwrap();
    let step = |of: &Move| BodyStep {
        rotation: match *of {
            Move::Up(axis) => Rotation::Point {
                axis,
                along: Vector3::z(),
            },
            Move::HalfTurn { axis, is_negative } => {
                let angle = if is_negative { -PI } else { PI };
                Rotation::By(Vector3::ith(axis, angle))
            }
        },
        duration: 5.5,
        acceleration: PI / 2.0,
        dwell: 6.0,
    };
    if let Moves::Body { steps, .. } = &mut scenario.path.moves {
        steps.extend(moves.iter().map(step));
    }
    let mut run = scenario.simulate(5, 0).unwrap().run;
    run.recording.table = None;
    let rests = motion::rests(&run);
    let times = rests.iter().map(|rest| rest.dwell.times(&run));
    let times: Vec<[f64; 2]> = times.collect();
    let log = run.recording.magnetometer.take().unwrap();
    let mut seen = Magnetometer::new(&log.unit, log.nominal);
    seen.field = log.field;
    for (time, value) in log.values() {
        let is_in = |&(_, [start, end]): &(usize, &[f64; 2])| (*start..*end).contains(&time);
        let dwell = times.iter().enumerate().find(is_in);
        if dwell.is_none_or(|(dwell, _)| has_values(dwell, times.len())) {
            seen.push(time, value);
        }
    }
    run.recording.magnetometer = Some(seen);
    run
}

/// σ of matrix and hard iron after the last dwell.
fn magnetic_sigma(status: &Status) -> [f64; 2] {
    let last = status.expected.as_ref().unwrap().history.last().unwrap();
    last.magnetic.as_ref().unwrap().each_ref().map(|of| of.0)
}

/// 1σ of the output in the direction of the field along body axes for which it is largest, T.
fn worst_direction(status: &Status) -> f64 {
    let of = status.expected.as_ref().unwrap().bound.magnetic.as_ref();
    let covariance = of.unwrap().covariance.fixed_view::<12, 12>(0, 0);
    let variance = |along: Vector3<f64>| {
        let mut rows = SMatrix::<f64, 3, 12>::zeros();
        for axis in 0..3 {
            rows.fixed_view_mut::<1, 3>(axis, 3 * axis)
                .copy_from(&along.transpose());
            rows[(axis, 9 + axis)] = 1.0;
        }
        (rows * covariance * rows.transpose()).trace()
    };
    let directions = Move::all().filter_map(|of| match of {
        Move::Up(along) => Some(variance(along)),
        Move::HalfTurn { .. } => None,
    });
    directions.fold(0.0, f64::max).sqrt()
}

#[test]
fn the_live_sigma_of_a_magnetometer_are_those_of_the_calibration_of_the_same_rows() {
    let run = with_magnetometer(&[], |_, _| true);
    let mut evaluator = Evaluator::default();
    let live = magnetic_sigma(&evaluator.status(&run, UNWATCHED));
    let problem = Problem::new(&run, &Options::default());
    let solution = problem.solve(Method::Ekf, UNWATCHED).unwrap();
    let assessment = solution.assess(&problem).unwrap();
    let mag = solution.calibration(&problem, &assessment).mag.unwrap();
    for (live, (offline, unit)) in live.into_iter().zip(mag.shown_sigma().unwrap()) {
        assert!(
            (live / offline - 1.0).abs() < 0.02,
            "{live} {offline} {unit}"
        );
    }
}

#[test]
fn rows_of_a_run_with_a_table_are_followed_too() {
    let run = Scenario::load("nine-axis")
        .unwrap()
        .simulate(1, 0)
        .unwrap()
        .run;
    let status = Evaluator::default().outlook(&run);
    assert!(
        status.expected.is_ok() && status.next.is_some(),
        "{status:?}"
    );
}

#[test]
fn the_attitude_that_only_the_magnetometer_lacks_is_asked_for_with_the_reason() {
    let outlook = |run: &Run| Evaluator::default().outlook(run);
    // Gyros and accelerometers see all faces and edges; the magnetometer only some, y down not among them.
    let mut moves: Vec<Move> = Move::all().take(18).collect();
    let whole = outlook(&with_magnetometer(&moves, |_, _| true));
    assert!(!whole.is_for_magnetometer, "{:?}", whole.next);
    let is_seen = |dwell: usize, dwells: usize| dwell < 6 || dwell + 1 == dwells;
    let run = with_magnetometer(&moves, is_seen);
    let lacking = outlook(&run);
    assert!(lacking.is_for_magnetometer, "{:?}", lacking.next);
    let next = lacking.next.unwrap();
    moves.push(next);
    let seen_before = |dwell: usize, dwells: usize| is_seen(dwell, dwells) || dwell + 2 == dwells;
    let followed = outlook(&with_magnetometer(&moves, seen_before));
    let (before, after) = (worst_direction(&lacking), worst_direction(&followed));
    assert!(after < 0.8 * before, "{next:?}: {before} {after}");
    let text = turncal_report::session::screen(&run, &lacking, None);
    assert!(
        text.last()
            .unwrap()
            .ends_with("; the magnetometer lacks this attitude"),
        "{text:?}"
    );
    assert!(
        text.iter().any(|line| line.starts_with("mag hard iron")),
        "{text:?}"
    );
}

#[test]
fn rows_with_a_magnetometer_are_followed_with_its_sigma_and_calibrated_as_the_file_of_them() {
    let directory = tempfile::tempdir().unwrap();
    let run = with_magnetometer(&[], |_, _| true);
    write_run(directory.path(), &run, Quantity::Rate, None).unwrap();
    let packed = fs::File::open(directory.path().join("imu.csv.gz")).unwrap();
    let rows = std::io::read_to_string(flate2::read::GzDecoder::new(packed)).unwrap();
    let arguments = ["--keep", "kept.csv", "--json"];
    let (told, is_success) = followed(directory.path(), &arguments, rows.as_bytes());
    assert!(is_success && told.contains("mag matrix 0."), "{told}");
    let offline = String::from_utf8(offline(directory.path(), "kept.csv")).unwrap();
    assert!(
        told.contains(&offline) && offline.contains("mag.matrix.xy"),
        "{told}"
    );
}

/// What following gives if this is its whole input, and whether it succeeded.
fn followed(directory: &Path, arguments: &[&str], input: &[u8]) -> (String, bool) {
    let mut child = spawned(directory, &[&["--follow", "-"], arguments].concat());
    // A command that refuses does not read on.
    let _ = child.stdin.take().unwrap().write_all(input);
    let output = child.wait_with_output().unwrap();
    (text(&output), output.status.success())
}

#[test]
fn lines_that_are_no_rows_are_left_out_counted_and_named_and_guidance_goes_on() {
    let banner = "MPU-6050 ready\noffsets loaded\n";
    for (case, added, counted) in [
        (
            "follow-one-letter",
            "",
            "left out: 1 (line 502: found `-0.0223p` in field 3, expected a number)",
        ),
        (
            "follow-header-again",
            banner,
            "left out: 3 (line 502: found `t` in field 1, expected a number; line 503: found 1 as",
        ),
        (
            "follow-header-again",
            "8.0,0.1,0.2\n",
            "left out: 2 (line 502: found `t` in field 1, expected a number; line 503: found 3 as",
        ),
    ] {
        let Some(from) = shared(&format!("attack/{case}")) else {
            return;
        };
        let directory = tempfile::tempdir().unwrap();
        let rows = fs::read_to_string(from.join("rows.csv")).unwrap();
        let bad = rows.lines().nth(501).unwrap().to_owned() + "\n";
        let begin = rows.rfind(&bad).unwrap();
        let (before, after) = (&rows[..begin], &rows[begin + bad.len()..]);
        let sent = [before, &bad, added, after].concat();
        let keep = ["--gyro-unit", "rad/s", "--keep", "kept.csv", "--json"];
        let (told, is_done) = followed(directory.path(), &keep, sent.as_bytes());
        assert!(is_done && told.contains(counted), "{told}");
        assert!(told.contains("next: "), "{told}");
        let kept = fs::read_to_string(directory.path().join("kept.csv")).unwrap();
        assert_eq!(kept, before.to_owned() + after);
    }
}

#[test]
fn a_kept_file_is_continued_on_a_new_line_by_rows_like_its_own() {
    let Some(from) = shared("attack/keep-continued-half-row") else {
        return;
    };
    let directory = tempfile::tempdir().unwrap();
    let [old, new] = ["k.csv", "more.csv"].map(|name| fs::read_to_string(from.join(name)).unwrap());
    let log = directory.path().join("k.csv");
    let whole = &old[..=old.rfind('\n').unwrap()];
    let names = whole.lines().next().unwrap();
    for sent in [new.clone(), format!("{names}\n{new}")] {
        fs::write(&log, &old).unwrap();
        let (told, is_done) = followed(
            directory.path(),
            &["--keep", "k.csv", "--json"],
            sent.as_bytes(),
        );
        assert!(is_done && told.contains("removed the last line"), "{told}");
        assert_eq!(fs::read_to_string(&log).unwrap(), whole.to_owned() + &new);
    }
    let renamed = names.replacen("gx,gy", "gy,gx", 1);
    for (sent, says) in [
        (renamed + "\n" + &new, "found the columns t,gy,gx"),
        (old.clone(), "rows that this file already contains"),
        (
            new.replace(',', ",0,"),
            "found 13 as the number of fields, expected 7",
        ),
    ] {
        fs::write(&log, &old).unwrap();
        let (told, is_done) = followed(directory.path(), &["--keep", "k.csv"], sent.as_bytes());
        assert!(!is_done && told.contains(says), "{told}");
        assert_eq!(fs::read_to_string(&log).unwrap(), old);
    }
}

#[test]
fn rows_are_added_to_no_other_file() {
    let cases =
        ["keep-foreign-file", "follow-header-again"].map(|of| shared(&format!("attack/{of}")));
    let [Some(foreign), Some(rows)] = cases else {
        return;
    };
    let directory = tempfile::tempdir().unwrap();
    let rows = fs::read(rows.join("rows.csv")).unwrap();
    let thesis = fs::read(foreign.join("thesis.tex")).unwrap();
    let packed = [&[0x1f, 0x8b, 8, 0][..], &rows[..3000]].concat();
    let binary: Vec<u8> = (0..5000_u32).map(|k| (k * k % 251) as u8).collect();
    for content in [thesis, packed, binary, b"t,gx,gy\n".to_vec()] {
        let file = directory.path().join("thesis.tex");
        fs::write(&file, &content).unwrap();
        let (told, is_done) = followed(directory.path(), &["--keep", "thesis.tex"], &rows);
        let refused = told.contains("thesis.tex: found no rows of numbers");
        assert!(!is_done && refused, "{told}");
        assert_eq!(fs::read(&file).unwrap(), content);
    }
}

#[test]
fn the_log_of_a_run_is_not_extended_by_its_own_rows() {
    let directory = tempfile::tempdir().unwrap();
    rows(directory.path());
    let run = directory.path().join("whole");
    let log = fs::read(run.join("imu.csv.gz")).unwrap();
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("turncal"))
        .current_dir(&run)
        .args(["calibrate", "--follow", "-", "--run", "run.toml"])
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let _ = child.stdin.take().unwrap().write_all(&log);
    let output = child.wait_with_output().unwrap();
    let told = text(&output);
    assert!(
        !output.status.success() && told.contains("found the existing file imu.csv.gz"),
        "{told}"
    );
    assert_eq!(fs::read(run.join("imu.csv.gz")).unwrap(), log);
}

#[test]
fn a_specification_is_decided_by_the_calibration_of_all_rows() {
    let directory = tempfile::tempdir().unwrap();
    let rows = rows(directory.path());
    let limits = ["--specification", "mems-by-hand", "--json"];
    let (told, is_done) = followed(directory.path(), &limits, rows.as_bytes());
    assert!(!is_done, "{told}");
    let not_met = "the specification is not met: ";
    assert!(told.contains(not_met) && told.contains(" met, "), "{told}");
}

#[test]
fn the_sketch_has_the_functions_that_an_arduino_calls() {
    let page = include_str!("../../docs/live.md");
    for function in ["    void setup() {", "    void loop() {"] {
        assert!(page.contains(function), "{function}");
    }
}

/// A serial device: a terminal whose other end is written to.
#[cfg(target_os = "linux")]
struct Device(Child);

#[cfg(target_os = "linux")]
impl Device {
    /// Makes it available by this name.
    fn new(name: &Path) -> Self {
        let _ = fs::remove_file(name);
        let made = format!(
            "stty raw -echo; ln -s $(tty) {}; exec sleep 600",
            name.display()
        );
        let child = Command::new("script")
            .args(["-q", "-c", &made, "/dev/null"])
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .spawn();
        while !name.exists() {
            thread::sleep(Duration::from_millis(20));
        }
        Self(child.unwrap())
    }

    fn says(&mut self, text: &str) {
        let mut input = self.0.stdin.as_ref().unwrap();
        input.write_all(text.as_bytes()).unwrap();
    }

    /// Lets the last bytes arrive, then takes the device away.
    fn go(mut self) {
        thread::sleep(Duration::from_millis(500));
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_device_with_noise_that_resets_gives_the_values_of_its_rows() {
    let directory = tempfile::tempdir().unwrap();
    let rows = rows(directory.path());
    let lines: Vec<&str> = rows.split_inclusive('\n').collect();
    let (header, third) = (lines[0], lines.len() / 3);
    let name = directory.path().join("device");
    let banner = "\u{fffd}\u{1}boot\nIMU ready, 100 Hz\n";
    let mut device = Device::new(&name);
    let child = spawned(
        directory.path(),
        &["--follow", "device", "--keep", "kept.csv", "-o", "result"],
    );
    thread::sleep(Duration::from_millis(500));
    let noise = ["0.1,0.2\n", "12.3,0.0p,0,0,0,0,9.8\n", &lines[50][9..]];
    device.says(&[&lines[7][5..], lines[8], banner, header].concat());
    device.says(&lines[1..third].concat());
    device.says(&noise.concat());
    device.says(&(lines[third..2 * third].concat() + &lines[2 * third][..20]));
    let kept = || fs::read_to_string(directory.path().join("kept.csv")).unwrap();
    let wait_for = |lines: usize| {
        let begun = Instant::now();
        while kept().lines().count() < lines && begun.elapsed().as_secs() < 60 {
            thread::sleep(Duration::from_millis(100));
        }
    };
    wait_for(2 * third);
    device.go();
    let mut device = Device::new(&name);
    thread::sleep(Duration::from_secs(2));
    device.says(&[&lines[2 * third][20..], banner, header].concat());
    device.says(&lines[2 * third + 1..].concat());
    wait_for(lines.len() - 1);
    let ended = Command::new("kill")
        .args(["-TERM", &child.id().to_string()])
        .status();
    assert!(ended.unwrap().success());
    let output = child.wait_with_output().unwrap();
    device.go();
    let told = text(&output);
    assert!(
        output.status.success() && told.contains("incomplete lines left out: 12 ("),
        "{told}"
    );
    let good = [&lines[..2 * third], &lines[2 * third + 1..]].concat();
    assert!(kept() == good.concat());
    let result = directory.path().join("result");
    let run = fs::read_to_string(result.join("run.toml")).unwrap();
    let named = run
        .lines()
        .find_map(|line| line.strip_prefix("file = "))
        .unwrap();
    assert!(Path::new(named.trim_matches('"')).is_file(), "{named}");
    let [live, offline] = [
        fs::read(result.join("calibration.json")).unwrap(),
        offline(directory.path(), "kept.csv"),
    ];
    let [live, offline] =
        [live, offline].map(|of| serde_json::from_slice::<serde_json::Value>(&of).unwrap());
    for part in ["gyro", "accel", "covariance", "verdict"] {
        assert_eq!(live[part], offline[part], "{part}");
    }
}

/// Duration of the record on the last screen, s.
#[cfg(target_os = "linux")]
fn shown(screens: &str) -> Option<f64> {
    screens.lines().rev().find_map(|line| {
        let (duration, rest) = line.split_once(" s, ")?;
        let is_state = rest.split(' ').nth(1)?.starts_with("dwell");
        duration.parse().ok().filter(|_| is_state)
    })
}

#[cfg(target_os = "linux")]
#[test]
#[ignore = "time of the machine"]
fn the_status_lags_at_most_two_seconds_on_one_core_also_while_rows_are_calibrated() {
    const RATE: f64 = 100.0;
    let directory = tempfile::tempdir().unwrap();
    let rows = rows(directory.path());
    let lines: Vec<&str> = rows.split_inclusive('\n').collect();
    // The second calibration is due after growth by half, 10 s after the rows begin to come in real time.
    let first = lines.len() * 6 / 10;
    let (second, whole) = (first * 3 / 2 - 1000, first * 3 / 2 + 1000);
    let program = assert_cmd::cargo::cargo_bin("turncal");
    let follow = format!(
        "exec taskset -c 0 {} calibrate --follow - --latitude 34 < rows",
        program.display()
    );
    let made = Command::new("mkfifo")
        .arg(directory.path().join("rows"))
        .status();
    assert!(made.unwrap().success());
    let mut child = Command::new("script")
        .current_dir(directory.path())
        .args(["-q", "-c", &follow, "/dev/null"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut output = child.stdout.take().unwrap();
    let screens = Arc::new(Mutex::new(String::new()));
    let read = screens.clone();
    thread::spawn(move || {
        let mut buffer = [0; 4096];
        while let Ok(count @ 1..) = output.read(&mut buffer) {
            let mut screens = read.lock().unwrap();
            screens.push_str(&String::from_utf8_lossy(&buffer[..count]));
        }
    });
    let mut pipe = fs::File::create(directory.path().join("rows")).unwrap();
    let behind = |sent: usize| sent as f64 / RATE - shown(&screens.lock().unwrap()).unwrap_or(0.0);
    for (begin, end) in [(0, first), (first, second)] {
        pipe.write_all(lines[begin..end].concat().as_bytes())
            .unwrap();
        let begun = Instant::now();
        while behind(end) > 1.0 && begun.elapsed().as_secs() < 30 {
            thread::sleep(Duration::from_millis(50));
        }
    }
    let (begun, mut sent, mut lags) = (Instant::now(), second, Vec::new());
    while sent < whole {
        let until = (second + (begun.elapsed().as_secs_f64() * RATE) as usize).min(whole);
        pipe.write_all(lines[sent..until].concat().as_bytes())
            .unwrap();
        sent = until;
        thread::sleep(Duration::from_millis(20));
        lags.push(behind(sent));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    lags.sort_by(f64::total_cmp);
    let (median, most) = (lags[lags.len() / 2], lags[lags.len() - 1]);
    println!(
        "{} s of record: lag {median:.2} s, at most {most:.2} s",
        whole as f64 / RATE
    );
    assert!(most <= 2.0, "{median} {most}");
}
