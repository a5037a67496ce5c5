//! Lots of units: calibrated together, resumed, shared between machines.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// An axis up and down in turn, in a minute and a half.
pub const PATH: &str = "first_dwell_s = 6.0
[body]
start_pitch_roll_heading_deg = [0, 0, 0]
acceleration_deg_per_s2 = 90.0
move_s = 4.0
dwell_s = 5.0
steps = [
    { turn_deg = [90, 0, 0] }, { turn_deg = [90, 0, 0] }, { turn_deg = [90, 0, 0] },
    { turn_deg = [0, 0, 90] }, { turn_deg = [0, 90, 0] }, { turn_deg = [0, 180, 0] },
    { turn_deg = [0, 0, 180] }, { turn_deg = [0, 90, 0] }, { turn_deg = [180, 0, 0] },
]
";
const SCENARIO: &str = "seed = 1
[site]
latitude_deg = 34.0
[imu]
model = \"paper\"
installation = \"general\"
output = \"pulse\"
sample_rate_hz = 50.0
[turntable]
model = \"three-axis\"
path = \"short.toml\"
";
const SPECIFICATION: &str = "format = \"turncal-specification/1\"
[accel]
bias_ug = { nominal = 2913.5, within = 900 }
";

/// Runs the command in a directory.
pub fn turncal(here: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    command.current_dir(here).args(arguments).output().unwrap()
}

pub fn on_threads(here: &Path, threads: &str, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    let command = command.env("RAYON_NUM_THREADS", threads);
    command.current_dir(here).args(arguments).output().unwrap()
}

pub fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Units `lot/u1` … of a short run each; every one says its serial.
fn simulated(here: &Path, units: usize) -> Vec<String> {
    fs::write(here.join("short.toml"), PATH).unwrap();
    fs::write(here.join("scenario.toml"), SCENARIO).unwrap();
    fs::write(here.join("specification.toml"), SPECIFICATION).unwrap();
    let unit = |k: usize| {
        let (seed, directory) = (k.to_string(), format!("lot/u{k}"));
        let arguments = [
            "simulate",
            "scenario.toml",
            "--seed",
            &seed,
            "-o",
            &directory,
        ];
        let made = turncal(here, &arguments);
        assert!(made.status.success(), "{}", words(&made));
        let run = here.join(&directory).join("run.toml");
        let text = fs::read_to_string(&run).unwrap();
        let with_serial = text.replace("[meta]", &format!("[meta]\nserial = \"A-{k}\""));
        fs::write(run, with_serial).unwrap();
        format!("{directory}/run.toml")
    };
    (1..=units).map(unit).collect()
}

fn lot<'a>(runs: &'a [String], more: &[&'a str]) -> Vec<&'a str> {
    let runs = runs.iter().map(String::as_str);
    let closed_form = ["--method", "six-position"];
    std::iter::once("calibrate")
        .chain(runs)
        .chain(closed_form)
        .chain(more.iter().copied())
        .collect()
}

/// All files below a directory with their bytes.
fn bytes(directory: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut open = vec![directory.to_owned()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(directory).unwrap().to_owned();
                all.insert(name, fs::read(path).unwrap());
            }
        }
    }
    all
}

pub fn same(a: &Path, b: &Path) {
    let (a, b) = (bytes(a), bytes(b));
    assert!(a.keys().eq(b.keys()), "{:?} {:?}", a.keys(), b.keys());
    let differing: Vec<_> = a.iter().filter(|(name, of)| b[*name] != **of).collect();
    assert!(differing.is_empty(), "{:?}", differing.iter().map(|d| d.0));
}

fn cut_short(run: &str, here: &Path) {
    let log = here.join(run).with_file_name("imu.csv.gz");
    let whole = fs::read(&log).unwrap();
    fs::write(log, &whole[..whole.len() / 2]).unwrap();
}

#[test]
fn a_lot_is_its_units_and_one_that_cannot_be_calibrated_is_a_row() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let runs = simulated(here, 4);
    cut_short(&runs[2], here);
    let specified = ["--specification", "specification.toml", "-o", "result"];
    let made = turncal(here, &lot(&runs, &specified));
    assert_eq!(made.status.code(), Some(1));
    assert!(
        words(&made).contains("1 of 4 units were not calibrated: u3"),
        "{}",
        words(&made)
    );

    let alone = ["--method", "six-position", "-o", "alone"];
    let alone = [&["calibrate", &runs[1]][..], &alone].concat();
    assert!(turncal(here, &alone).status.success());
    // Its report also has the limits of the specification.
    let of = |directory: &str| fs::read(here.join(directory).join("calibration.json")).unwrap();
    assert!(of("alone") == of("result/units/u2"));
    let said = fs::read(here.join("result/lot.json")).unwrap();
    let said: serde_json::Value = serde_json::from_slice(&said).unwrap();
    let failure = said["units"][2]["failure"].as_str().unwrap();
    assert!(failure.contains("lot/u3/imu.csv.gz"), "{failure}");
    assert_eq!(said["units"][2]["verdict"], "not-decided");
    assert_eq!(said["units"][2]["meta"]["serial"], "A-3");
    assert_eq!(said["units"][0]["verdict"], "pass");
    let table = fs::read_to_string(here.join("result/lot.csv")).unwrap();
    assert!(
        table.contains("\nu3,A-3,,,,,,,not calibrated,\n"),
        "{table}"
    );
    assert!(
        table
            .lines()
            .any(|line| line.starts_with("u4,A-4,,gyro.bias.x,deg_per_h,"))
    );

    // Without a directory only the figures, and the same.
    let printed = turncal(
        here,
        &lot(&runs, &["--specification", "specification.toml", "--json"]),
    );
    assert!(printed.stdout == fs::read(here.join("result/lot.json")).unwrap());
}

