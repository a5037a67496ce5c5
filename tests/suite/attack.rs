//! What an attack on the command line found: each case ends as it should, with the message that helps.

use std::io::Write;
use std::path::Path;
use std::time::Instant;

use assert_cmd::Command;
use serde_json::Value;
use turncal::calibration::Calibration;

use crate::shared::shared;

/// Exit status, standard output and standard error of a command on a copy of a case, unpacked.
fn outcome(case: &str, arguments: &str) -> Option<(i32, String, String, tempfile::TempDir)> {
    let from = shared(&format!("attack/{case}"))?;
    let copy = tempfile::tempdir().unwrap();
    copied(&from, copy.path());
    let (status, output, message) = turncal(copy.path(), arguments);
    Some((status, output, message, copy))
}

fn turncal(directory: &Path, arguments: &str) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    let command = command.current_dir(directory).args(arguments.split(' '));
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let status = output.status.code().expect("it was not killed");
    (status, text(&output.stdout), text(&output.stderr))
}

fn copied(from: &Path, to: &Path) {
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let name = to.join(entry.file_name());
        if entry.path().is_dir() {
            std::fs::create_dir(&name).unwrap();
            copied(&entry.path(), &name);
        } else {
            std::fs::copy(entry.path(), &name).unwrap();
        }
        // Some cases name plain files.
        if name.extension().is_some_and(|end| end == "gz") {
            let packed = std::fs::File::open(&name).unwrap();
            let mut plain = std::fs::File::create(name.with_extension("")).unwrap();
            std::io::copy(&mut flate2::read::GzDecoder::new(packed), &mut plain).unwrap();
        }
    }
}

fn refused(case: &str, arguments: &str, says: &str) {
    let Some((status, _, message, _)) = outcome(case, arguments) else {
        return;
    };
    assert_eq!(status, 1, "{case}: {message}");
    assert!(message.contains(says), "{case}: no `{says}` in\n{message}");
}

/// Kinds of the findings of a calibration.
fn kinds(case: &str) -> Option<Vec<String>> {
    let (status, output, message, _) = outcome(case, "calibrate run.toml --json")?;
    assert_eq!(status, 0, "{case}: {message}");
    let result: Value = serde_json::from_str(&output).unwrap();
    let findings = result["findings"].as_array().unwrap().iter();
    Some(
        findings
            .map(|of| of["kind"].as_str().unwrap().to_owned())
            .collect(),
    )
}

#[test]
fn a_unit_that_was_edited_after_its_part_was_written_is_not_merged() {
    refused(
        "lot-part-edited",
        "merge l1 l2d -o out",
        "that does not belong to it",
    );
}

/// The case claims 10^15 runs; the others are parts that repeat without end and a whole lot of that many units.
#[test]
#[cfg(target_os = "linux")]
fn a_part_that_claims_more_runs_than_it_holds_is_refused_in_little_memory() {
    let Some(directory) = shared("attack/merge-runs-1e15") else {
        return;
    };
    let job = std::fs::read_to_string(directory.join("job.json")).unwrap();
    let shard = |index: u32, of: u64| format!("\"index\": {index},\n    \"of\": {of}");
    let unending = job.replace(&shard(2, 2), &shard(2, 0));
    let none = job.replace(&shard(2, 2), &shard(0, 2));
    let whole = job
        .replace("\"shard\"", "\"unknown\"")
        .replace("study-accuracy", "lot");
    for text in [&job, &unending, &none, &whole] {
        let part = tempfile::tempdir().unwrap();
        std::fs::write(part.path().join("job.json"), text).unwrap();
        let results = part.path().join("runs.msgpack");
        std::fs::copy(directory.join("runs.msgpack"), results).unwrap();
        let program = env!("CARGO_BIN_EXE_turncal");
        let command = format!("ulimit -v 512000; exec {program} merge . -o out");
        let mut shell = std::process::Command::new("sh");
        let output = shell.args(["-c", &command]).current_dir(&part).output();
        let output = output.unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(message.contains("run list does not match"), "{message}");
    }
}

#[test]
fn a_matrix_of_zeros_is_certified_for_nobody() {
    let certificate = "certificate calibration.json --laboratory lab.toml -o c";
    refused("certificate-singular", certificate, "has no inverse");
    if let Some((status, _, message, _)) = outcome("certificate-long-word", certificate) {
        assert_eq!(status, 0, "{message}");
    }
}

