//! Real and made runs come in through the door as they are, and nothing wrong does.

use std::path::PathBuf;

use turncal::run::{CalibrationRecord, Run};

/// The shared runs, if they are there. Continuous integration must have them.
fn shared(run: &str) -> Option<PathBuf> {
    let data = std::env::var_os("TURNCAL_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let directory = data.join(run);
    if directory.is_dir() {
        return Some(directory);
    }
    assert!(
        std::env::var_os("CI").is_none_or(|ci| ci != "true"),
        "no {}; set TURNCAL_DATA",
        directory.display()
    );
    println!("skipped: no {}", directory.display());
    None
}

#[test]
fn every_shared_run_and_truth_reads() {
    for (name, samples, table, segments) in [
        ("three-axis-counts", 59_500, true, 0),
        ("nineteen-position-clean", 98_200, true, 0),
        ("nineteen-position-velocity", 98_200, false, 0),
        ("nineteen-position-full", 98_200, false, 0),
        ("real-mems-raw-sections", 9_414, false, 9),
        ("real-mems-six-position", 10_376, false, 9),
        ("real-mems-static", 44_930, false, 1),
    ] {
        let Some(directory) = shared(name) else {
            continue;
        };
        let began = std::time::Instant::now();
        let run = Run::read(&directory.join("run.toml")).unwrap_or_else(|error| panic!("{error}"));
        println!("{name} {:?}", began.elapsed());
        assert_eq!(run.name, name);
        assert_eq!(run.imu.len(), samples, "{name}");
        assert_eq!(run.table.is_some(), table, "{name}");
        assert_eq!(run.segments.len(), segments, "{name}");
        let truth = directory.join("truth.json");
        if truth.exists() {
            let truth = CalibrationRecord::read(&truth).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(truth.unit, Some(run.unit), "{name}");
        }
    }
}
