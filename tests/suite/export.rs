//! `turncal export`: each format, evaluated as those evaluate it who read it.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process;

use assert_cmd::Command;
use nalgebra::{Matrix3, Vector3};
use turncal::calibration::result::{Calibration, TermRecord, TestVector, TriadRecord};
use turncal::imu::{BodyFrame, GaussMarkov, Noise, Nominal, PerSensor};
use turncal::run::Run;
use turncal::units::{ARCSEC, DEG_PER_H};
use turncal_files::export::{Format, write};

use crate::calibration_file::written;
use crate::door::made::made_run;
use crate::shared::skipped;

const INPUTS: [[f64; 6]; 3] = [
    [0.0, 0.0, 0.0, 0.0, 0.0, 9.8],
    [0.1, -0.2, 0.3, 1.0, 2.0, -3.0],
    [-1.0, 0.5, 0.25, -9.8, 0.5, 4.0],
];

fn sensitivity(triad: &TriadRecord) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| triad.scale[i] * triad.installation[i][j])
}

/// `N` of one triad.
pub fn output(triad: &TriadRecord, u: Vector3<f64>) -> Vector3<f64> {
    sensitivity(triad) * u + Vector3::from(triad.bias)
}

pub fn halves(six: &[f64; 6]) -> [Vector3<f64>; 2] {
    [0, 3].map(|k| Vector3::from_column_slice(&six[k..k + 3]))
}

/// A calibration of counts with every kind of error and test vectors.
pub fn record() -> Calibration {
    let gyro = TriadRecord {
        scale: [2.0651e6, 2.0598e6, 2.0634e6],
        installation: [
            [1.0, 1.1e-3, -9e-4],
            [7e-4, 1.0, 1.3e-3],
            [-4e-4, 6e-4, 1.0],
        ],
        bias: [251.0, -248.0, 10.5],
    };
    let accel = TriadRecord {
        scale: [100_310.0, 99_870.0, 100_020.0],
        installation: [[1.0, 8e-4, -5e-4], [2e-4, 1.0, 9e-4], [3e-4, -6e-4, 1.0]],
        bias: [2860.0, 2510.0, -1900.0],
    };
    let sigma = |scale: f64, bias: f64| TriadRecord {
        scale: [scale, 2.0 * scale, 3.0 * scale],
        installation: [[0.0, 1e-6, 1e-6], [1e-6, 0.0, 1e-6], [1e-6, 1e-6, 0.0]],
        bias: [bias, 2.0 * bias, 3.0 * bias],
    };
    Calibration {
        unit: Some(PerSensor::from_fn(|_| "count".to_owned())),
        sigma: Some(PerSensor {
            gyro: sigma(0.5, 0.03),
            accel: sigma(0.04, 0.4),
        }),
        test_vectors: INPUTS.map(|u| vector(&gyro, &accel, u)).to_vec(),
        ..Calibration::new(gyro, accel)
    }
}

fn vector(gyro: &TriadRecord, accel: &TriadRecord, calibrated: [f64; 6]) -> TestVector {
    let [rate, force] = halves(&calibrated);
    let mut raw = [0.0; 6];
    raw[..3].copy_from_slice(output(gyro, rate).as_slice());
    raw[3..].copy_from_slice(output(accel, force).as_slice());
    TestVector { raw, calibrated }
}

fn with_terms(mut record: Calibration) -> Calibration {
    let mut term = |name: &str, value| {
        let term = TermRecord {
            value,
            sigma: Some(1e-9),
        };
        record.terms.insert(name.to_owned(), term);
    };
    term("gyro.g_sensitivity.xy", 3e-7);
    term("gyro.g_sensitivity.zz", -2e-7);
    term("accel.second_order.x", 1e-6);
    term("table.base.up", 1e-5);
    record
}

/// The bytes of a file, and what it does not hold.
pub fn bytes(record: &Calibration, format: &str, run: Option<&Run>) -> (Vec<u8>, Vec<String>) {
    let exported = write(record, Format::named(format).unwrap(), run).unwrap();
    (exported.bytes, exported.notes)
}