/// Each move once had an evaluation of its own: 100 words took 69 s.
#[test]
fn a_path_of_many_moves_takes_as_long_as_its_recording() {
    let time = |moves: usize| {
        let words = vec!["z_up,x_up"; moves / 2].join(",");
        let begun = Instant::now();
        let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
        let arguments = ["path", "evaluate", &words, "--imu", "bmi088", "--json"];
        let output = command.args(arguments).output().unwrap();
        assert!(output.status.success());
        let result: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(result["without"].as_array().unwrap().len(), moves - 1);
        begun.elapsed()
    };
    let (few, many) = (time(40), time(200));
    println!("40 words {few:?}, 200 words {many:?}");
    assert!(many < 12 * few, "{few:?} {many:?}");
}

#[test]
fn rows_out_are_rows_in_and_a_hole_that_nothing_bridges_is_not_filled() {
    let Some((status, _, message, copy)) =
        outcome("apply-silent-gap", "apply h.json h/run.toml -o d.csv")
    else {
        return;
    };
    assert_eq!(status, 0, "{message}");
    let rows = |name: &str| {
        std::fs::read_to_string(copy.path().join(name))
            .unwrap()
            .lines()
            .count()
    };
    assert_eq!(rows("d.csv"), rows("h/imu.csv"));
    assert!(message.contains("4096"), "{message}");
    let fill = "apply h.json h/run.toml -o d.csv --fill";
    refused(
        "apply-silent-gap",
        fill,
        "4096 rows are missing from 48.809 s on",
    );
}

#[test]
fn rows_that_were_lost_in_a_turn_are_left_out_and_too_many_to_fill() {
    let Some((from, table)) = shared("attack/apply-silent-gap").zip(shared("three-axis-counts"))
    else {
        return;
    };
    let copy = tempfile::tempdir().unwrap();
    copied(&from, copy.path());
    let run = copy.path().join("g/run.toml");
    let text = std::fs::read_to_string(&run).unwrap();
    let table = table.to_string_lossy();
    std::fs::write(&run, text.replace("../../../three-axis-counts", &table)).unwrap();
    let (status, _, message) = turncal(copy.path(), "apply calibration.json g/run.toml -o d.csv");
    assert!(
        status == 0 && message.contains("300 rows missing in the log"),
        "{message}"
    );
    let rows = |name: &str| {
        std::fs::read_to_string(copy.path().join(name))
            .unwrap()
            .lines()
            .count()
    };
    assert_eq!(rows("d.csv"), rows("g/imu.csv"));
    let (status, _, message) = turncal(
        copy.path(),
        "apply calibration.json g/run.toml -o e.csv --fill",
    );
    assert!(
        status == 1 && message.contains("from 60.670 s on, which is too many to interpolate"),
        "{message}"
    );
}

#[test]
fn whole_numbers_beyond_two_to_the_53_keep_their_digits_and_text_that_is_left_out_is_named() {
    let Some((status, _, message, copy)) = outcome("int64-digits", "convert k.npy -o c") else {
        return;
    };
    assert_eq!(status, 0, "{message}");
    let packed = std::fs::File::open(copy.path().join("c/imu.csv.gz")).unwrap();
    let text = std::io::read_to_string(flate2::read::GzDecoder::new(packed)).unwrap();
    let second = text.lines().nth(2).unwrap();
    assert!(second.starts_with("1152921504616846977,"), "{second}");
    let run = std::fs::read_to_string(copy.path().join("c/run.toml")).unwrap();
    assert!(
        run.contains("`name` contains text and was ignored"),
        "{run}"
    );
}

#[test]
fn a_time_in_another_unit_and_rows_that_are_left_out_are_told_by_gravity() {
    let closed_form = "calibrate run.toml --method six-position --json";
    for case in ["time_both_ms_noperiod", "every_second_row_noperiod"] {
        let says = "or time_unit";
        refused(&format!("wrong-input-{case}"), closed_form, says);
    }
}

fn calibration(directory: &Path, run: &str) -> Calibration {
    let (status, output, message) = turncal(directory, &format!("calibrate {run} --json"));
    assert_eq!(status, 0, "{run}: {message}");
    serde_json::from_str(&output).unwrap()
}

/// A record that [`shared`] has, under a directory of its own.
fn record(name: &str) -> Option<tempfile::TempDir> {
    let from = shared(name)?;
    let copy = tempfile::tempdir().unwrap();
    copied(&from, copy.path());
    Some(copy)
}

/// Rows with as little noise as that moved what gravity hardly shows until the start had no inverse.
#[test]
fn accelerometer_noise_stated_a_tenth_is_learnt() {
    let Some(directory) = record("real-mems-six-position") else {
        return;
    };
    let here = directory.path();
    let run = std::fs::read_to_string(here.join("run.toml")).unwrap();
    let stated = "velocity_random_walk_ug_per_sqrt_hz = 130.0";
    let tenth = run.replace(stated, "velocity_random_walk_ug_per_sqrt_hz = 13.0");
    assert_ne!(run, tenth);
    std::fs::write(here.join("tenth.toml"), tenth).unwrap();
    let (found, expected) = (
        calibration(here, "tenth.toml"),
        calibration(here, "run.toml"),
    );
    for name in &expected.parameters {
        let off = (found.get(name).unwrap() - expected.get(name).unwrap()).abs();
        assert!(off <= *expected.sigma_of(name).unwrap(), "{name}: {off}");
    }
}

