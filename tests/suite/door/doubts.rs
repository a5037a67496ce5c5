//! What is out of the ordinary in a run's files is said, and mended where it can be.

use std::fs;
use std::io::{Read, Write};
use std::path::Path;

use flate2::Compression;
use flate2::read::MultiGzDecoder;
use flate2::write::GzEncoder;
use turncal::imu::{Output, Sensor};
use turncal::recording::FaultKind;
use turncal::run::Run;
use turncal::units::MILLIGAL;
use turncal_files::write_run;

use super::made::made_run;
use crate::shared::read;

/// What the reader says of a run that was changed before it was written, and the rows of its file after.
fn reread(change: impl Fn(&mut Run), rows: impl Fn(Vec<String>) -> Vec<String>) -> Run {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().join("made");
    fs::create_dir(&place).unwrap();
    let mut run = made_run("made");
    change(&mut run);
    write_run(&place, &run, Output::Increment, None).unwrap();
    edit(&place.join("imu.csv.gz"), rows);
    read(&place)
}

fn edit(file: &Path, rows: impl Fn(Vec<String>) -> Vec<String>) {
    let mut text = String::new();
    let mut gz = MultiGzDecoder::new(fs::File::open(file).unwrap());
    gz.read_to_string(&mut text).unwrap();
    let text = rows(text.lines().map(|row| format!("{row}\n")).collect()).concat();
    let mut gz = GzEncoder::new(fs::File::create(file).unwrap(), Compression::fast());
    gz.write_all(text.as_bytes()).unwrap();
    gz.finish().unwrap();
}

fn as_they_are(rows: Vec<String>) -> Vec<String> {
    rows
}

fn says(run: &Run, words: &str) -> bool {
    let recording = &run.recording;
    let mut all = recording.doubts.iter().chain(&recording.notes);
    all.any(|note| note.contains(words))
}

#[test]
fn gravity_that_no_place_has_is_said() {
    for (mgal, said) in [
        (-143.0, true),
        (-136.0, false),
        (136.0, false),
        (143.0, true),
    ] {
        let off = |run: &mut Run| run.site.gravity += mgal * MILLIGAL;
        let run = reread(off, as_they_are);
        assert_eq!(
            says(&run, "normal gravity"),
            said,
            "{:?}",
            run.recording.doubts
        );
    }
}

#[test]
fn a_table_log_that_does_not_reach_over_the_record_is_said() {
    for (readings, words) in [
        (0..20, None),
        (0..17, Some("ends 0.")),
        (3..20, Some("begins 0.")),
        (3..17, Some("begins 0.")),
    ] {
        let cut = |run: &mut Run| {
            let table = run.recording.table.as_mut().unwrap();
            table.time = table.time[readings.clone()].to_vec();
            table.attitude = table.attitude[readings.clone()].to_vec();
        };
        let run = reread(cut, as_they_are);
        let said = says(&run, "The other parts of the IMU log cannot be used");
        assert_eq!(said, words.is_some(), "{:?}", run.recording.doubts);
        assert!(words.is_none_or(|words| says(&run, words)));
    }
}

#[test]
fn a_row_that_lacks_a_value_is_missing_and_one_that_lacks_all_is_another_sensors() {
    let blank = |rows: Vec<String>| {
        let spoilt = |(number, row): (usize, String)| {
            let fields: Vec<&str> = row.split(',').collect();
            match number {
                101 | 201 => [&fields[..3], &[""], &fields[4..]].concat().join(","),
                151 => format!("{},,,,,,\n", fields[0]),
                _ => row,
            }
        };
        rows.into_iter().enumerate().map(spoilt).collect()
    };
    let run = reread(|_| (), blank);
    assert!(says(&run, "turncal counts 2 rows") && says(&run, "as missing"));
    assert!(says(&run, "turncal skipped 1 row of"));
    let whole = reread(|_| (), as_they_are);
    assert_eq!(run.recording.imu.len(), whole.recording.imu.len());
}

#[test]
fn rows_of_zeros_and_values_beyond_any_instrument_are_found_and_bridged() {
    let spoil = |mut rows: Vec<String>| {
        let spoilt = |row: &str, values: &str| {
            let time = row.split(',').next().unwrap();
            format!("{time},{values}\n")
        };
        for row in [101, 102, 250] {
            rows[row] = spoilt(&rows[row], "0,0,0,0,0,0");
        }
        for row in [200, 201] {
            let old = rows[row].clone();
            let fields: Vec<&str> = old.trim().split(',').collect();
            rows[row] = spoilt(&old, &format!("4294967295,{}", fields[2..].join(",")));
        }
        rows
    };
    let run = reread(|_| (), spoil);
    let imu = &run.recording.imu;
    let of = |kind| imu.faults.iter().filter(move |fault| fault.kind == kind);
    let zero: Vec<_> = of(FaultKind::Zero)
        .map(|fault| fault.samples.clone())
        .collect();
    assert_eq!(zero, [100..102, 249..250]);
    let beyond: Vec<_> = of(FaultKind::Beyond)
        .map(|fault| (fault.axis, fault.samples.clone()))
        .collect();
    assert_eq!(beyond, [(Some((Sensor::Gyro, 0)), 199..201)]);
    assert!(says(&run, "3 rows are zero in all columns") && says(&run, "first in line 102,"));
    assert!(says(
        &run,
        "2 samples of `gx` are beyond the range of any instrument"
    ));
    let sound = made_run("made").recording.imu;
    for (kind, sample) in [
        (FaultKind::Zero, 100),
        (FaultKind::Zero, 249),
        (FaultKind::Beyond, 199),
    ] {
        assert!(of(kind).all(|fault| fault.bridged));
        // Interpolated, not zero and not four billion.
        let off = imu.accel.at(sample) - sound.accel.at(sample);
        assert!(off.norm() < 1e-3 * sound.accel.at(sample).norm(), "{off}");
        assert!(imu.gyro.at(sample).norm() < 0.1);
    }
}

