//! The magnetometer from files to calibration.json.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;

use crate::export::{numbers, record, text_of};
use flate2::read::GzDecoder;
use nalgebra::{Matrix3, Rotation3, Vector3};
use tempfile::TempDir;
use turncal::calibration::result::{Calibration, FieldRecord, MagRecord};
use turncal::calibration::{Method, Options, Problem, UNWATCHED};
use turncal::magnetic::LocalField;
use turncal::recording::Magnetometer;
use turncal::simulation::{MagnetometerModel, Scenario, Simulated};
use turncal_files::draft::Draft;
use turncal_files::{calibration_json, read_calibration, read_run, write_run};

/// Fixed before the first run was made.
const SEED: u64 = 59;

fn simulated() -> Simulated {
    let mut scenario = Scenario::load("mems").unwrap();
    let site = &scenario.site;
    let date = (2026, 5, 1);
    let field = LocalField::of_model(site.latitude, site.longitude, site.height, date).unwrap();
    scenario.magnetometer = Some(MagnetometerModel {
        rate: 10.0,
        noise: 100e-9,
        hard_iron: 20e-6,
        soft_iron: 0.05,
        axes: Matrix3::identity(),
        disturbance: 0.0,
        field: [field.mean, field.sigma],
        date: Some(date),
    });
    scenario.simulate(SEED, 0).unwrap()
}

/// A change of a file, with words of the message about it.
type Edit = (fn(&mut MagRecord), &'static str);

fn values(of: &Magnetometer) -> Vec<(f64, Vector3<f64>)> {
    of.values().collect()
}

fn assert_near(one: &Magnetometer, other: &Magnetometer, tolerance: f64) {
    let (one, other) = (values(one), values(other));
    assert!(
        one.len().abs_diff(other.len()) <= 1,
        "{} {}",
        one.len(),
        other.len()
    );
    for ((time, value), (at, read)) in one.iter().zip(&other) {
        assert!(
            (time - at).abs() < 0.06 && (value - read).norm() < tolerance,
            "{value} {read}"
        );
    }
}

/// The simulated run, written into a directory.
fn written() -> (Simulated, TempDir) {
    let (made, directory) = (simulated(), tempfile::tempdir().unwrap());
    write_run(directory.path(), &made.run, made.output, None).unwrap();
    (made, directory)
}

/// Exchanges a text of run.toml.
fn exchange(run: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(run).unwrap();
    assert!(text.contains(from), "{from} in {text}");
    fs::write(run, text.replace(from, to)).unwrap();
}

#[test]
fn a_log_keeps_the_magnetometer_with_its_unit_and_the_field_of_place_and_date() {
    let (made, directory) = written();
    let path = directory.path().join("run.toml");
    let read = read_run(&path).unwrap().recording.magnetometer.unwrap();
    let written = made.run.recording.magnetometer.as_ref().unwrap();
    assert_near(written, &read, 1e-9);
    let [expected, found] = [written.field, read.field].map(|field| field.unwrap().mean);
    assert!((expected - found).norm() < 1e-6);
    // In gauss the same field is a hundredth of the number, and the calibration in tesla stays.
    exchange(&path, "mag_unit = \"uT\"", "mag_unit = \"G\"");
    let gauss = read_run(&path).unwrap().recording.magnetometer.unwrap();
    assert_eq!(gauss.nominal, 1e4);
    exchange(&path, "2026-05-01", "1 May 2026");
    let run = read_run(&path).unwrap();
    assert_eq!(run.recording.magnetometer.unwrap().field, None);
    assert!(
        run.recording
            .notes
            .iter()
            .any(|note| note.contains("local field"))
    );
    exchange(&path, "mag_unit = \"G\"", "mag_unit = \"Gs\"");
    let error = read_run(&path).unwrap_err().to_string();
    assert!(
        error.contains("mag_unit") && error.contains("mG"),
        "{error}"
    );
}

#[test]
fn a_magnetometer_in_a_log_of_its_own_is_read_by_its_own_clock() {
    let (made, directory) = written();
    let written = made.run.recording.magnetometer.as_ref().unwrap();
    let mut text = "ms,x,y,z\n".to_owned();
    for (time, value) in written.values() {
        writeln!(text, "{},{},{},{}", time * 1e3, value.y, value.x, -value.z).unwrap();
    }
    fs::write(directory.path().join("mag.csv"), text).unwrap();
    let path = directory.path().join("run.toml");
    exchange(&path, "\"mx\", \"my\", \"mz\"", "\"y\", \"x\", \"-z\"");
    let from = "mag_from = { file = \"mag.csv\", time = \"ms\", time_unit = \"ms\" }\nmag_unit = ";
    exchange(&path, "mag_unit = ", from);
    let run = read_run(&path).unwrap();
    assert!(
        run.recording
            .files
            .iter()
            .any(|file| file.ends_with("mag.csv"))
    );
    // Spans begin with the first value, so values may be in the next one.
    assert_near(written, run.recording.magnetometer.as_ref().unwrap(), 60.0);
    let first = values(run.recording.magnetometer.as_ref().unwrap())[0].1;
    assert!((first - values(written)[0].1).norm() < 1e-6);
}

#[test]
fn calibration_json_corrects_the_output_to_the_field_and_older_readers_find_what_they_know() {
    let made = simulated();
    let problem = Problem::new(&made.run, &Options::default());
    let solution = problem.solve(Method::Ekf, UNWATCHED).unwrap();
    let assessment = solution.assess(&problem).unwrap();
    let record = solution.calibration(&problem, &assessment);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("calibration.json");
    fs::write(&path, calibration_json(&record, &path).unwrap()).unwrap();
    let read = read_calibration(&path).unwrap();
    assert_eq!(read.mag, record.mag);
    let mag = read.mag.as_ref().unwrap();
    let correction = matrix(mag.correction);
    let truth = made.truth_record().mag.unwrap();
    // Output in a field of 50 µT along body y, by the truth.
    let field = Vector3::y() * 50e-6;
    let output = matrix(truth.matrix) * field + Vector3::from(truth.bias);
    let corrected = correction * (output - Vector3::from(mag.bias));
    let sigma = mag.field.sigma.unwrap()[0] / mag.field.magnitude;
    assert!(
        (corrected - field).norm() < 5.0 * sigma * 50e-6,
        "{corrected}"
    );
    for axis in ["xx", "xy", "zz"] {
        let name = format!("mag.matrix.{axis}");
        let error = read[name.as_str()] - made.truth_record()[name.as_str()];
        assert!(error.abs() < 4.5 * read.sigma_of(&name).unwrap(), "{name}");
    }
    assert_eq!(mag.parameters.len(), mag.covariance.len());
    // What was edited in one place contradicts another.
    let edits: [Edit; 4] = [
        (
            |mag| mag.matrix[0][1] *= 2.0,
            "mag.correction · mag.matrix = 1",
        ),
        (|mag| mag.covariance[3][3] *= 2.0, "the square of mag.sigma"),
        (|mag| mag.covariance.truncate(5), "rows of"),
        (|mag| "Gs".clone_into(&mut mag.unit), "mG"),
    ];
    for (edit, expected) in edits {
        let mut edited = record.clone();
        edit(edited.mag.as_mut().unwrap());
        let other = directory.path().join("edited.json");
        fs::write(&other, serde_json::to_vec(&edited).unwrap()).unwrap();
        let error = read_calibration(&other).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let variance = mag.covariance[11][11];
    assert!((variance.sqrt() / read.sigma_of("mag.bias.z").unwrap() - 1.0).abs() < 1e-9);
    assert!(read.parameters.iter().all(|name| !name.starts_with("mag")));
    // The budget names what the magnetometer adds.
    let sources = &read.budget.as_ref().unwrap().sources;
    assert!(!sources.is_empty());
}

/// Body axes right, front, up, along front, right, down.
const FROM_FRD: [[f64; 3]; 3] = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]];

