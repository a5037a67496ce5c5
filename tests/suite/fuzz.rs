//! Spoilt files of every format: an answer or an error that names the file, never a panic.
//!
//! `PROPTEST_CASES=1000000 cargo test --release --test suite fuzz` goes on for a million inputs a format.

use std::cell::Cell;
use std::fs;
use std::path::Path;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use tempfile::TempDir;
use turncal::calibration::{Correction, Options, Problem, UNWATCHED, estimate, six_position};
use turncal::imu::Output;
use turncal::models;
use turncal::noise::Stretch;
use turncal::noise::conventions::convert;
use turncal::simulation::Scenario;
use turncal::survey::Survey;
use turncal_files::draft::Draft;
use turncal_files::write_run;
use turncal_report::check;

/// The files of [`small_run`].
const FILES: [&str; 4] = ["run.toml", "imu.csv", "table.csv", "segments.csv"];

/// Cases of each format where `PROPTEST_CASES` says nothing.
const CASES: u32 = 200;

/// What numbers are replaced by.
const NUMBERS: [&str; 22] = [
    "",
    "0",
    "-0",
    "1",
    "-1",
    "2.5",
    "1e-3",
    "1e3",
    "1e9",
    "-1e12",
    "1e308",
    "-1e308",
    "1e400",
    "5e-324",
    "nan",
    "inf",
    "-inf",
    "9007199254740993",
    "18446744073709551616",
    "0x7f",
    "1_0",
    "1,5",
];

/// One thing that happens to a file.
#[derive(Debug, Clone)]
enum Spoil {
    Bytes(Index, usize, Vec<u8>),
    Number(Index, &'static str),
    CopyLine(Index, Index),
    RemoveLines(Index, usize),
    CutAt(Index),
}

impl Spoil {
    fn any() -> impl Strategy<Value = Self> {
        prop_oneof![
            2 => (any::<Index>(), 0..4usize, vec(any::<u8>(), 0..4))
                .prop_map(|(at, removed, bytes)| Self::Bytes(at, removed, bytes)),
            6 => (any::<Index>(), select(&NUMBERS[..])).prop_map(|(at, with)| Self::Number(at, with)),
            1 => (any::<Index>(), any::<Index>()).prop_map(|(from, to)| Self::CopyLine(from, to)),
            1 => (any::<Index>(), 1..30usize).prop_map(|(at, count)| Self::RemoveLines(at, count)),
            1 => any::<Index>().prop_map(Self::CutAt),
        ]
    }