#[test]
fn a_lot_begun_goes_on_with_what_is_missing_or_has_changed_and_no_more() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let runs = simulated(here, 3);
    for name in ["result", "whole"] {
        let made = turncal(here, &lot(&runs, &["-o", name]));
        assert!(made.status.success(), "{}", words(&made));
    }
    let result = here.join("result");
    // As a killed process leaves it: a unit that is missing, a stage, and no overview.
    fs::remove_dir_all(result.join("units/u2")).unwrap();
    fs::create_dir_all(result.join("units/.turncal-left/new")).unwrap();
    for file in ["lot.json", "lot.csv", "index.html", "values.svg"] {
        fs::remove_file(result.join(file)).unwrap();
    }
    let made_at = |unit: &str| {
        let file = result.join("units").join(unit).join("unit.json");
        fs::metadata(file).unwrap().modified().unwrap()
    };
    let kept = made_at("u1");
    assert!(
        turncal(here, &lot(&runs, &["-o", "result"]))
            .status
            .success()
    );
    same(&result, &here.join("whole"));
    assert_eq!(made_at("u1"), kept);

    // Other options and other units are not mixed with it …
    let other = turncal(
        here,
        &lot(&runs, &["--installation", "six-angle", "-o", "result"]),
    );
    assert_eq!(other.status.code(), Some(1));
    assert!(
        words(&other).contains("installation = \"general\" and \"six-angle\""),
        "{}",
        words(&other)
    );
    let fewer = turncal(here, &lot(&runs[..2], &["-o", "result"]));
    assert!(words(&fewer).contains("`u3`"), "{}", words(&fewer));
    // … limits are no option of a unit's calibration, and an input that has changed is calibrated again.
    let changed = here.join(&runs[0]);
    let text = fs::read_to_string(&changed).unwrap().replace("A-1", "B-1");
    fs::write(&changed, text).unwrap();
    let specified = ["--specification", "specification.toml", "-o", "result"];
    assert!(turncal(here, &lot(&runs, &specified)).status.success());
    let said = fs::read_to_string(result.join("lot.json")).unwrap();
    assert!(said.contains("B-1") && said.contains("\"verdict\""));
    assert!(made_at("u1") > kept);

    // Force begins anew, but never at the cost of what turncal did not write.
    let forced = ["--installation", "six-angle", "--force", "-o", "result"];
    assert!(turncal(here, &lot(&runs, &forced)).status.success());
    fs::write(result.join("units/u1/mine.txt"), "").unwrap();
    let refused = turncal(here, &lot(&runs, &["--force", "-o", "result"]));
    assert!(words(&refused).contains("mine.txt"), "{}", words(&refused));
}

#[test]
fn parts_of_a_lot_on_any_threads_and_in_any_order_are_the_whole() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let runs = simulated(here, 5);
    cut_short(&runs[3], here);
    let specified = ["--specification", "specification.toml"];
    let whole = [&specified[..], &["-o", "whole"]].concat();
    assert_eq!(
        on_threads(here, "2", &lot(&runs, &whole)).status.code(),
        Some(1)
    );
    for (count, order) in [(1, &[1][..]), (2, &[2, 1]), (7, &[5, 1, 7, 3, 2, 6, 4])] {
        let parts: Vec<String> = order.iter().map(|i| format!("{count}-{i}")).collect();
        for (part, i) in parts.iter().zip(order) {
            let shard = format!("{i}/{count}");
            let more = [&specified[..], &["--shard", &shard, "-o", part]].concat();
            let threads = (1 + i % 2).to_string();
            let made = on_threads(here, &threads, &lot(&runs, &more));
            assert!(made.status.success(), "{}", words(&made));
        }
        let merged = format!("merged-{count}");
        let mut arguments = vec!["merge", "-o", &merged];
        arguments.extend(parts.iter().map(String::as_str));
        let made = turncal(here, &arguments);
        assert_eq!(made.status.code(), Some(1), "{}", words(&made));
        same(&here.join(&merged), &here.join("whole"));
    }
    for (arguments, expected) in [
        (&["merge", "2-1"][..], "no part that contains run u2, u4"),
        (
            &["merge", "2-1", "2-2", "7-3"],
            "run u3, which is also in 2-1",
        ),
        (&["merge", "2-1", "lot"], "lot/job.json"),
        (&["merge", "2-1", "whole"], "run u1, which is also in 2-1"),
    ] {
        let refused = turncal(here, arguments);
        assert_eq!(refused.status.code(), Some(1));
        assert!(words(&refused).contains(expected), "{}", words(&refused));
    }
    let other = lot(&runs, &["--shard", "2/2", "-o", "other"]);
    assert!(turncal(here, &other).status.success());
    let refused = turncal(here, &["merge", "2-1", "other"]);
    assert!(
        words(&refused).contains("specification"),
        "{}",
        words(&refused)
    );
}

#[test]
fn a_study_comes_back_from_what_its_parts_say_of_it() {
    use turncal::study::AccuracyStudy;
    for name in turncal::models::names(turncal::models::Room::Scenario) {
        let scenario = turncal::simulation::Scenario::load(name).unwrap();
        let study = AccuracyStudy {
            scenario,
            form: Default::default(),
            unmodelled: vec![turncal::calibration::ErrorTerm::TableBase],
            auto_terms: true,
            noise: Default::default(),
            runs: u64::MAX,
            seed: u64::MAX,
        };
        let text = serde_json::to_string(&study).unwrap();
        let back: AccuracyStudy = serde_json::from_str(&text).unwrap();
        // Debug shows every field, and numbers to the bit.
        assert_eq!(format!("{study:?}"), format!("{back:?}"), "{name}");
    }
}
