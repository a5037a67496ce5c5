//! `turncal export`: each format, evaluated as those evaluate it who read it.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process;

use assert_cmd::Command;
use nalgebra::{Matrix3, Vector3};
use turncal::calibration::result::{Calibration, NoiseRecord, TermRecord, TestVector, TriadRecord};
use turncal::calibration::{NoisePolicy, NoiseReport, Source, SourceFigures};
use turncal::imu::{BodyFrame, GaussMarkov, Noise, Nominal, PerSensor};
use turncal::run::Run;
use turncal::units::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, MICRO_G_PER_SQRT_HZ};
use turncal_files::export::{FORMATS, Format, write};

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

/// The numbers in the brackets of the comment with these words.
pub fn comment(text: &str, words: &str) -> Vec<f64> {
    let line = text
        .lines()
        .find(|l| l.starts_with('#') && l.contains(words));
    let line = line.unwrap_or_else(|| panic!("no `{words}` in {text}"));
    let lists = line.split('[').skip(1).filter_map(|l| l.split(']').next());
    lists.flat_map(numbers).collect()
}

/// What the comment says raw output is divided by, gyros first.
pub fn divisors(text: &str) -> [Vector3<f64>; 2] {
    halves(
        &comment(text, "raw output per second divided by")
            .try_into()
            .unwrap(),
    )
}

/// The biases of a comment, gyros first.
pub fn biases(text: &str) -> [Vector3<f64>; 2] {
    halves(&comment(text, "bias of gyroscopes").try_into().unwrap())
}

/// Kalibr's measurement model, from its file alone: angular rate and specific force along the body
/// axes of the calibration to the measured ones.
fn kalibr_measures(text: &str, rate: Vector3<f64>, force: Vector3<f64>) -> [Vector3<f64>; 2] {
    let file = yaml(text);
    let matrix = |key: &str| Matrix3::from_row_slice(&file[key]);
    let pose = &file["T_i_b"];
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
        assert!(lower.diagonal().iter().all(|&d| (d - 1.0).abs() < 0.05));
    }
    for rotation in [imu_b, gyro_imu] {
        assert!((rotation * rotation.transpose() - Matrix3::identity()).amax() < 1e-14);
        assert!((rotation.determinant() - 1.0).abs() < 1e-14);
    }
    let [bias_gyro, bias_accel] = biases(text);
    [
        m_gyro * (gyro_imu * imu_b * rate) + a * (gyro_imu * imu_b * force) + bias_gyro,
        m_accel * (imu_b * force) + bias_accel,
    ]
}

