//! A made-up calibration and its file; files as `calibrate` writes them.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};
use turncal::calibration::Word;
use turncal::calibration::result::Calibration;
use turncal::calibration::result::TriadRecord;
use turncal::imu::PerSensor;

pub const ALIGNED: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Aligned axes, equal scale factors, biases; no σ.
pub fn record() -> Calibration {
    let triad = |scale| TriadRecord {
        scale: [scale; 3],
        installation: ALIGNED,
        bias: [1.0, 2.0, 3.0],
    };
    Calibration {
        unit: Some(PerSensor::from_fn(|_| "count".to_owned())),
        ..Calibration::new(triad(2e6), triad(1e5))
    }
}

pub fn written(directory: &Path, name: &str, record: &Calibration) -> PathBuf {
    let path = directory.join(name);
    turncal_files::write_calibration(record, &path, false).unwrap();
    path
}

fn turncal(directory: &Path, arguments: &str) -> (i32, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    let command = command.current_dir(directory).args(arguments.split(' '));
    let output = command.output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code().expect("it was not killed"), message)
}

/// The demo with its table log three seconds late: all moves are lost to the filter.
fn late(demo: &Path, directory: &Path) {
    std::fs::create_dir(directory).unwrap();
    for name in ["run.toml", "imu.csv.gz"] {
        std::fs::copy(demo.join(name), directory.join(name)).unwrap();
    }
    let packed = std::fs::File::open(demo.join("table.csv.gz")).unwrap();
    let text = std::io::read_to_string(flate2::read::GzDecoder::new(packed)).unwrap();
    let mut rows = text.lines();
    let heading = rows.next().unwrap();
    let rows = rows.map(|row| {
        let (time, rest) = row.split_once(',').unwrap();
        format!("{},{rest}\n", time.parse::<f64>().unwrap() + 3.0)
    });
    let text = format!("{heading}\n{}", rows.collect::<String>());
    let file = std::fs::File::create(directory.join("table.csv.gz")).unwrap();
    let mut packer = flate2::write::GzEncoder::new(file, flate2::Compression::fast());
    packer.write_all(text.as_bytes()).unwrap();
    packer.finish().unwrap();
}

/// The demo with its noise stated a thousand times too small: nothing explains the residuals.
fn too_quiet(demo: &Path, directory: &Path) {
    std::fs::create_dir(directory).unwrap();
    for name in ["imu.csv.gz", "table.csv.gz"] {
        std::fs::copy(demo.join(name), directory.join(name)).unwrap();
    }
    let text = std::fs::read_to_string(demo.join("run.toml")).unwrap();
    let line = |line: &str| match line.split_once(" = ") {
        Some((key, value)) if key.contains("random_walk") || key.contains("sigma_arcsec") => {
            let value: f64 = value.split('#').next().unwrap().trim().parse().unwrap();
            format!("{key} = {:?}\n", 1e-3 * value)
        }
        _ => format!("{line}\n"),
    };
    let text: String = text.lines().map(line).collect();
    std::fs::write(directory.join("run.toml"), text).unwrap();
}

#[test]
fn what_calibrate_writes_can_be_read_whatever_the_result() {
    let root = tempfile::tempdir().unwrap();
    let here = root.path();
    for scenario in ["demo", "single-axis", "warming"] {
        let (status, message) = turncal(
            here,
            &format!("simulate {scenario} --seed 31 -o {scenario}"),
        );
        assert_eq!(status, 0, "{message}");
        turncal_files::read_calibration(&here.join(scenario).join("truth.json")).unwrap();
    }
    late(&here.join("demo"), &here.join("late"));
    too_quiet(&here.join("demo"), &here.join("quiet"));
    let mut words = Vec::new();
    for (run, options) in [
        ("demo", ""),
        ("demo", " --method six-position"),
        ("demo", " --installation three-angle"),
        ("demo", " --installation six-angle"),
        ("demo", " --aiding velocity"),
        ("demo", " --with g-sensitivity"),
        ("late", ""),
        ("quiet", " --noise stated"),
        ("single-axis", ""),
        ("warming", " --temperature"),
    ] {
        let command = format!("calibrate {run}/run.toml{options} -o result --force");
        let (status, message) = turncal(here, &command);
        let path = here.join("result/calibration.json");
        let record = turncal_files::read_calibration(&path).unwrap_or_else(|error| {
            panic!("{command}: {status}, {message}: {error}");
        });
        let word = record.word().unwrap();
        assert_eq!(status, i32::from(record.is_failed()), "{command}: {word}");
        words.push(word);
        std::fs::remove_dir_all(here.join("result")).unwrap();
    }
    for word in [Word::Good, Word::UseWithCare, Word::Failed] {
        assert!(words.contains(&word), "no {word} in {words:?}");
    }
}

/// Each pair of fields that follow from each other, one of them changed.
#[test]
fn a_file_that_contradicts_itself_is_read_by_no_command_and_both_fields_are_named() {
    let root = tempfile::tempdir().unwrap();
    let here = root.path();
    let (status, message) = turncal(here, "demo -o demo");
    assert_eq!(status, 0, "{message}");
    let text = std::fs::read_to_string(here.join("demo/ekf/calibration.json")).unwrap();
    let whole: Value = serde_json::from_str(&text).unwrap();
    let found = |pointer: &str, value: Value| {
        let mut changed = whole.clone();
        *changed
            .pointer_mut(pointer)
            .unwrap_or_else(|| panic!("no {pointer}")) = value;
        std::fs::write(here.join("changed.json"), changed.to_string()).unwrap();
        let (status, message) = turncal(here, "export changed.json --format text -o out.txt");
        assert_eq!(status, 1, "{pointer}: {message}");
        message
    };
    for (pointer, value, says) in [
        (
            "/sigma/gyro/scale/1",
            json!(1e-9),
            ["sigma of gyro.scale.y", "covariance"],
        ),
        (
            "/budget/sources/0/u/3",
            json!(1e3),
            ["budget.sources", "covariance"],
        ),
        (
            "/budget/coverage_factor/0",
            json!(1.5),
            ["coverage_factor", "degrees_of_freedom"],
        ),
        (
            "/budget/degrees_of_freedom/0",
            json!(1.5),
            ["degrees_of_freedom", "budget.sources"],
        ),
        (
            "/verdict/word",
            json!("failed"),
            ["verdict.word", "findings"],
        ),
        (
            "/consistency/nis",
            json!(7.5),
            ["consistency.nis", "velocity"],
        ),
        (
            "/unit/accel",
            json!("rad/s"),
            ["unit.accel", "specific force"],
        ),
        (
            "/correction/accel/0/1",
            json!(1e-3),
            ["correction.accel", "scale"],
        ),
        (
            "/test_vectors/1/raw/4",
            json!(12.0),
            ["test_vectors[1]", "bias"],
        ),
    ] {
        let message = found(pointer, value);
        let missing = says.iter().find(|part| !message.contains(**part));
        assert_eq!(missing, None, "{pointer}: {message}");
    }
    let kinds = whole["consistency"].as_object().unwrap();
    let mut all = kinds.clone();
    for (name, of) in &mut all {
        match (name.as_str(), of) {
            ("nis", nis) => *nis = json!(9.0),
            (_, Value::Object(of)) => drop(of.insert("nis".to_owned(), json!(9.0))),
            _ => (),
        }
    }
    let message = found("/consistency", all.into());
    assert!(
        message.contains("without a finding about this"),
        "{message}"
    );
}