/// The text of a file, and what it does not hold.
pub fn text_of(record: &Calibration, format: &str, run: Option<&Run>) -> (String, Vec<String>) {
    let (bytes, notes) = bytes(record, format, run);
    (String::from_utf8(bytes).unwrap(), notes)
}

fn exported(record: &Calibration, format: &str) -> (String, Vec<String>) {
    text_of(record, format, None)
}

/// Equal to 1e-12 of the vector's length.
fn assert_near(found: Vector3<f64>, expected: Vector3<f64>) {
    let limit = 1e-12 * expected.norm().max(1e-3);
    assert!((found - expected).amax() <= limit, "{found} {expected}");
}

fn assert_calibrates(evaluate: impl Fn(&[f64; 6]) -> Vec<f64>) {
    for vector in record().test_vectors {
        let found: [f64; 6] = evaluate(&vector.raw).try_into().unwrap();
        let pairs = halves(&found).into_iter().zip(halves(&vector.calibrated));
        pairs.for_each(|(found, expected)| assert_near(found, expected));
    }
}

/// The numbers between brackets or braces, in order.
pub fn numbers(text: &str) -> Vec<f64> {
    text.split(|c: char| !(c.is_ascii_alphanumeric() || "+-.".contains(c)))
        .filter_map(|word| word.parse().ok())
        .collect()
}

fn of_program(program: &str) -> bool {
    let there = process::Command::new(program).arg("--version").output();
    if there.is_err() {
        skipped(&format!("no {program}"));
    }
    there.is_ok()
}

#[test]
fn the_c_header_compiles_without_a_warning_and_gives_the_test_vectors() {
    if !of_program("cc") {
        return;
    }
    let mut record = with_terms(record());
    // What a user writes into a run must not get out of its comment.
    for (name, notes) in [
        ("notes", "*/ int x = ;\n#error \u{2028} in C:\\"),
        ("table", "which??/"),
    ] {
        record.meta.insert(name.to_owned(), notes.to_owned());
    }
    let root = tempfile::tempdir().unwrap();
    let header = exported(&record, "c").0;
    fs::write(root.path().join("turncal_calibration.h"), header).unwrap();
    let main = r#"
#include <stdio.h>
#include <stdlib.h>
#include "turncal_calibration.h"
int main(int argc, char **argv)
{
    double u[6];
    for (int i = 0; i < 6 && i + 1 < argc; i++) u[i] = strtod(argv[i + 1], NULL);
    turncal_calibrate(u, u);
    for (int i = 0; i < 6; i++) printf("%.17g\n", u[i]);
    return 0;
}
"#;
    let (source, program) = (root.path().join("main.c"), root.path().join("main"));
    fs::write(&source, main).unwrap();
    let compiled = process::Command::new("cc")
        .args(["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-o"])
        .args([&program, &source])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&compiled.stderr);
    assert!(compiled.status.success(), "{said}");
    assert_calibrates(|raw| {
        let arguments = raw.map(|value| format!("{value:e}"));
        let ran = process::Command::new(&program)
            .args(arguments)
            .output()
            .unwrap();
        numbers(&String::from_utf8(ran.stdout).unwrap())
    });
}

/// Keys of nested YAML mappings, joined by points, with the numbers below each.
pub fn yaml(text: &str) -> BTreeMap<String, Vec<f64>> {
    let mut path: Vec<(usize, String)> = Vec::new();
    let mut values = BTreeMap::<String, Vec<f64>>::new();
    for line in text.lines() {
        let line = line.split('#').next().unwrap().trim_end();
        let entry = line.trim_start();
        if entry.is_empty() {
            continue;
        }
        let indent = line.len() - entry.len();
        let content = match entry.strip_prefix("- ") {
            Some(row) => row,
            None => {
                path.retain(|&(of_key, _)| of_key < indent);
                let (key, content) = entry.split_once(':').unwrap();
                path.push((indent, key.to_owned()));
                content
            }
        };
        let keys: Vec<&str> = path.iter().map(|(_, key)| key.as_str()).collect();
        values
            .entry(keys.join("."))
            .or_default()
            .extend(numbers(content));
    }
    values
}