#[test]
fn rows_lost_behind_a_counter_that_wraps_are_not_counted_in_silence() {
    for (lost, said) in [(0, false), (30, true)] {
        let counter = |rows: Vec<String>| {
            let mut counted = vec![rows[0].clone()];
            let behind = rows.iter().enumerate().skip(1);
            for (k, row) in behind.filter(|(k, _)| !(120..120 + lost).contains(k)) {
                let (_, values) = row.split_once(',').unwrap();
                counted.push(format!("{},{values}", k % 256));
            }
            counted
        };
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("made");
        fs::create_dir(&place).unwrap();
        let mut run = made_run("made");
        (run.recording.table, run.recording.segments) = (None, Vec::new());
        write_run(&place, &run, Output::Increment, None).unwrap();
        edit(&place.join("imu.csv.gz"), counter);
        let text = fs::read_to_string(place.join("run.toml")).unwrap();
        let text = text.replacen("[imu]", "[imu]\ntime_unit = \"count\"", 1);
        fs::write(place.join("run.toml"), text).unwrap();
        let run = read(&place);
        assert_eq!(run.recording.imu.len(), 300);
        let words = "the counter wraps every 256 samples (2";
        assert_eq!(says(&run, words), said, "{:?}", run.recording.doubts);
    }
}

#[test]
fn a_log_without_a_last_line_end_loses_its_last_row_and_says_so() {
    for (digits, said) in [
        (0, None),
        (1, Some("may lack digits")),
        (40, Some("has too few fields")),
    ] {
        let cut = |mut rows: Vec<String>| {
            let last = rows.last_mut().unwrap();
            last.truncate(last.len() - digits);
            rows
        };
        let run = reread(|run| run.recording.segments.clear(), cut);
        let samples = 300 - usize::from(said.is_some());
        assert_eq!(run.recording.imu.len(), samples);
        assert!(said.is_none_or(|said| says(&run, said) && says(&run, "line 301")));
        assert_eq!(run.recording.notes.len(), usize::from(said.is_some()));
    }
}

#[test]
fn quaternions_in_another_order_are_told_by_gravity() {
    let directory = tempfile::tempdir().unwrap();
    let turncal = |arguments: &[&str]| {
        let mut command = assert_cmd::Command::new(env!("CARGO_BIN_EXE_turncal"));
        let output = command
            .current_dir(directory.path())
            .args(arguments)
            .output()
            .unwrap();
        String::from_utf8([output.stdout, output.stderr].concat()).unwrap()
    };
    turncal(&["simulate", "demo", "-o", "run"]);
    let file = directory.path().join("run/run.toml");
    let words = "in the order x, y, z, w";
    assert!(!turncal(&["check", "run/run.toml"]).contains("The table's quaternions"));
    let text = fs::read_to_string(&file).unwrap();
    let turned = text.replace(r#"["qw", "qx", "qy", "qz"]"#, r#"["qx", "qy", "qz", "qw"]"#);
    assert_ne!(text, turned);
    fs::write(&file, turned).unwrap();
    let said = turncal(&["check", "run/run.toml"]);
    assert!(said.contains(words), "{said}");
    let said = turncal(&["calibrate", "run/run.toml"]);
    assert!(said.contains(words), "{said}");
    // Axes that are swapped are another cause.
    let swapped = text.replace(r#"["ax", "ay", "az"]"#, r#"["az", "-ay", "ax"]"#);
    assert_ne!(text, swapped);
    fs::write(&file, swapped).unwrap();
    let said = turncal(&["check", "run/run.toml"]);
    assert!(
        said.contains("Check of run") && !said.contains("The table's quaternions"),
        "{said}"
    );
    // The inverse of a rotation has the signs of three turned.
    fs::write(&file, text).unwrap();
    let inverse = |rows: Vec<String>| {
        let mut turned = vec![rows[0].clone()];
        for row in &rows[1..] {
            let fields: Vec<&str> = row.trim().split(',').collect();
            let minus = |k: usize| -fields[k].parse::<f64>().unwrap();
            turned.push(format!(
                "{},{},{},{},{}\n",
                fields[0],
                fields[1],
                minus(2),
                minus(3),
                minus(4)
            ));
        }
        turned
    };
    edit(&directory.path().join("run/table.csv.gz"), inverse);
    let said = turncal(&["check", "run/run.toml"]);
    assert!(said.contains("East-North-Up to body"), "{said}");
}