fn matrix(rows: [[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| rows[i][j])
}

/// A calibration with a magnetometer whose axes are front, right, down, with this output per field, in `unit`.
fn with_magnetometer(sensitivity: Matrix3<f64>, bias: [f64; 3], unit: &str) -> Calibration {
    let of_body = sensitivity * matrix(FROM_FRD).transpose();
    let rows = |of: Matrix3<f64>| of.transpose().data.0;
    Calibration {
        mag: Some(MagRecord {
            matrix: rows(of_body),
            bias,
            unit: unit.to_owned(),
            sigma: None,
            correction: rows(of_body.try_inverse().unwrap()),
            field: FieldRecord {
                unit: "T".to_owned(),
                magnitude: 48e-6,
                declination_deg: 3.0,
                inclination_deg: 64.0,
                sigma: None,
            },
            parameters: Vec::new(),
            covariance: Vec::new(),
            ellipsoid: None,
            equation: String::new(),
        }),
        ..record()
    }
}

/// Parameters by their names.
fn parameters(text: &str) -> BTreeMap<String, f64> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let words = lines.map(|line| {
        let separators = ['\t', ',', ' ', '='];
        let words = line.split(separators).filter(|word| !word.is_empty());
        words.map(str::to_owned).collect::<Vec<_>>()
    });
    let pair = |words: Vec<String>| {
        let of_px4 = words.first().is_some_and(|word| word == "1");
        let skip = if of_px4 || words.first().is_some_and(|word| word == "set") {
            words.iter().position(|word| word.len() > 3)?
        } else {
            0
        };
        Some((words[skip].clone(), words.get(skip + 1)?.parse().ok()?))
    };
    words.filter_map(pair).collect()
}