/// The numbers of the comment that begins like this, in all its brackets.
pub fn comment(text: &str, begin: &str) -> Vec<f64> {
    let line = text.lines().find(|l| l.starts_with(&format!("# {begin}")));
    let line = line.unwrap_or_else(|| panic!("no `{begin}` in {text}"));
    let lists = line.split('[').skip(1).filter_map(|l| l.split(']').next());
    lists.flat_map(numbers).collect()
}

/// What the comment says raw output is divided by, gyros first.
pub fn divisors(text: &str) -> [Vector3<f64>; 2] {
    halves(&comment(text, "to convert the raw").try_into().unwrap())
}

/// Kalibr's measurement model, from its file alone: angular rate and specific force along the body
/// axes of the calibration to the measured ones.
fn kalibr_measures(text: &str, rate: Vector3<f64>, force: Vector3<f64>) -> [Vector3<f64>; 2] {
    let file = yaml(text);
    let matrix = |key: &str| Matrix3::from_row_slice(&file[&format!("imu0.{key}")]);
    let pose = &file["imu0.T_i_b"];
    let imu_b = Matrix3::from_fn(|i, j| pose[4 * i + j]);
    let [m_gyro, a, gyro_imu, m_accel] = [
        "gyroscopes.M",
        "gyroscopes.A",
        "gyroscopes.C_gyro_i",
        "accelerometers.M",
    ]
    .map(matrix);
    for lower in [m_gyro, m_accel] {
        assert_eq!([lower[(0, 1)], lower[(0, 2)], lower[(1, 2)]], [0.0; 3]);
        assert!(lower.diagonal().iter().all(|&d| (d - 1.0).abs() < 0.02));
    }
    for rotation in [imu_b, gyro_imu] {
        assert!((rotation * rotation.transpose() - Matrix3::identity()).amax() < 1e-14);
        assert!((rotation.determinant() - 1.0).abs() < 1e-14);
    }
    let bias = |name: &str| Vector3::from_vec(comment(text, &format!("bias of {name}")));
    [
        m_gyro * (gyro_imu * imu_b * rate) + a * (gyro_imu * imu_b * force) + bias("gyroscopes"),
        m_accel * (imu_b * force) + bias("accelerometers"),
    ]
}

#[test]
fn kalibrs_equations_measure_the_raw_output_of_the_test_vectors() {
    let record = record();
    let text = exported(&record, "kalibr").0;
    assert!(text.contains("\n  model: scale-misalignment\n"));
    let divisors = divisors(&text);
    for vector in &record.test_vectors {
        let [rate, force] = halves(&vector.calibrated);
        let measured = kalibr_measures(&text, rate, force);
        for (k, raw) in halves(&vector.raw).iter().enumerate() {
            assert_near(measured[k], raw.component_div(&divisors[k]));
        }
    }
}

#[test]
fn kalibr_holds_g_sensitivity_and_names_the_terms_that_it_does_not_hold() {
    let record = with_terms(record());
    let (text, notes) = exported(&record, "kalibr");
    let divisors = divisors(&text);
    let [rate, force] = halves(&INPUTS[2]);
    let sensed = rate + Vector3::new(3e-7 * force.y, 0.0, -2e-7 * force.z);
    let raw = output(&record.gyro, sensed);
    assert_near(
        kalibr_measures(&text, rate, force)[0],
        raw.component_div(&divisors[0]),
    );
    let note = notes.iter().find(|n| n.contains("error terms")).unwrap();
    assert!(note.contains("accel-second-order") && !note.contains("g-sensitivity"));
    assert!(text.contains(note.as_str()) && text.contains("accel.second_order.x = 1e-6"));
}

#[test]
fn along_the_accelerometers_kalibrs_body_is_its_imu() {
    let mut record = record();
    record.body_frame = BodyFrame::Accelerometer;
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        record.accel.installation[i][j] = 0.0;
    }
    let file = yaml(&exported(&record, "kalibr").0);
    let identity: Vec<f64> = (0..16).map(|k| f64::from(u8::from(k % 5 == 0))).collect();
    assert_eq!(file["imu0.T_i_b"], identity);
}

