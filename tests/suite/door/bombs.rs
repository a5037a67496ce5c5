//! What a small file may make its reader hold: nothing beyond its limits.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use flate2::Compression;
use flate2::write::GzEncoder;

use super::made::made_run;
use turncal::imu::Output as Rows;
use turncal_files::write_run;

/// So much address space is enough for a command on one thread, and for no bomb, KiB.
const ROOM: u32 = 200 * 1024;

/// A directory with a run whose log is this file, still to be written.
fn run_with_log(directory: &Path, log: &str) -> PathBuf {
    let place = directory.join("made");
    fs::create_dir(&place).unwrap();
    write_run(&place, &made_run("made"), Rows::Increment, None).unwrap();
    let text = fs::read_to_string(place.join("run.toml")).unwrap();
    fs::write(place.join("run.toml"), text.replace("imu.csv.gz", log)).unwrap();
    place
}

/// One megabyte that is one gigabyte of the same.
fn bomb(path: &Path, begin: &str, same: &[u8]) {
    let mut file = GzEncoder::new(File::create(path).unwrap(), Compression::fast());
    file.write_all(begin.as_bytes()).unwrap();
    for _ in 0..(1 << 30) / same.len() {
        file.write_all(same).unwrap();
    }
    file.finish().unwrap();
}

fn in_little_room(here: &Path, arguments: &str) -> Output {
    within(ROOM, here, arguments)
}

fn within(room: u32, here: &Path, arguments: &str) -> Output {
    let program = env!("CARGO_BIN_EXE_turncal");
    let command = format!("ulimit -v {room}; RAYON_NUM_THREADS=1 exec {program} {arguments}");
    let mut shell = Command::new("sh");
    shell.args(["-c", &command]).current_dir(here);
    shell.output().unwrap()
}

fn refused(here: &Path, arguments: &str, words: &[&str]) {
    let output = in_little_room(here, arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{arguments}: {message}");
    assert!(message.len() < 600, "{} bytes: {message}", message.len());
    for word in words {
        assert!(message.contains(word), "{arguments}: {message}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_gigabyte_in_a_megabyte_is_refused_in_little_memory() {
    let directory = tempfile::tempdir().unwrap();
    let here = &run_with_log(directory.path(), "imu.csv.gz");
    let names = "t,gx,gy,gz,ax,ay,az\n";
    let digits = b"0123456789".repeat(100_000);
    let zeros = vec![0; 1_000_000];
    for (begin, same, line) in [
        ("", &zeros, "line 1:"),
        ("", &digits, "line 1:"),
        (names, &digits, "line 2:"),
        (names, &vec![b'\n'; 1_000_000], "line 2:"),
        (names, &b"# \n".repeat(100_000), "line 2:"),
    ] {
        bomb(&here.join("imu.csv.gz"), begin, same);
        for command in ["init imu.csv.gz", "check run.toml"] {
            refused(here, command, &[line, "imu.csv.gz", "1024 KiB"]);
        }
    }
    for command in ["allan", "calibrate"] {
        refused(
            here,
            &format!("{command} run.toml"),
            &["line 2:", "1024 KiB"],
        );
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_gigabyte_of_rows_at_one_time_is_refused_and_drafted_from_its_first() {
    let directory = tempfile::tempdir().unwrap();
    let here = &run_with_log(directory.path(), "imu.csv.gz");
    let names = "t,gx,gy,gz,ax,ay,az\n";
    bomb(
        &here.join("imu.csv.gz"),
        names,
        &b"0,0,0,0,0,0,0\n".repeat(100_000),
    );
    refused(here, "check run.toml", &["line 65539:", "same time"]);
    // Columns that grow ask for twice what they hold.
    let drafted = within(2 * ROOM, here, "init imu.csv.gz -o draft.toml");
    let message = String::from_utf8_lossy(&drafted.stderr).into_owned();
    assert!(drafted.status.success(), "{message}");
    let draft = fs::read_to_string(here.join("draft.toml")).unwrap();
    assert!(draft.contains("the first 898779 rows"), "{draft}");
}

#[test]
#[cfg(target_os = "linux")]
fn ten_million_columns_are_refused_in_a_short_message() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("imu.csv"), "1,".repeat(10_000_000)).unwrap();
    refused(here, "init imu.csv", &["line 1:", "1024 KiB"]);
    fs::write(here.join("imu.csv"), "a,".repeat(500_000) + "\n").unwrap();
    refused(here, "init imu.csv", &["line 1:", "columns", "16384"]);
    fs::write(here.join("imu.csv"), "a".repeat(500_000) + ",b\n1,2\n").unwrap();
    refused(here, "init imu.csv", &["line 1:", "a field longer"]);
}

#[test]
#[cfg(target_os = "linux")]
fn what_is_no_regular_file_is_no_log_and_no_description() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    std::os::unix::fs::symlink("/dev/zero", here.join("zero.csv")).unwrap();
    fs::create_dir(here.join("place.csv")).unwrap();
    let made = Command::new("mkfifo").arg(here.join("pipe.csv")).status();
    assert!(made.unwrap().success());
    refused(here, "init zero.csv", &["a device or pipe", "regular file"]);
    refused(here, "init pipe.csv", &["a device or pipe", "regular file"]);
    refused(here, "init place.csv", &["a directory", "regular file"]);
    refused(here, "check /dev/zero", &["/dev/zero", "a device or pipe"]);
    refused(
        here,
        "export /dev/zero --format kalibr",
        &["longer than 16 MiB"],
    );
}

#[test]
fn a_message_shows_little_of_a_long_name() {
    let directory = tempfile::tempdir().unwrap();
    let here = &run_with_log(directory.path(), "imu.csv");
    let long = "x".repeat(60_000);
    fs::write(
        here.join("imu.csv"),
        format!("{long},b\n{}", "1,2\n".repeat(200)),
    )
    .unwrap();
    refused(
        here,
        "check run.toml",
        &["imu.csv, line 1", "found no column"],
    );
    let text = fs::read_to_string(here.join("run.toml")).unwrap();
    fs::write(here.join("run.toml"), text + &format!("\n[{long}]\n")).unwrap();
    refused(here, "check run.toml", &["run.toml, line", "unknown field"]);
}

#[test]
fn names_are_shown_with_their_escapes_escaped() {
    let directory = tempfile::tempdir().unwrap();
    let here = &run_with_log(directory.path(), "imu.csv");
    fs::write(
        here.join("imu.csv"),
        "\u{1b}[31mred,\u{1b}]0;title\u{7}\n1,2\n",
    )
    .unwrap();
    let output = in_little_room(here, "check run.toml");
    let shown = [output.stdout, output.stderr].concat();
    assert!(!shown.contains(&0x1b) && !shown.contains(&7));
    assert!(String::from_utf8(shown).unwrap().contains("\\u{1b}[31mred"));
}

#[test]
#[cfg(target_os = "linux")]
fn every_description_has_at_most_sixteen_mebibytes() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    for name in ["big.toml", "big.json"] {
        let file = File::create(here.join(name)).unwrap();
        file.set_len(1 << 30).unwrap();
    }
    for arguments in [
        "check big.toml",
        "calibrate big.toml",
        "simulate big.toml -o run",
        "path evaluate big.toml",
        "export big.json --format kalibr",
        "compare big.json big.json",
        "certificate big.json --laboratory big.toml",
    ] {
        refused(here, arguments, &["longer than 16 MiB"]);
    }
}
