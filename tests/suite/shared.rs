//! Runs made by other programs and by real sensors, where they are there.

use std::io::Write;
use std::path::{Path, PathBuf};

use turncal::run::Run;

/// The shared runs, if they are there. Continuous integration must have them.
pub fn shared(run: &str) -> Option<PathBuf> {
    let data = std::env::var_os("TURNCAL_DATA").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("../shared/data"),
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
    skipped(&format!("no {}", directory.display()));
    None
}

/// Says that a test is not made, or not all of it. What goes to standard error by hand is shown of tests that
/// pass, too.
pub fn skipped(why: &str) {
    let thread = std::thread::current();
    let test = thread.name().unwrap_or_default();
    let _ = writeln!(std::io::stderr(), "SKIPPED {test}: {why}");
}

pub fn read(directory: &Path) -> Run {
    turncal_files::read_run(&directory.join("run.toml")).unwrap_or_else(|error| panic!("{error}"))
}