/// KF-GINS' compensation, from its file alone: right, front, up in and out.
fn kf_gins_compensates(text: &str, n: [Vector3<f64>; 2]) -> [Vector3<f64>; 2] {
    let file = yaml(text);
    let turned = |v: Vector3<f64>| Vector3::new(v.y, v.x, -v.z);
    let divisors = divisors(text).map(|d| Vector3::new(d.y, d.x, d.z));
    let triad = |k: usize, bias: &str, unit: f64, scale: &str| {
        let measured = turned(n[k].component_div(&divisors[k]));
        let bias = Vector3::from_column_slice(&file[bias]) * unit;
        let scale = Vector3::from_column_slice(&file[scale]) * 1e-6;
        turned((measured - bias).component_div(&scale.add_scalar(1.0)))
    };
    [
        triad(0, "initgyrbias", DEG_PER_H, "initgyrscale"),
        triad(1, "initaccbias", 1e-5, "initaccscale"),
    ]
}

#[test]
fn kf_gins_gives_the_test_vectors_but_for_the_misalignment_that_the_file_states() {
    let record = record();
    let (text, notes) = exported(&record, "kf-gins");
    // The largest off-diagonal entry, of gyro y.
    assert!(
        notes[0].contains(&format!("{:.1} arcsec", 1.3e-3 / ARCSEC)),
        "{}",
        notes[0]
    );
    let lost: Vec<Vector3<f64>> = ["gyro", "accel"]
        .iter()
        .flat_map(|sensor| ["front", "right", "down"].map(|axis| format!("lost, {sensor} {axis}:")))
        .map(|begin| {
            let line = text.lines().find(|l| l.contains(&begin)).unwrap();
            Vector3::from_vec(numbers(line.split_once(':').unwrap().1)) * ARCSEC
        })
        .collect();
    for vector in &record.test_vectors {
        let found = kf_gins_compensates(&text, halves(&vector.raw));
        for (k, expected) in halves(&vector.calibrated).into_iter().enumerate() {
            let frd = Vector3::new(expected.y, expected.x, -expected.z);
            let stays = Vector3::from_fn(|i, _| lost[3 * k + i].dot(&frd));
            let stays = Vector3::new(stays.y, stays.x, -stays.z);
            // The file gives what is lost to a thousandth of an arcsec.
            assert!((found[k] - expected - stays).amax() < 1e-8 * frd.norm().max(1.0));
        }
    }

    let mut aligned = record;
    for triad in [&mut aligned.gyro, &mut aligned.accel] {
        triad.installation = crate::calibration_file::ALIGNED;
    }
    let text = exported(&aligned, "kf-gins").0;
    for input in INPUTS {
        let [rate, force] = halves(&input);
        let raw = [output(&aligned.gyro, rate), output(&aligned.accel, force)];
        let found = kf_gins_compensates(&text, raw);
        assert_near(found[0], rate);
        assert_near(found[1], force);
    }
}

#[test]
fn kf_gins_takes_the_sigma_of_biases_and_scale_factors_in_its_units_and_axes() {
    let file = yaml(&exported(&record(), "kf-gins").0);
    // Front is y: gyro bias σ 0.06 of 2.06e6 a rad/s.
    let expected = 0.06 / 2.06e6 / DEG_PER_H;
    assert!((file["initbgstd"][0] / expected - 1.0).abs() < 1e-12);
    let expected = 0.04 / 1e5 * 1e6;
    assert!((file["initsastd"][1] / expected - 1.0).abs() < 1e-12);
}

/// A run of the record's instrument.
fn run() -> Run {
    let mut run = made_run("made");
    run.instrument.unit = PerSensor::from_fn(|_| "count".to_owned());
    run.instrument.nominal = PerSensor {
        gyro: Nominal(Vector3::new(2e6, 2.1e6, 2.2e6)),
        accel: Nominal(Vector3::repeat(1e5)),
    };
    run.instrument.noise.gyro = Noise {
        random_walk: 2e-5,
        gauss_markov: Some(GaussMarkov {
            sigma: 4e-7,
            correlation_time: 200.0,
        }),
    };
    run
}