#[test]
fn a_unit_a_scale_or_a_period_of_the_gyros_that_turns_contradict_is_named() {
    let Some(directory) = record("real-mems-six-position") else {
        return;
    };
    let here = directory.path();
    let run = std::fs::read_to_string(here.join("run.toml")).unwrap();
    let (unit, degrees) = ("gyro_unit = \"deg/s\"", "57.29577951308232");
    for (wrong, says) in [
        (
            run.replace(unit, "gyro_unit = \"rad/s\"")
                .replace(degrees, "1.0"),
            "gyro_unit = \"deg/s\"",
        ),
        (
            run.replace(unit, "gyro_unit = \"rad/s\""),
            "expected about 1",
        ),
        (run.replace(degrees, "68.75"), "prior.gyro.scale"),
        (run.replace(degrees, "45.8"), "prior.gyro.scale"),
    ] {
        std::fs::write(here.join("wrong.toml"), wrong).unwrap();
        let (status, _, message) = turncal(here, "calibrate wrong.toml --json");
        assert!(status == 1 && message.contains(says), "{says}: {message}");
    }
}

/// The attitude jumps at the seam, which is one event among the others.
#[test]
fn a_record_twice_in_one_file_takes_hardly_more_passes_than_once() {
    let Some(directory) = record("real-mems-lot-0") else {
        return;
    };
    let here = directory.path();
    let once = calibration(here, "run.toml");
    let log = std::fs::read_to_string(here.join("imu.log")).unwrap();
    std::fs::write(here.join("imu.log"), log.repeat(2)).unwrap();
    let twice = calibration(here, "run.toml");
    let (once, twice) = (once.passes.unwrap(), twice.passes.unwrap());
    assert!(twice <= 2 * once, "{once} {twice}");
}

#[test]
fn of_several_findings_the_cause_comes_first() {
    for (case, cause) in [
        ("lat_neg", "earth-rate-wrong"),
        ("north_1", "earth-rate-wrong"),
    ] {
        if let Some(kinds) = kinds(&format!("wrong-input-{case}")) {
            assert_eq!(kinds[0], cause, "{case}: {kinds:?}");
        }
    }
}

#[test]
#[cfg(target_os = "linux")]
fn an_archive_of_a_gigabyte_unpacked_is_drafted_in_half_of_it() {
    let Some(directory) = shared("attack/npz-abort") else {
        return;
    };
    let program = env!("CARGO_BIN_EXE_turncal");
    let command = format!("ulimit -v 512000; exec {program} init n.npz");
    let mut shell = std::process::Command::new("sh");
    let output = shell.args(["-c", &command]).current_dir(directory).output();
    let output = output.unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("20000000 samples"), "{text}");
}

/// A MAT file of two arrays of zeros with these rows and three columns each, compressed.
fn mat_of_zeros(rows: u32) -> Vec<u8> {
    let element = |kind: u32, content: &[u8]| {
        let mut bytes = [kind, content.len() as u32].map(u32::to_le_bytes).concat();
        bytes.extend(content);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    };
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(124, 0);
    file.extend([0, 1, b'I', b'M']);
    for name in ["gyro", "acc"] {
        let size = [rows, 3].map(u32::to_le_bytes).concat();
        let flags = [6, 0].map(u32::to_le_bytes).concat();
        let head = [
            element(6, &flags),
            element(5, &size),
            element(1, name.as_bytes()),
        ]
        .concat();
        let numbers = 24 * rows;
        let whole = head.len() as u32 + 8 + numbers;
        let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        packer
            .write_all(&[14, whole].map(u32::to_le_bytes).concat())
            .unwrap();
        packer.write_all(&head).unwrap();
        packer
            .write_all(&[9, numbers].map(u32::to_le_bytes).concat())
            .unwrap();
        for _ in 0..rows / 1000 {
            packer.write_all(&[0; 24_000]).unwrap();
        }
        let packed = packer.finish().unwrap();
        file.extend([15, packed.len() as u32].map(u32::to_le_bytes).concat());
        file.extend(packed);
    }
    file
}