    fn apply(&self, content: &mut Vec<u8>) {
        if content.is_empty() {
            return;
        }
        match self {
            Self::Bytes(at, removed, bytes) => {
                let at = at.index(content.len());
                let end = (at + removed).min(content.len());
                content.splice(at..end, bytes.iter().copied());
            }
            Self::Number(at, with) => {
                let numbers = numbers(content);
                if !numbers.is_empty() {
                    let number = numbers[at.index(numbers.len())].clone();
                    content.splice(number, with.bytes());
                }
            }
            Self::CopyLine(from, to) => {
                let mut lines = lines(content);
                let line = lines[from.index(lines.len())].to_vec();
                lines.insert(to.index(lines.len()), &line);
                *content = lines.concat();
            }
            Self::RemoveLines(at, count) => {
                let mut lines = lines(content);
                let at = at.index(lines.len());
                let end = (at + count).min(lines.len());
                lines.drain(at..end);
                *content = lines.concat();
            }
            Self::CutAt(at) => content.truncate(at.index(content.len())),
        }
    }
}

fn lines(content: &[u8]) -> Vec<&[u8]> {
    content.split_inclusive(|&byte| byte == b'\n').collect()
}

/// Where numbers stand.
fn numbers(content: &[u8]) -> Vec<std::ops::Range<usize>> {
    let of_number = |byte: &u8| byte.is_ascii_digit() || b"+-.".contains(byte);
    let mut numbers = Vec::new();
    let mut start = 0;
    for run in content.chunk_by(|a, b| of_number(a) == of_number(b)) {
        let end = start + run.len();
        if run.iter().any(u8::is_ascii_digit) {
            numbers.push(start..end);
        }
        start = end;
    }
    numbers
}

/// The names of files that an error may be about: those of the directory, and what the spoilt file calls them.
fn names_a_file(message: &str, directory: &Path, content: &[u8]) -> bool {
    let content = String::from_utf8_lossy(content);
    // Apostrophes of comments are quotes, too, so every piece may be a name.
    let mut called = content.split(['"', '\'']);
    let mut files = fs::read_dir(directory).unwrap();
    files.any(|file| message.contains(&*file.unwrap().path().to_string_lossy()))
        || called.any(|name| {
            let named = directory.join(name);
            !name.is_empty() && message.contains(&*named.to_string_lossy())
        })
}

/// Spoils one file of a directory again and again; `read` says what became of it. Gives how often it was read
/// all the same: if never, nothing behind the door was tried.
fn fuzz(directory: &TempDir, file: &str, read: impl Fn(&Path) -> Result<(), String>) -> u32 {
    let path = directory.path().join(file);
    let good = fs::read(&path).unwrap();
    read(directory.path()).unwrap();
    let config = Config {
        cases: std::env::var("PROPTEST_CASES").map_or(CASES, |_| Config::default().cases),
        failure_persistence: None,
        ..Config::default()
    };
    let (read_all_the_same, refused) = (Cell::new(0), Cell::new(0));
    // The same cases in every run, unless more are asked for.
    let mut runner = match std::env::var_os("PROPTEST_CASES") {
        Some(_) => TestRunner::new(config),
        None => {
            let algorithm = RngAlgorithm::ChaCha;
            TestRunner::new_with_rng(config, TestRng::deterministic_rng(algorithm))
        }
    };
    let outcome = runner.run(&vec(Spoil::any(), 1..5), |spoils| {
        let mut content = good.clone();
        spoils.iter().for_each(|spoil| spoil.apply(&mut content));
        fs::write(&path, &content).unwrap();
        match read(directory.path()) {
            Ok(()) => read_all_the_same.set(read_all_the_same.get() + 1),
            Err(message) => {
                let named = names_a_file(&message, directory.path(), &content);
                prop_assert!(named, "no file named: {message}");
                refused.set(refused.get() + 1);
            }
        }
        Ok(())
    });
    if let Err(error) = outcome {
        panic!("{file}: {error}");
    }
    let (kept, refused) = (read_all_the_same.get(), refused.get());
    println!("{file}: {kept} read all the same, {refused} refused");
    fs::write(&path, good).unwrap();
    kept
}

/// A small run with dwells and turns, a table and labels.
fn small_run() -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    let scenario = r#"seed = 1
[site]
latitude_deg = 34.0
[imu]
model = "industrial-mems"
installation = "general"
output = "rate"
sample_rate_hz = 20.0
[turntable]
model = "three-axis"
path = "path.toml"
"#;
    let path = "first_dwell_s = 3.0\n[axes]\nstart_deg = [0, 0, 0]\nrate_deg_per_s = 90.0\n\
                acceleration_deg_per_s2 = 90.0\ndwell_s = 3.0\nsteps = [\n  { turn_deg = [0, 90, 0] },\n  \
                { turn_deg = [0, 0, 90] },\n]\n";
    fs::write(directory.path().join("scenario.toml"), scenario).unwrap();
    fs::write(directory.path().join("path.toml"), path).unwrap();
    let scenario =
        Scenario::load(directory.path().join("scenario.toml").to_str().unwrap()).unwrap();
    let run = scenario.simulate(1, 0).unwrap().run;
    write_run(directory.path(), &run, Output::Rate, None).unwrap();
    // Plain text is spoilt in more ways than what is compressed.
    let toml = fs::read_to_string(directory.path().join("run.toml")).unwrap();
    for name in ["imu", "table"] {
        let packed = fs::File::open(directory.path().join(format!("{name}.csv.gz"))).unwrap();
        let mut text = String::new();
        std::io::Read::read_to_string(&mut flate2::read::GzDecoder::new(packed), &mut text)
            .unwrap();
        fs::write(directory.path().join(format!("{name}.csv")), text).unwrap();
    }
    let toml = toml.replace(".csv.gz", ".csv") + "\n[segments]\nfile = \"segments.csv\"\n";
    fs::write(directory.path().join("run.toml"), toml).unwrap();
    let labels = "start,end,label\n0.2,2.8,z_up\n3.0,4.0,rot_x+90\n";
    fs::write(directory.path().join("segments.csv"), labels).unwrap();
    directory
}

/// Reads a run and does what needs no filter.
fn read_run(directory: &Path) -> Result<(), String> {
    let mut run =
        turncal_files::read_run(&directory.join("run.toml")).map_err(|error| error.to_string())?;
    let _ = run.dwells(run.aiding());
    let _ = Stretch::find(&run, None);
    for without_table in [false, true] {
        if without_table {
            run.recording.table = None;
        }
        let problem = Problem::new(&run, &Options::default());
        if let Ok(closed_form) = six_position(&problem) {
            let _ = closed_form.quality(&problem);
        }
    }
    Ok(())
}

#[test]
fn spoilt_runs() {
    let run = small_run();
    let kept = FILES.map(|file| fuzz(&run, file, read_run));
    assert!(kept.iter().sum::<u32>() > 0);
}

#[test]
fn runs_that_make_no_sense_are_looked_at_all_the_same() {
    let run = small_run();
    let kept = FILES.map(|file| {
        fuzz(&run, file, |directory| {
            let run = turncal_files::read_run(&directory.join("run.toml"))
                .map_err(|error| error.to_string())?;
            let survey = Survey::of(&run);
            let document = check::document(&run, &survey);
            let _ = turncal_report::terminal::text(&document, Some(80));
            let _ = turncal_report::json(&document);
            Ok(())
        })
    });
    assert!(kept.iter().sum::<u32>() > 0);
}