/// Twenty fields along front, right, down, T.
fn fields() -> impl Iterator<Item = Vector3<f64>> {
    (0..20).map(|k| {
        let (angle, up) = (2.4 * f64::from(k), f64::from(k) / 10.0 - 0.95);
        let level = (1.0 - up * up).sqrt();
        48e-6 * Vector3::new(level * angle.cos(), level * angle.sin(), up)
    })
}

#[test]
fn autopilots_compute_the_field_from_the_parameters_of_their_files() {
    // Only a symmetric matrix is within reach of the parameters.
    let sensitivity =
        1e6 * Matrix3::new(1.04, 0.02, -0.013, 0.02, 0.97, 0.031, -0.013, 0.031, 1.01);
    let bias = [12.0, -31.0, 7.5];
    let symmetric = |of: &BTreeMap<String, f64>, [d, o]: [&str; 2]| -> Matrix3<f64> {
        let value = |name: &str, axis: &str| of[&name.replace('#', axis)];
        let [x, y, z] = ["X", "Y", "Z"].map(|axis| value(o, axis));
        let mut all = Matrix3::new(0.0, x, y, x, 0.0, z, y, z, 0.0);
        all.set_diagonal(&["X", "Y", "Z"].map(|axis| value(d, axis)).into());
        all
    };
    let offset = |of: &BTreeMap<String, f64>, name: &str| {
        Vector3::from(["X", "Y", "Z"].map(|axis| of[&name.replace('#', axis)]))
    };
    // The chip is straight, or turned by a right angle: PX4 corrects its axes and then turns them, ArduPilot the reverse.
    let turned = matrix([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    for turn in [Matrix3::identity(), turned] {
        // The matrix of the chip must be symmetric along the axes in which the program corrects.
        let of_chip = with_magnetometer(sensitivity * turn, bias, "uT");
        let of_vehicle = with_magnetometer(turn * sensitivity, bias, "uT");
        let px4 = parameters(&text_of(&of_chip, "px4", None).0);
        let ardupilot = parameters(&text_of(&of_vehicle, "ardupilot", None).0);
        for field in fields() {
            let raw = sensitivity * turn * field + Vector3::from(bias);
            let gauss: Vector3<f64> = turn.transpose()
                * symmetric(&px4, ["CAL_MAG0_#SCALE", "CAL_MAG0_#ODIAG"])
                * (raw / 100.0 - offset(&px4, "CAL_MAG0_#OFF"));
            assert!(
                (gauss - field * 1e4).norm() < 1e-6 * field.norm() * 1e4,
                "{gauss}"
            );
            let raw = turn.transpose() * (turn * sensitivity * field + Vector3::from(bias));
            let milligauss: Vector3<f64> =
                symmetric(&ardupilot, ["COMPASS_DIA_#", "COMPASS_ODI_#"])
                    * (raw * 10.0 + offset(&ardupilot, "COMPASS_OFS_#"));
            assert!((milligauss - field * 1e7).norm() < 1e-6 * field.norm() * 1e7);
        }
    }
}

#[test]
fn counts_and_whole_matrices_go_where_a_program_takes_them() {
    let sensitivity = Matrix3::from_diagonal(&Vector3::new(5.2e6, 4.8e6, 5.0e6));
    let bias = [140.0, -260.0, 35.0];
    // Without a run, the axes of the log are right, front, up.
    let record = with_magnetometer(sensitivity * matrix(FROM_FRD), bias, "count");
    let inav = parameters(&text_of(&record, "inav", None).0);
    let axes =
        |name: &str| Vector3::from(["x", "y", "z"].map(|axis| inav[&format!("{name}_{axis}")]));
    let gain = axes("maggain");
    for field in fields() {
        let raw = sensitivity * field + Vector3::from(bias);
        let found = (raw - axes("magzero")) * 1024.0;
        let found = found.component_div(&gain);
        // Whole numbers: half a count of 240, half a step of a gain of 1000.
        assert!(
            (found.normalize() - field.normalize()).norm() < 5e-3,
            "{found}"
        );
    }
    // Betaflight turns the output to the axes of the vehicle before it subtracts.
    let turned = matrix([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    let of_turned = with_magnetometer(turned * sensitivity * matrix(FROM_FRD), bias, "count");
    for (record, zero) in [(&record, "140,-260,35"), (&of_turned, "260,140,35")] {
        let betaflight = text_of(record, "betaflight", None).0;
        let line = format!("set mag_calibration = {zero}\n");
        assert!(betaflight.contains(&line), "{betaflight}");
    }
    let notes = text_of(&record, "px4", None).1;
    assert!(
        notes.iter().any(|note| note.contains("counts")),
        "{notes:?}"
    );
    let full = Matrix3::new(1.1e6, 4e4, -2e4, 9e4, 0.9e6, 3e4, 1e4, 5e4, 1e6);
    let record = with_magnetometer(full, bias, "uT");
    let text = text_of(&record, "c", None).0;
    let after = |name: &str, count: usize| {
        let rest = text.split_once(name).unwrap().1.split_once('=').unwrap().1;
        numbers(rest.split_once(';').unwrap().0)[..count].to_vec()
    };
    let correction = Matrix3::from_row_slice(&after("turncal_mag_correction", 9));
    let zero = Vector3::from_row_slice(&after("turncal_mag_bias", 3));
    let madgwick = parameters(
        &text_of(&record, "imu-filter-madgwick", None)
            .0
            .replace(':', ""),
    );
    for field in fields() {
        let raw = full * field + Vector3::from(bias);
        let found = matrix(FROM_FRD).transpose() * (correction * (raw - zero));
        assert!((found - field).norm() < 1e-12);
    }
    for (axis, value) in ["x", "y", "z"].into_iter().zip(bias) {
        assert!((madgwick[&format!("mag_bias_{axis}")] - value * 1e-6).abs() < 1e-12);
    }
    let between = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.7).into_inner();
    let notes = text_of(&with_magnetometer(between * full, bias, "uT"), "px4", None).1;
    assert!(
        notes
            .iter()
            .any(|note| note.contains("cannot describe a rotation")),
        "{notes:?}"
    );
}

#[test]
fn a_draft_has_the_magnetometer_of_the_rows_or_of_a_stream_with_a_clock_of_its_own() {
    let (made, directory) = written();
    let log = directory.path().join("imu.csv.gz");
    let draft = Draft::of_file(&log).unwrap().to_toml("imu.csv.gz");
    assert!(draft.contains("mag = [\"mx\", \"my\", \"mz\"]"), "{draft}");
    assert!(draft.contains("mag_unit = \"uT\""), "{draft}");
    // The clock of a logger does not begin at zero.
    let mut text = String::new();
    let unpacked = GzDecoder::new(fs::File::open(&log).unwrap());
    for line in BufReader::new(unpacked).lines().skip(1) {
        let line = line.unwrap();
        let words: Vec<&str> = line.split(',').collect();
        let time = 864e5 + 1e3 * words[0].parse::<f64>().unwrap();
        writeln!(text, "IMU,{time:.3},{}", words[1..7].join(",")).unwrap();
        if !words[7].is_empty() {
            writeln!(text, "MAG,{time:.3},{}", words[7..].join(",")).unwrap();
        }
    }
    let tagged = directory.path().join("tagged.txt");
    fs::write(&tagged, text).unwrap();
    let run = directory.path().join("run.toml");
    fs::write(&run, Draft::of_file(&tagged).unwrap().to_toml("tagged.txt")).unwrap();
    let read = read_run(&run).unwrap().recording;
    let [written, found] = [&made.run.recording, &read].map(|of| {
        let first = of.imu.start();
        let all = values(of.magnetometer.as_ref().unwrap());
        all.into_iter()
            .map(move |(time, value)| (time - first, value))
            .collect::<Vec<_>>()
    });
    assert!(written.len().abs_diff(found.len()) <= 1);
    for ((time, value), (at, read)) in written.iter().zip(&found) {
        // Half a span, and a row that ends at its time.
        assert!(
            (time - at).abs() < 0.07 && (value - read).norm() < 1e-6,
            "{time} {at}"
        );
    }
}

#[test]
fn an_output_that_does_not_depend_on_the_field_is_no_magnetometer() {
    // Noise, and numbers whose squares are beyond all numbers.
    for size in [1.0, 1e300] {
        let found = with_noise(size);
        assert!(found.mag.is_none());
        let has_finding = found.findings.iter().any(|of| of.code == "W38");
        assert!(has_finding, "{:?}", found.findings);
    }
}

/// The calibration of the simulated run with noise of this size, µT, in place of its magnetometer.
fn with_noise(size: f64) -> Calibration {
    let mut made = simulated();
    let log = made.run.recording.magnetometer.as_mut().unwrap();
    let mut noise = Magnetometer::new(&log.unit, log.nominal);
    noise.field = log.field;
    for (k, (time, _)) in log.values().enumerate() {
        let phase = (k * k) as f64;
        let value = Vector3::new(phase.sin(), (3.0 * phase).cos(), (2.0 * phase + 1.0).sin());
        noise.push(time, size * value);
    }
    *log = noise;
    let problem = Problem::new(&made.run, &Options::default());
    let solution = problem.solve(Method::Ekf, UNWATCHED).unwrap();
    let assessment = solution.assess(&problem).unwrap();
    solution.calibration(&problem, &assessment)
}