#[test]
#[cfg(target_os = "linux")]
fn a_mat_file_is_read_in_parts_and_one_of_zeros_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    std::fs::write(here.join("m.mat"), mat_of_zeros(8_000_000)).unwrap();
    // 384 MB unpacked.
    let program = env!("CARGO_BIN_EXE_turncal");
    let command = format!("ulimit -v 512000; exec {program} init m.mat");
    let mut shell = std::process::Command::new("sh");
    let output = shell.args(["-c", &command]).current_dir(here).output();
    let output = output.unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("8000000 samples"), "{text}");
    let zeros = mat_of_zeros(0);
    let file = std::fs::File::create(here.join("s.mat")).unwrap();
    (&file).write_all(&zeros[..128]).unwrap();
    file.set_len(2 << 30).unwrap();
    let (status, _, message) = turncal(here, "init s.mat");
    assert!(
        status == 1 && message.contains("an element of type 0"),
        "{message}"
    );
}

#[test]
fn a_time_that_stands_still_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let row = |k: u32| {
        let part = f64::from(k).sin();
        format!("5.00,{part},0,0,0,{part},9.8\n")
    };
    let rows: String = (0..50_000).map(row).collect();
    std::fs::write(
        directory.path().join("d.csv"),
        format!("t,gx,gy,gz,ax,ay,az\n{rows}"),
    )
    .unwrap();
    let (status, _, message) = turncal(directory.path(), "calibrate d.csv --json");
    let found = "found 5 in all rows of the column `t`, expected times that increase";
    assert!(status == 1 && message.contains(found), "{message}");
}

#[test]
fn a_file_that_is_not_read_says_what_it_is_and_what_to_do() {
    let directory = tempfile::tempdir().unwrap();
    for (name, bytes, says) in [
        ("a.parquet", &b"PAR1\x15\x04"[..], "to_csv"),
        (
            "a.xls",
            b"\xd0\xcf\x11\xe0\xa1\xb1",
            "Save the sheet as CSV",
        ),
    ] {
        let file = directory.path().join(name);
        std::fs::write(&file, bytes).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
        let output = command.arg("init").arg(&file).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{name}");
        assert!(message.contains(says), "{name}: {message}");
    }
}

#[test]
fn a_calibration_that_contradicts_itself_gets_no_certificate() {
    for (name, says) in [
        ("correction-x2", "correction.gyro and gyro.scale"),
        ("cov-1e-4", "sigma of gyro.scale.x"),
        ("cov-zeros", "sigma of gyro.scale.x"),
        ("k-0.1", "budget.coverage_factor of gyro.scale.x = 0.1"),
        ("nis-1e6", "consistency.nis = 1000000"),
        ("unit-parsec", "unit.gyro = \"parsec\""),
        (
            "verdict-failed",
            "verdict.word = FAILED, expected GOOD, from findings",
        ),
    ] {
        let certificate = format!("certificate {name}.json --laboratory lab.toml -o c");
        refused("certificate-inconsistent", &certificate, says);
    }
}

/// The word is in every file that has a place for it, and on standard error.
#[test]
fn a_failed_calibration_goes_out_only_when_asked_for_and_with_its_word() {
    let Some((from, data)) = shared("attack/export-failed").zip(shared("three-axis-counts")) else {
        return;
    };
    let copy = tempfile::tempdir().unwrap();
    let here = copy.path();
    copied(&from, here);
    copied(&data, here);
    let read = |name: &str| {
        let bytes = std::fs::read(here.join(name)).unwrap();
        String::from_utf8_lossy(&bytes).replace('\0', "")
    };
    let mut commands: Vec<(String, &str, &str)> = vec![
        (
            "apply calibration.json run.toml -o a.csv".to_owned(),
            "a.csv",
            ",verdict_failed\n",
        ),
        (
            "compare calibration.json --truth truth.json -o c".to_owned(),
            "c/index.html",
            "FAILED W08",
        ),
        (
            "navigate calibration.json --truth truth.json --latitude-deg 45 --hours 1 -o n"
                .to_owned(),
            "n/navigation.csv",
            ",verdict_failed\n",
        ),
    ];
    let formats = turncal_files::export::FORMATS
        .iter()
        .map(|format| format.name);
    commands.extend(formats.map(|name| {
        let word = if name == "realsense" { "" } else { "FAILED" };
        (
            format!("export calibration.json --format {name} -o e"),
            "e",
            word,
        )
    }));
    for (command, file, says) in commands {
        let (status, _, message) = turncal(here, &command);
        assert!(
            status == 1 && message.contains("FAILED (W03: "),
            "{command}: {message}"
        );
        assert!(!here.join(file).exists(), "{command}");
        let (status, _, message) = turncal(here, &format!("{command} --force"));
        assert!(
            status == 0 && message.contains("FAILED"),
            "{command}: {message}"
        );
        assert!(read(file).contains(says), "{command}: no {says}");
        let _ = std::fs::remove_file(here.join("e"));
    }
    assert!(read("c/lot.csv").contains(",failed\n"));
}