#[test]
fn a_run_gives_noise_figures_sample_rate_and_nominal_scales() {
    let run = run();
    let of = |format| text_of(&record(), format, Some(&run)).0;
    let text = of("kalibr");
    let file = yaml(&text);
    let near = |key: &str, expected: f64| {
        assert!((file[key][0] / expected - 1.0).abs() < 1e-12, "{key}");
    };
    near("imu0.gyroscope_noise_density", 2e-5);
    near("imu0.gyroscope_random_walk", 4e-8);
    near("imu0.accelerometer_noise_density", 5e-5);
    near("imu0.update_rate", 128.0);
    assert!(!file.contains_key("imu0.accelerometer_random_walk"));
    assert!(text.contains("# accelerometer_random_walk:"));
    assert_eq!(divisors(&text)[0], Vector3::new(2e6, 2.1e6, 2.2e6));
    let [rate, force] = halves(&INPUTS[1]);
    let accel = kalibr_measures_any_scale(&text, force);
    let expected = output(&record().accel, force) / 1e5;
    assert_near(accel, expected);
    assert!(rate.norm() > 0.0);

    let file = yaml(&of("kf-gins"));
    let degrees = 180.0 / std::f64::consts::PI;
    assert!((file["imunoise.arw"][2] / (2e-5 * degrees * 60.0) - 1.0).abs() < 1e-12);
    assert!((file["imunoise.vrw"][0] / (5e-5 * 60.0) - 1.0).abs() < 1e-12);
    assert!((file["imunoise.gbstd"][1] / (4e-7 / DEG_PER_H) - 1.0).abs() < 1e-12);
    assert!((file["imunoise.corrtime"][0] / (200.0 / 3600.0) - 1.0).abs() < 1e-12);
}

fn kalibr_measures_any_scale(text: &str, force: Vector3<f64>) -> Vector3<f64> {
    let file = yaml(text);
    let pose = &file["imu0.T_i_b"];
    let imu_b = Matrix3::from_fn(|i, j| pose[4 * i + j]);
    let bias = Vector3::from_vec(comment(text, "bias of accelerometers"));
    Matrix3::from_row_slice(&file["imu0.accelerometers.M"]) * (imu_b * force) + bias
}

#[test]
fn without_a_run_noise_keys_are_comments_that_say_where_figures_come_from() {
    for format in ["kalibr", "kf-gins"] {
        let text = exported(&record(), format).0;
        let keys = yaml(&text);
        assert!(
            keys.keys()
                .all(|k| !k.contains("noise") && !k.contains("rate")),
            "{text}"
        );
        assert!(text.contains("turncal allan"));
    }
}

#[test]
fn a_calibration_in_a_unit_of_its_own_is_divided_by_that_unit() {
    let mut record = record();
    record.unit = Some(PerSensor {
        gyro: "deg/s".to_owned(),
        accel: "g".to_owned(),
    });
    record.gyro.scale = [57.2, 57.4, 57.1];
    record.accel.scale = [0.102; 3];
    let divisors = divisors(&exported(&record, "kalibr").0);
    assert_eq!(divisors[0], Vector3::repeat(180.0 / std::f64::consts::PI));
    assert_eq!(divisors[1], Vector3::repeat(1.0 / 9.80665));
}

#[test]
fn text_gives_every_value_and_sigma_by_its_name() {
    let record = with_terms(record());
    let text = exported(&record, "text").0;
    let find = |name: &str| {
        let line = text
            .lines()
            .find(|l| l.split_whitespace().next() == Some(name));
        numbers(line.unwrap_or_else(|| panic!("no {name} in {text}")))
    };
    assert_eq!(find("gyro.scale.y")[..2], [2.0598e6, 1.0]);
    assert_eq!(find("accel.installation.zx")[..2], [3e-4, 1e-6]);
    assert_eq!(find("accel.bias.x")[..2], [2860.0, 0.4]);
    assert_eq!(find("gyro.g_sensitivity.xy")[..2], [3e-7, 1e-9]);
    assert_eq!(find("table.base.up")[..2], [1e-5, 1e-9]);
    let correction = sensitivity(&record.gyro).lu().try_inverse().unwrap();
    assert!((find("gyro.correction.zy")[0] / correction[(2, 1)] - 1.0).abs() < 1e-12);
}

