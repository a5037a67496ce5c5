//! Whatever units, axes, stamps and angles a file has, the run is the same.

use std::fs;

use nalgebra::Vector3;
use turncal::attitude;
use turncal::imu::Output;
use turncal::recording::LabelledMotion;
use turncal::run::Run;
use turncal::units::DEGREE;
use turncal_files::write_run;

use super::made::{assert_same, made_run};
use crate::shared::{read, shared};

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
        let run = read(&directory);
        assert_eq!(run.recording.name, name);
        assert_eq!(run.recording.imu.len(), samples, "{name}");
        assert_eq!(run.recording.table.is_some(), table, "{name}");
        assert_eq!(run.recording.segments.len(), segments, "{name}");
        let truth = directory.join("truth.json");
        if truth.exists() {
            let truth =
                turncal_files::read_calibration(&truth).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(truth.unit, Some(run.instrument.unit), "{name}");
        }
    }
}

/// The made run written with increments, with its `run.toml` and the rows of its samples changed;
/// `angles.csv` lies beside it.
fn reread(change: impl Fn(&str) -> String, imu: impl Fn(usize, [f64; 7]) -> String) -> Run {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().join("made");
    fs::create_dir(&place).unwrap();
    let run = made_run("made");
    write_run(&place, &run, Output::Increment, None).unwrap();
    let text = fs::read_to_string(place.join("run.toml")).unwrap();
    let text = text.replace("imu.csv.gz", "imu.csv");
    fs::write(place.join("run.toml"), change(&text)).unwrap();
    let mut rows = "t,gx,gy,gz,ax,ay,az,temp\n".to_owned();
    for k in 0..run.recording.imu.len() {
        let (g, a) = (run.recording.imu.gyro.at(k), run.recording.imu.accel.at(k));
        rows += &imu(k, [run.recording.imu.time(k), g.x, g.y, g.z, a.x, a.y, a.z]);
        rows += ",25.0\n";
    }
    fs::write(place.join("imu.csv"), rows).unwrap();
    let mut rows = "t,outer,middle,inner\n".to_owned();
    for k in 0..20 {
        rows += &format!("{},{},-20,{}\n", 3.3 + 0.1 * f64::from(k), 3 * k, 2 * k);
    }
    fs::write(place.join("angles.csv"), rows).unwrap();
    read(&place)
}

fn plain(_: usize, row: [f64; 7]) -> String {
    row.map(|value| value.to_string()).join(",")
}

#[test]
fn other_body_axes_describe_the_same_run() {
    let mut expected = made_run("made");
    // Labels name the file's axes: x is front in both.
    expected.recording.segments[0].motion = Some(LabelledMotion::Turns {
        axis: Vector3::y(),
        angle: 360.0 * DEGREE,
    });
    // Priors differ from axis to axis, so a swap of σ shows too.
    for axes in ["frd", "flu"] {
        let run = reread(
            |text| {
                let turned = |v: [&str; 3], sign: [&str; 3]| match axes {
                    "frd" => format!("[{}, {}, {}{}]", v[1], v[0], sign[2], v[2]),
                    _ => format!("[{}, {}{}, {}]", v[1], sign[0], v[0], v[2]),
                };
                let mut out = text.replace("[imu]", &format!("[imu]\nbody_axes = \"{axes}\""));
                let none = ["", "", ""];
                let minus = ["-", "-", "-"];
                for (x, y, z, sign) in [
                    ("1000.0", "2000.0", "3000.0", none),
                    ("0.00001", "-0.00002", "0.00003", minus),
                    ("1e-6", "2e-6", "3e-6", none),
                ] {
                    let from = format!("[{x}, {y}, {z}]");
                    assert!(out.contains(&from), "{from} in {out}");
                    out = out.replace(&from, &turned([x, y, z], sign));
                }
                let line = out
                    .lines()
                    .find(|l| l.starts_with("installation_sigma"))
                    .unwrap();
                let v: Vec<&str> = line.split(['[', ',', ']']).map(str::trim).collect();
                let to = format!(
                    "installation_sigma_arcsec = {}",
                    turned([v[1], v[2], v[3]], none)
                );
                out.replace(line, &to)
            },
            |_, [t, gx, gy, gz, ax, ay, az]| match axes {
                "frd" => format!("{t},{gy},{gx},{},{ay},{ax},{}", -gz, -az),
                _ => format!("{t},{gy},{},{gz},{ay},{},{az}", -gx, -ax),
            },
        );
        expected.recording.name.clone_from(&run.recording.name);
        assert_same(&expected, &run);
    }
}

#[test]
fn time_stamps_may_name_any_moment_of_a_sample_and_be_rounded() {
    for (word, lag) in [("start", 0.0), ("middle", 0.5), ("end", 1.0)] {
        let run = reread(
            |text| {
                text.replace(
                    "time_stamp = \"start\"",
                    &format!("time_stamp = \"{word}\""),
                )
                .replace("sample_period_s = 0.0078125\n", "")
            },
            |_, mut row| {
                row[0] = ((row[0] + lag / 128.0) * 1e4).round() / 1e4;
                plain(0, row)
            },
        );
        // Stamps rounded to 0.1 ms fix the period over 300 samples to better than 1 µs.
        assert!((run.recording.imu.period - 1.0 / 128.0).abs() < 1e-6);
        assert!(
            (run.recording.imu.start() - 3.25).abs() < 1e-4,
            "{word}: {}",
            run.recording.imu.start()
        );
    }
}

#[test]
fn stamps_rule_over_a_period_that_they_contradict_and_it_is_said_what_that_means() {
    for (stated, ppm) in [
        (1.0 / 128.0, None),
        (1.000_1 / 128.0, Some("99.99 ppm less")),
    ] {
        let run = reread(
            |text| text.replace("0.0078125\n", &format!("{stated}\n")),
            plain,
        );
        assert!((run.recording.imu.period * 128.0 - 1.0).abs() < 1e-9);
        let said =
            |note: &String| note.contains("sample_period_s") && note.contains(ppm.unwrap_or("ppm"));
        let notes = &run.recording.notes;
        assert_eq!(notes.iter().any(said), ppm.is_some(), "{notes:?}");
    }
}

#[test]
fn axis_angles_multiply_from_the_outer_axis_in() {
    let run = reread(
        |text| {
            text.replace(
                "quaternion = [\"qw\", \"qx\", \"qy\", \"qz\"]",
                "angles = [\"outer\", \"middle\", \"inner\"], axes = [\"z\", \"x\", \"y\"]",
            )
            .replace("table.csv.gz", "angles.csv")
        },
        plain,
    );
    let table = run.recording.table.unwrap();
    for (k, read) in table.attitude.iter().enumerate() {
        let c_b_n = attitude::matrix(read);
        // Heading is clockwise and the outer angle is not.
        let [outer, middle, inner] = [3.0 * k as f64, -20.0, 2.0 * k as f64].map(|a| a * DEGREE);
        let expected = attitude::from_pitch_roll_heading(middle, inner, -outer);
        assert!((c_b_n - expected).amax() < 1e-14);
    }
}

#[test]
fn what_has_no_effect_yet_is_noted() {
    let run = reread(
        |text| text.replace("[turntable]", "[turntable]\ntime_sigma_ms = 1"),
        plain,
    );
    let [note] = &run.recording.notes[..] else {
        panic!("{:?}", run.recording.notes);
    };
    assert!(
        note.contains("time_sigma") && note.contains("no effect"),
        "{note}"
    );
}