#[test]
fn spoilt_logs_of_which_nothing_is_known() {
    let run = small_run();
    let kept = fuzz(&run, "imu.csv", |directory| {
        let draft =
            Draft::of_file(&directory.join("imu.csv")).map_err(|error| error.to_string())?;
        let text = draft.to_toml("imu.csv");
        assert!(text.parse::<toml::Table>().is_ok(), "{text}");
        Ok(())
    });
    assert!(kept > 0);
}

#[test]
fn spoilt_compressed_files() {
    let run = small_run();
    let toml = run.path().join("run.toml");
    let text = fs::read_to_string(&toml).unwrap();
    fs::write(&toml, text.replace("imu.csv", "imu.csv.gz")).unwrap();
    fuzz(&run, "imu.csv.gz", read_run);
}

#[test]
fn runs_whose_figures_make_no_sense_are_calibrated_or_refused() {
    let run = small_run();
    let toml = run.path().join("run.toml");
    let text = fs::read_to_string(&toml).unwrap();
    let terms = "[imu.terms]\naccel-second-order = { sigma = 50.0 }\n[standstill]";
    fs::write(&toml, text.replace("[standstill]", terms)).unwrap();
    fuzz(&run, "run.toml", |directory| {
        let Ok(mut run) = turncal_files::read_run(&directory.join("run.toml")) else {
            return Ok(());
        };
        for without_table in [false, true] {
            if without_table {
                run.recording.table = None;
            }
            let problem = Problem::new(&run, &Options::default());
            if let Ok(outcome) = estimate(&problem, UNWATCHED) {
                let _ = outcome.quality(&problem);
            }
        }
        Ok(())
    });
}

#[test]
fn spoilt_models() {
    let directory = tempfile::tempdir().unwrap();
    let copy = |from: &str, to: &str| {
        let from = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
            .join("models")
            .join(from);
        fs::copy(from, directory.path().join(to)).unwrap();
    };
    copy("imu/tactical-fog.toml", "imu.toml");
    copy("installation/general.toml", "installation.toml");
    copy("turntable/three-axis-with-errors.toml", "table.toml");
    copy("path/three-axis.toml", "path.toml");
    copy("trajectory/flight.toml", "trajectory.toml");
    let scenario = "seed = 1\n[site]\nlatitude_deg = 34.0\nheight_m = 10.0\n[imu]\nmodel = \"imu.toml\"\n\
                    installation = \"installation.toml\"\noutput = \"pulse\"\nsample_rate_hz = 100.0\n\
                    lever_arm_m = [0.05, -0.02, 0.03]\n[turntable]\nmodel = \"table.toml\"\n\
                    path = \"path.toml\"\n";
    fs::write(directory.path().join("scenario.toml"), scenario).unwrap();
    let load = |directory: &Path| {
        let scenario = directory.join("scenario.toml");
        let scenario = Scenario::load(scenario.to_str().unwrap()).map_err(|e| e.to_string())?;
        let _ = scenario.duration();
        Ok(())
    };
    let files = [
        "scenario.toml",
        "imu.toml",
        "installation.toml",
        "table.toml",
        "path.toml",
    ];
    let kept = files.map(|file| fuzz(&directory, file, load));
    assert!(kept.iter().sum::<u32>() > 0);
    let kept = fuzz(&directory, "trajectory.toml", |directory| {
        let trajectory = directory.join("trajectory.toml");
        let place = models::Place::CommandLine;
        models::trajectory(trajectory.to_str().unwrap(), &place).map_err(|e| e.to_string())?;
        Ok(())
    });
    assert!(kept > 0);
}

#[test]
fn spoilt_calibrations() {
    let run = small_run();
    let read = turncal_files::read_run(&run.path().join("run.toml")).unwrap();
    let problem = Problem::new(&read, &Options::default());
    let outcome = estimate(&problem, UNWATCHED).unwrap();
    let record = outcome.record(&problem, &outcome.quality(&problem).unwrap());
    let path = run.path().join("calibration.json");
    turncal_files::write_calibration(&record, &path, false).unwrap();
    let kept = fuzz(&run, "calibration.json", |directory| {
        let path = directory.join("calibration.json");
        let record = turncal_files::read_calibration(&path).map_err(|error| error.to_string())?;
        if let Ok(correction) = Correction::for_run(&record, &read) {
            let _ = correction
                .samples(&read, 0..read.recording.imu.len())
                .last();
        }
        Ok(())
    });
    assert!(kept > 0);
}

proptest! {
    #[test]
    fn units_of_noise_are_converted_or_refused(
        value in any::<f64>(),
        unit in "[a-z°µ/()^*√ 0-9-]{0,12}",
        rate in any::<Option<f64>>(),
    ) {
        let _ = convert(value, &unit, rate);
    }
}