#[test]
fn a_record_that_is_read_and_written_again_is_the_same_to_the_bit() {
    let root = tempfile::tempdir().unwrap();
    let mut record = with_terms(record());
    record.gyro.bias = [0.1 + 0.2, 1e-300 / 3.0, -0.0];
    record.accel.scale = [f64::from_bits(0x40f8_6a01_2345_6789); 3];
    record.parameters = vec!["gyro.bias.x".to_owned()];
    record.covariance = vec![vec![1.0 / 3.0]];
    if let Some(sigma) = &mut record.sigma {
        sigma.gyro.bias[0] = (1.0f64 / 3.0).sqrt();
    }
    record.test_vectors.clear();
    record.warnings = vec!["line\nbreak \"quoted\" µ".to_owned()];
    let first = written(root.path(), "first.json", &record);
    let read = turncal_files::read_calibration(&first).unwrap();
    assert_eq!(read, record);
    let second = written(root.path(), "second.json", &read);
    assert_eq!(fs::read(&first).unwrap(), fs::read(&second).unwrap());
    assert_eq!(read.gyro.bias[2].to_bits(), (-0.0_f64).to_bits());
}

fn turncal(arguments: &[&str], directory: &Path) -> assert_cmd::assert::Assert {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    command
        .current_dir(directory)
        .arg("export")
        .args(arguments)
        .assert()
}

#[test]
fn what_a_format_does_not_hold_is_said_in_the_file_and_on_standard_error() {
    let root = tempfile::tempdir().unwrap();
    written(root.path(), "c.json", &with_terms(record()));
    for (format, lost) in [
        ("kalibr", &["biases", "sigma", "accel-second-order"][..]),
        ("kf-gins", &["misalignment", "sigma", "g-sensitivity"]),
        ("c", &["sigma", "accel-second-order, g-sensitivity"]),
        ("text", &["covariance"]),
    ] {
        let name = format!("{format}.out");
        let done = turncal(&["c.json", "--format", format, "-o", &name], root.path()).success();
        let said = String::from_utf8(done.get_output().stderr.clone()).unwrap();
        let file = fs::read_to_string(root.path().join(&name)).unwrap();
        assert_eq!(said.lines().count(), lost.len(), "{said}");
        for (line, lost) in said.lines().zip(lost) {
            assert!(
                line.starts_with("not included: ") && line.contains(lost),
                "{line}"
            );
            assert!(file.contains(line), "{line}");
        }
        let printed = turncal(&["c.json", "--format", format], root.path()).success();
        assert_eq!(printed.get_output().stdout, file.as_bytes());
    }
}

#[test]
fn wrong_use_of_export_says_what_to_do() {
    let root = tempfile::tempdir().unwrap();
    let path = written(root.path(), "c.json", &record());
    turncal(&["c.json"], root.path()).code(2);
    let wrong = turncal(&["c.json", "--format", "matlab"], root.path()).code(2);
    let said = String::from_utf8(wrong.get_output().stderr.clone()).unwrap();
    assert!(said.contains("kf-gins"), "{said}");
    turncal(&["none.json", "--format", "c"], root.path()).code(1);
    let before = fs::read(&path).unwrap();
    turncal(
        &["c.json", "--format", "c", "-o", "c.json", "--force"],
        root.path(),
    )
    .code(1);
    assert_eq!(fs::read(&path).unwrap(), before);
    let mut other = run();
    other.instrument.nominal.accel = Nominal(Vector3::repeat(1e3));
    let error = write(&record(), Format::named("kalibr").unwrap(), Some(&other)).unwrap_err();
    assert!(error.to_string().contains("accel x"), "{error}");
}