#[test]
fn kalibrs_equations_measure_the_raw_output_of_the_test_vectors() {
    let record = record();
    let text = exported(&record, "kalibr").0;
    assert!(text.contains("\nmodel: scale-misalignment\n"));
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
    assert!(text.contains(note.as_str()));
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
    assert_eq!(file["T_i_b"], identity);
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
    for vector in &record.test_vectors {
        let found = kf_gins_compensates(&text, halves(&vector.raw));
        for (k, expected) in halves(&vector.calibrated).into_iter().enumerate() {
            // Along right, front, up the misalignment is that of the record.
            let triad = [&record.gyro, &record.accel][k];
            let stays = Matrix3::from_fn(|i, j| match i == j {
                true => 0.0,
                false => triad.installation[i][j],
            });
            assert_near(found[k], expected + stays * expected);
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
    near("gyroscope_noise_density", 2e-5);
    near("gyroscope_random_walk", 4e-8);
    near("accelerometer_noise_density", 5e-5);
    near("update_rate", 128.0);
    // The run states no variation of the accelerometers' bias: three times their white noise after 100 s.
    near(
        "accelerometer_random_walk",
        3.0 * 5e-5 * (2.0 / 100.0f64).sqrt() / 10.0,
    );
    assert!(text.contains("m/s^2/s/sqrt(Hz), the value that is usual for this noise density"));
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
    let pose = &file["T_i_b"];
    let imu_b = Matrix3::from_fn(|i, j| pose[4 * i + j]);
    Matrix3::from_row_slice(&file["accelerometers.M"]) * (imu_b * force) + biases(text)[1]
}

#[test]
fn without_noise_the_keys_that_a_program_requires_are_named_and_the_file_has_none_of_them() {
    let of_kalibr = ["update_rate", "noise_density", "random_walk"];
    for (format, names) in [
        ("kalibr", &of_kalibr[..]),
        ("open-vins-kalibr", &of_kalibr),
        ("kf-gins", &["arw", "vrw", "gbstd", "abstd", "corrtime"]),
    ] {
        let (text, notes) = exported(&record(), format);
        let note = notes.iter().find(|note| note.contains("turncal allan"));
        for name in names {
            assert!(note.unwrap().contains(name), "{notes:?}");
            let keys = yaml(text.trim_start_matches("%YAML:1.0"));
            assert!(keys.keys().all(|key| !key.contains(name)), "{text}");
        }
    }
}

/// The rule by which `cv::FileStorage` reads YAML (OpenCV 4 and 5, `persistence_yml.cpp`), as far as these files need
/// it: the first line is its own, the rows of a list are indented deeper than its key, tabs are not allowed, and a text
/// without quotes includes the comment behind it. The texts of quoted keys.
fn opencv(text: &str) -> BTreeMap<String, String> {
    let text = text
        .strip_prefix("%YAML:1.0\n")
        .expect("its own first line");
    let indent = |line: &str| line.len() - line.trim_start().len();
    let (mut key_indent, mut texts) = (0, BTreeMap::new());
    for line in text
        .lines()
        .filter(|line| !line.trim_start().starts_with('#'))
    {
        assert!(!line.contains('\t'), "{line}");
        if line.trim_start().starts_with("- ") {
            assert!(indent(line) > key_indent, "Incorrect indentation: {line}");
            continue;
        }
        key_indent = indent(line);
        let (key, value) = line.trim().split_once(':').unwrap();
        let number = value.split('#').next().unwrap().trim();
        if !number.is_empty() && number.parse::<f64>().is_err() {
            let inner = value
                .trim()
                .strip_prefix('"')
                .and_then(|v| v.strip_suffix('"'));
            texts.insert(key.to_owned(), inner.expect(line).to_owned());
        }
    }
    texts
}

/// Keys below `imu0` that OpenVINS does not start without: `VioManagerOptions::print_and_load_noise`,
/// `print_and_load_state`, `StateOptions::print` (the model) and `ROS1Visualizer::setup_subscribers` (the topic).
#[test]
fn open_vins_finds_every_key_that_it_requires_in_a_file_that_opencv_reads() {
    let run = run();
    for (format, model) in [("open-vins-kalibr", "kalibr"), ("open-vins-rpng", "rpng")] {
        let text = text_of(&record(), format, Some(&run)).0;
        let texts = opencv(&text);
        assert_eq!(
            (texts["model"].as_str(), texts["rostopic"].as_str()),
            (model, "/imu0")
        );
        let file = yaml(text.strip_prefix("%YAML:1.0").unwrap());
        for (key, count) in [
            ("gyroscope_noise_density", 1),
            ("gyroscope_random_walk", 1),
            ("accelerometer_noise_density", 1),
            ("accelerometer_random_walk", 1),
            ("Tw", 9),
            ("Ta", 9),
            ("R_IMUtoACC", 9),
            ("R_IMUtoGYRO", 9),
            ("Tg", 9),
        ] {
            let values = &file[&format!("imu0.{key}")];
            assert_eq!(values.len(), count, "{key}");
            assert!(count == 9 || values[0] > 0.0, "{key}");
        }
    }
}

/// Kalibr, `kalibr_common/ConfigReader.py`, `ImuParameters`: a topic, which is a text, and rate, noise densities and
/// random walks above zero, as keys of the file itself.
#[test]
fn kalibr_reads_topic_rate_and_noise_of_one_imu_at_the_top_of_the_file() {
    let text = text_of(&record(), "kalibr", Some(&run())).0;
    assert!(text.contains("\nrostopic: \"/imu0\"\n"), "{text}");
    let file = yaml(&text);
    for key in [
        "update_rate",
        "accelerometer_noise_density",
        "accelerometer_random_walk",
        "gyroscope_noise_density",
        "gyroscope_random_walk",
    ] {
        assert!(
            matches!(file[key][..], [value] if value > 0.0),
            "{key}: {text}"
        );
    }
    // PyYAML reads a number as a text unless it has a point and its exponent a sign.
    for number in text
        .split_whitespace()
        .filter(|word| word.parse::<f64>().is_ok())
    {
        let is_float = number.contains('.') && number.contains(['+', '-']);
        assert!(is_float || !number.contains('e'), "{number}");
    }
}

#[test]
fn kalibr_measures_along_the_axes_of_the_log() {
    let root = tempfile::tempdir().unwrap();
    let rows: String = (0..400)
        .map(|k| format!("{:?},0.01,0.02,0.03,0.1,0.2,-9.8\n", 0.01 * f64::from(k)))
        .collect();
    fs::write(
        root.path().join("imu.csv"),
        format!("t,p,q,r,a,b,c\n{rows}"),
    )
    .unwrap();
    let toml = "format = \"turncal-run/1\"
[site]
latitude_deg = 48
height_m = 200
[imu]
file = \"imu.csv\"
output = \"rate\"
gyro_unit = \"rad/s\"
accel_unit = \"m/s^2\"
body_axes = \"frd\"
time_stamp = \"end\"
columns = { time = \"t\", gyro = [\"p\", \"q\", \"r\"], accel = [\"a\", \"b\", \"c\"] }
[imu.noise]
angle_random_walk_deg_per_sqrt_h = 0.3
velocity_random_walk_ug_per_sqrt_hz = 150.0
";
    fs::write(root.path().join("run.toml"), toml).unwrap();
    let run = turncal_files::read_run(&root.path().join("run.toml")).unwrap();
    let mut record = record();
    record.unit = Some(run.instrument.unit.clone());
    for (triad, scale) in [(&mut record.gyro, 2e6), (&mut record.accel, 1e5)] {
        triad.scale = triad.scale.map(|of| of / scale);
        triad.bias = triad.bias.map(|of| of / scale);
    }
    let text = text_of(&record, "kalibr", Some(&run)).0;
    assert!(text.contains("along front, right, down"), "{text}");
    let to_log = |v: Vector3<f64>| Vector3::new(v.y, v.x, -v.z);
    for input in INPUTS {
        let [rate, force] = halves(&input);
        let raw = [output(&record.gyro, rate), output(&record.accel, force)].map(to_log);
        let [gyro, accel] = kalibr_measures(&text, to_log(rate), to_log(force));
        assert_near(gyro, raw[0]);
        assert_near(accel, raw[1]);
    }
}

/// A calibration whose report holds these figures in deg/√h, deg/h and µg/√Hz.
fn with_noise(arw: [f64; 3], vrw: [f64; 3], bias: [f64; 3]) -> Calibration {
    let source = |source: Source, [used, low, high]: [f64; 3]| SourceFigures {
        source,
        name: source.name().to_owned(),
        unit: source.unit().0.to_owned(),
        stated: None,
        used,
        interval: Some([low, high]),
    };
    let sources = vec![
        source(Source::AngleRandomWalk, arw),
        source(Source::VelocityRandomWalk, vrw),
        source(Source::GyroGaussMarkov, bias),
    ];
    let report = NoiseReport {
        policy: NoisePolicy::default(),
        learnt: true,
        test: None,
        sources,
    };
    Calibration {
        noise: Some(NoiseRecord {
            report,
            run_toml: None,
        }),
        ..record()
    }
}

#[test]
fn a_refuted_figure_gives_way_to_the_calibrations_and_one_that_agrees_stays() {
    // The run states 2e-5 rad/√s, which is 0.069 °/√h, 5e-5 (m/s)/√s, which is 5.1 µg/√Hz, and 4e-7 rad/s.
    let record = with_noise([0.3, 0.2, 0.4], [6.0, 5.0, 7.0], [2.0, 1.0, 3.0]);
    let of = |format, run: Option<&Run>| yaml(&text_of(&record, format, run).0);
    let near = |found: f64, expected: f64| {
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    };
    let (run, arw, bias) = (run(), 0.3 * DEG_PER_SQRT_H, 2.0 * DEG_PER_H);
    let file = of("kalibr", Some(&run));
    near(file["gyroscope_noise_density"][0], arw);
    near(file["accelerometer_noise_density"][0], 5e-5);
    near(file["gyroscope_random_walk"][0], bias * 0.1);
    near(of("kf-gins", Some(&run))["imunoise.arw"][0], 0.3);
    let variance = of("ros-covariance", Some(&run));
    near(
        variance["angular_velocity_covariance"][0],
        arw * arw * 128.0,
    );
    // Without a run, the calibration's figures are all there are.
    let file = of("kalibr", None);
    near(file["gyroscope_noise_density"][0], arw);
    near(
        file["accelerometer_noise_density"][0],
        6.0 * MICRO_G_PER_SQRT_HZ,
    );
}

#[test]
fn the_user_learns_which_identities_px4_wants_and_which_trims_a_log_must_not_have() {
    for (format, words) in [
        ("px4", &["CAL_GYRO0_ID", "CAL_ACC0_ID", "device_id"][..]),
        ("betaflight", &["recorded with acc_calibration = 0,0,0,0"]),
        (
            "inav",
            &[
                "recorded with acczero and gyro_zero = 0",
                "accgain = 4096",
                "init_gyro_cal = OFF",
            ],
        ),
    ] {
        let text = exported(&record(), format).0;
        let comments: Vec<&str> = text.lines().filter(|line| line.starts_with('#')).collect();
        for words in words {
            assert!(
                comments.iter().any(|line| line.contains(words)),
                "{format}: {text}"
            );
        }
    }
}

#[test]
fn no_export_has_more_than_six_lines_of_comments() {
    let mut record = with_terms(record());
    for name in ["instrument", "serial", "notes", "operator"] {
        record.meta.insert(name.to_owned(), "two\nlines".to_owned());
    }
    record.warnings = vec!["W07".to_owned(); 9];
    let run = run();
    for format in &FORMATS {
        for run in [None, Some(&run)] {
            let text = String::from_utf8_lossy(&bytes(&record, format.name, run).0).into_owned();
            let lines = text.lines().map(str::trim_start);
            let comments = lines.filter(|line| {
                line.starts_with("//") || line.starts_with('#') && format.name != "c"
            });
            let count = comments.count();
            let is_binary = ["mat", "realsense"].contains(&format.name);
            assert!(
                is_binary || (1..=6).contains(&count),
                "{}: {text}",
                format.name
            );
        }
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
        (
            "kalibr",
            &[
                "biases",
                "rostopic",
                "sigma",
                "update_rate",
                "accel-second-order",
            ][..],
        ),
        (
            "kf-gins",
            &["misalignment", "sigma", "gsstd", "arw", "g-sensitivity"],
        ),
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
            assert!(
                file.contains(line.trim_start_matches("not included: ")),
                "{line}"
            );
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
