//! A system that lets no threads be started.

use std::path::Path;
use std::process::Output;

use assert_cmd::Command;

/// No system has the memory for a thread's stack of this many bytes: starting one fails as it does when a
/// user may have no more processes.
const TOO_LARGE: &str = "70368744177664";

fn turncal(stack: Option<&str>, arguments: &[&str], here: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    command.current_dir(here).args(arguments);
    if let Some(stack) = stack {
        command.env("RUST_MIN_STACK", stack);
    }
    let output = command.output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{message}");
    assert_eq!(stack.is_some(), message.contains("threads"), "{message}");
    output
}

#[test]
#[ignore = "slow: the same job with and without threads"]
fn without_further_threads_the_same_is_done_on_one() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    turncal(Some(TOO_LARGE), &["simulate", "demo", "-o", "run"], here);
    let calibrate = ["calibrate", "run/run.toml", "--json"];
    let alone = turncal(Some(TOO_LARGE), &calibrate, here);
    let together = turncal(None, &calibrate, here);
    assert!(alone.stdout == together.stdout);
    turncal(Some(TOO_LARGE), &["study", "accuracy", "--runs", "2"], here);
}
