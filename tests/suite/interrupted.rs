//! Commands that are ended from outside.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// With the numbers that every system gives them.
const SIGNALS: [(&str, i32); 3] = [("INT", 2), ("TERM", 15), ("HUP", 1)];

fn names(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// What is being written in a directory.
fn stages(directory: &Path) -> BTreeSet<PathBuf> {
    let entries = fs::read_dir(directory).into_iter().flatten().flatten();
    let is_stage = |path: &PathBuf| {
        let name = path.file_name().unwrap().as_encoded_bytes();
        name.starts_with(b".turncal-") && path.join("new").exists()
    };
    entries.map(|entry| entry.path()).filter(is_stage).collect()
}

/// A command that is writing, for a second or more, below `directory`.
fn begun(program: &[&str], directory: &Path, output: &str) -> Child {
    let target = directory.join(output);
    let before = stages(target.parent().unwrap());
    let turncal = [env!("CARGO_BIN_EXE_turncal"), "demo", "-o", output];
    let all = [program, &turncal].concat();
    let child = Command::new(all[0])
        .args(&all[1..])
        .current_dir(directory)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let patience = Instant::now() + Duration::from_secs(60);
    while stages(target.parent().unwrap()).is_subset(&before) {
        assert!(
            Instant::now() < patience,
            "{} is not begun",
            target.display()
        );
        sleep(Duration::from_millis(2));
    }
    child
}

fn send(signal: &str, child: &Child) {
    let sent = Command::new("kill")
        .args(["-s", signal, &child.id().to_string()])
        .status()
        .unwrap();
    assert!(sent.success());
}

/// Whether this process, and so its children, were begun with a signal ignored.
fn is_ignored(number: i32) -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.map_or(0, |mask| u64::from_str_radix(mask.trim(), 16).unwrap());
    mask >> (number - 1) & 1 == 1
}

#[test]
fn a_signal_ends_a_command_by_that_signal_and_leaves_nothing() {
    for (signal, number) in SIGNALS {
        // The first while it simulates, the others while it calibrates or writes.
        for (tenths, output) in [(0, "out"), (3, "below/two/out"), (9, "out")] {
            let directory = tempfile::tempdir().unwrap();
            let mut child = begun(&[], directory.path(), output);
            sleep(Duration::from_millis(100 * tenths));
            send(signal, &child);
            let status = child.wait().unwrap();
            let left = names(directory.path());
            if is_ignored(number) || status.success() {
                // Done before the signal came, or not to be ended by it.
                assert!(status.success() && !left.iter().any(|name| name.starts_with('.')));
            } else {
                assert_eq!(status.signal(), Some(number), "{status}");
                assert!(left.is_empty(), "{signal}: {left:?}");
            }
        }
    }
}

#[test]
#[cfg(target_os = "linux")]
#[ignore = "slow: a whole demonstration"]
fn a_command_under_nohup_goes_on_without_its_terminal() {
    let directory = tempfile::tempdir().unwrap();
    let mut child = begun(&["nohup"], directory.path(), "out");
    send("HUP", &child);
    assert!(child.wait().unwrap().success());
    assert_eq!(names(directory.path()), ["out"]);
}

#[test]
#[ignore = "slow: a whole demonstration"]
fn what_a_killed_command_left_goes_with_the_next_and_what_another_is_writing_stays() {
    let directory = tempfile::tempdir().unwrap();
    let mut killed = begun(&[], directory.path(), "killed");
    killed.kill().unwrap();
    killed.wait().unwrap();
    let left = names(directory.path());
    assert!(
        left.len() == 1 && left[0].starts_with(".turncal-"),
        "{left:?}"
    );

    let mut living = begun(&[], directory.path(), "living");
    assert!(!names(directory.path()).contains(&left[0]));
    let next = Command::new(env!("CARGO_BIN_EXE_turncal"))
        .args(["man", "-o"])
        .arg(directory.path())
        .output()
        .unwrap();
    assert!(next.status.success(), "{next:?}");
    assert!(living.wait().unwrap().success());
    let left = names(directory.path());
    assert!(left.contains(&"living".into()) && left.contains(&"turncal.1".into()));
    assert!(!left.iter().any(|name| name.starts_with('.')), "{left:?}");
}
