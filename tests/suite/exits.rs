//! Calibrations as other programs hold them, evaluated by the equations of those programs.

use std::f64::consts::PI;
use std::fs;
use std::process::Command;

use nalgebra::{Matrix3, Vector3};
use turncal::calibration::result::{Calibration, TermRecord};

use crate::door::made::made_run;
use crate::export::{biases, bytes, divisors, halves, numbers, output, record, text_of, yaml};
use crate::shared::skipped;

fn exported(format: &str) -> (String, Vec<String>) {
    text_of(&record(), format, None)
}

/// Right, front, up as front, right, down, and back.
fn turned(v: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.y, v.x, -v.z)
}

/// Directions of unit length: axes, edges and corners of a cube.
fn directions() -> impl Iterator<Item = Vector3<f64>> {
    let places = (0..27).map(|k| [k / 9, k / 3 % 3, k % 3].map(|of| f64::from(of) - 1.0));
    let directions = places.map(Vector3::from).filter(|of| of.norm() > 0.0);
    directions.map(|of| of.normalize())
}

/// What the program makes of raw output is off by what its notes say: by the constant without an input, and by the
/// stated part of the input in the worst direction. Nothing is off in a triad without a note.
fn off_by_what_is_stated(
    notes: &[String],
    axes: impl Fn(Vector3<f64>) -> Vector3<f64>,
    evaluate: impl Fn([Vector3<f64>; 2]) -> [Vector3<f64>; 2],
) {
    let record = record();
    let triads = [&record.gyro, &record.accel];
    let units = [
        ("gyros:", 1e-2, 180.0 / PI * 3600.0),
        ("accelerometers:", 1e-3, 1e3 / 9.80665),
    ];
    for (k, (name, of_input, in_unit)) in units.into_iter().enumerate() {
        let error = |u: Vector3<f64>| {
            let raw = [0, 1].map(|n| if n == k { u } else { Vector3::zeros() });
            let raw = [0, 1].map(|n| axes(output(triads[n], raw[n])));
            evaluate(raw)[k] - axes(u)
        };
        let constant = error(Vector3::zeros());
        let parts = directions().map(|u| (error(u) - constant).norm());
        let worst = parts.fold(0.0, f64::max);
        let constant = constant.amax() * in_unit;
        let Some(note) = notes.iter().find(|note| note.starts_with(name)) else {
            assert!(
                worst < 1e-12 && constant < 1e-6,
                "{name} {worst} {constant}"
            );
            continue;
        };
        let [_, _, stated, _, stated_constant] = numbers(note)[..] else {
            panic!("{note}");
        };
        let ratio = worst / (stated * of_input);
        assert!((0.9..1.01).contains(&ratio), "{note}: {worst}");
        assert!(
            (constant - stated_constant).abs() < 1e-3,
            "{note}: {constant}"
        );
    }
}

fn autopilot(
    format: &'static str,
    [gyro, accel]: [&str; 2],
    words: [&str; 2],
    separator: char,
    name_at: usize,
) {
    let (text, notes) = exported(format);
    let value = |name: String| -> f64 {
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let line = lines
            .find(|line| line.split(separator).nth(name_at) == Some(&name))
            .unwrap();
        let value: f32 = line
            .split(separator)
            .nth(name_at + 1)
            .unwrap()
            .parse()
            .unwrap();
        f64::from(value)
    };
    let triple = |pattern: &str, what: &str| {
        let named = |axis| pattern.replace('#', axis).replace('@', what);
        Vector3::from(["X", "Y", "Z"].map(|axis| value(named(axis))))
    };
    let offset = [triple(gyro, words[0]), triple(accel, words[0])];
    let scale = triple(accel, words[1]);
    // The divisors are magnitudes in the file's order.
    let divisors = divisors(&text);
    off_by_what_is_stated(&notes, turned, |n| {
        let n = [0, 1].map(|k| n[k].component_div(&divisors[k]));
        [n[0] - offset[0], (n[1] - offset[1]).component_mul(&scale)]
    });
    // Biases and scales of accelerometers as well as 32 bits hold them.
    let accel = notes
        .iter()
        .find(|note| note.starts_with("accelerometers:"));
    let figures = numbers(accel.unwrap());
    assert_eq!([figures[0], figures[4]], [0.0; 2]);
    assert!(
        notes
            .iter()
            .any(|note| note.contains("ppm in scale") && note.contains("deg/s at 100 deg/s"))
    );
}

#[test]
fn px4_gives_the_test_vectors_but_for_what_its_file_states() {
    autopilot(
        "px4",
        ["CAL_GYRO0_#@", "CAL_ACC0_#@"],
        ["OFF", "SCALE"],
        '\t',
        2,
    );
}

#[test]
fn ardupilot_gives_the_test_vectors_but_for_what_its_file_states() {
    autopilot(
        "ardupilot",
        ["INS_GYR@_#", "INS_ACC@_#"],
        ["OFFS", "SCAL"],
        ',',
        0,
    );
}

/// OpenVINS' correction, by the triangle that its model reads.
fn open_vins(text: &str, is_lower: bool, n: [Vector3<f64>; 2]) -> [Vector3<f64>; 2] {
    assert!(text.starts_with("%YAML:1.0\n"));
    let file = yaml(text.strip_prefix("%YAML:1.0").unwrap());
    let matrix = |key: &str| Matrix3::from_row_slice(&file[&format!("imu0.{key}")]);
    let triangle = |key: &str| {
        let mut inverse = matrix(key).try_inverse().unwrap();
        if is_lower {
            inverse.fill_upper_triangle(0.0, 1)
        } else {
            inverse.fill_lower_triangle(0.0, 1)
        }
        inverse
    };
    let [bias_gyro, bias_accel] = biases(text);
    let force = matrix("R_IMUtoACC").transpose() * triangle("Ta") * (n[1] - bias_accel);
    let rate = n[0] - matrix("Tg") * force - bias_gyro;
    [
        matrix("R_IMUtoGYRO").transpose() * triangle("Tw") * rate,
        force,
    ]
}

#[test]
fn open_vins_gives_the_test_vectors_in_both_models_and_takes_g_sensitivity_out() {
    let mut record = record();
    for (name, value) in [("xy", 3e-7), ("zz", -2e-7)] {
        let term = TermRecord {
            value,
            sigma: Some(1e-9),
        };
        record
            .terms
            .insert(format!("gyro.g_sensitivity.{name}"), term);
    }
    for (format, is_lower) in [("open-vins-kalibr", true), ("open-vins-rpng", false)] {
        let text = text_of(&record, format, None).0;
        let divisors = divisors(&text);
        for vector in &record.test_vectors {
            let [rate, force] = halves(&vector.calibrated);
            let sensed = rate + Vector3::new(3e-7 * force.y, 0.0, -2e-7 * force.z);
            let raw = [output(&record.gyro, sensed), output(&record.accel, force)];
            let found = open_vins(
                &text,
                is_lower,
                [0, 1].map(|k| raw[k].component_div(&divisors[k])),
            );
            for (found, expected) in found.iter().zip([rate, force]) {
                assert!(
                    (found - expected).norm() <= 1e-12 * (1.0 + expected.norm()),
                    "{found} {expected}"
                );
            }
        }
    }
}

#[test]
fn imu_calib_gives_the_specific_force_of_the_test_vectors() {
    let (text, notes) = exported("imu-calib");
    let file = yaml(&text);
    let matrix = Matrix3::from_row_slice(&file["SM"]);
    let bias = Vector3::from_column_slice(&file["bias"]);
    let divisors = divisors(&text);
    off_by_what_is_stated(
        &notes,
        |v| v,
        |n| {
            let n = [0, 1].map(|k| n[k].component_div(&divisors[k]));
            // The gyros' mean at rest is their bias here.
            let gyro = Vector3::from(record().gyro.bias).component_div(&divisors[0]);
            [n[0] - gyro, matrix * n[1] - bias]
        },
    );
}

#[test]
fn noise_goes_out_as_a_variance_a_sample() {
    let run = made_run("made");
    let record = Calibration {
        unit: Some(run.instrument.unit.clone()),
        gyro: turncal::calibration::result::TriadRecord {
            scale: [1.0; 3],
            installation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            bias: [0.0; 3],
        },
        accel: turncal::calibration::result::TriadRecord {
            scale: [1.0; 3],
            installation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            bias: [0.0; 3],
        },
        ..record()
    };
    let text = text_of(&record, "ros-covariance", Some(&run)).0;
    let file = yaml(&text);
    let (gyro, accel) = (run.instrument.noise.gyro, run.instrument.noise.accel);
    for (key, density) in [
        ("angular_velocity_covariance", gyro.random_walk),
        ("linear_acceleration_covariance", accel.random_walk),
    ] {
        // A density of 1 unit/√Hz sampled at 128 Hz has a standard deviation of √128.
        let variance = (density * 128f64.sqrt()).powi(2);
        let expected: Vec<f64> = (0..9)
            .map(|k| if k % 4 == 0 { variance } else { 0.0 })
            .collect();
        let off = file[key].iter().zip(&expected).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-12 * variance, "{key}");
    }
}

#[test]
fn betaflight_takes_whole_counts_off_and_leaves_what_its_file_states() {
    let (text, notes) = exported("betaflight");
    let line = text
        .lines()
        .find(|line| line.starts_with("set acc_calibration = "))
        .unwrap();
    let counts: Vec<i64> = line["set acc_calibration = ".len()..]
        .split(',')
        .map(|c| c.parse().unwrap())
        .collect();
    assert_eq!(counts[3], 1);
    let per_g = 2048.0 / 9.80665;
    let divisors = divisors(&text);
    off_by_what_is_stated(
        &notes,
        |v| v,
        |n| {
            let n = [0, 1].map(|k| n[k].component_div(&divisors[k]));
            let counted =
                n[1] * per_g - Vector3::new(counts[0], counts[1], counts[2]).map(|c| c as f64);
            [n[0], counted / per_g]
        },
    );
    // Half a count of 2048 per g, but for the matrix, which is near one.
    let accel = notes
        .iter()
        .find(|note| note.starts_with("accelerometers:"));
    assert!(numbers(accel.unwrap())[4] <= 0.51e3 / 2048.0);
}

#[test]
fn a_matlab_structure_gives_the_test_vectors_in_scipy() {
    let (binary, _) = bytes(&record(), "mat", None);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("calibration.mat");
    fs::write(&path, binary).unwrap();
    let raw: Vec<[f64; 6]> = record()
        .test_vectors
        .iter()
        .map(|vector| vector.raw)
        .collect();
    let script = format!(
        "from scipy.io import loadmat
c = loadmat({path:?}, simplify_cells=True)['turncal']
assert c['equation'].startswith('N = '), c['equation']
assert c['gyro']['sigma']['bias'].shape == (3,)
for n in {raw:?}:
    for t, k in (('gyro', 0), ('accel', 3)):
        print(*(c[t]['correction'] @ (n[k:k + 3] - c[t]['bias'])))
        a = (c[t]['scale'][:, None] * c[t]['installation'])
        assert abs(a @ c[t]['correction'] - [[1, 0, 0], [0, 1, 0], [0, 0, 1]]).max() < 1e-12
"
    );
    let python = std::env::var("TURNCAL_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let Ok(ran) = Command::new(python).args(["-c", &script]).output() else {
        skipped("no Python");
        return;
    };
    let error = String::from_utf8_lossy(&ran.stderr);
    if error.contains("ModuleNotFoundError") {
        skipped("Python without SciPy");
        return;
    }
    assert!(ran.status.success(), "{error}");
    let said = String::from_utf8(ran.stdout).unwrap();
    let found: Vec<f64> = said
        .split_whitespace()
        .map(|word| word.parse().unwrap())
        .collect();
    let expected: Vec<f64> = record()
        .test_vectors
        .iter()
        .flat_map(|vector| vector.calibrated)
        .collect();
    for (found, expected) in found.iter().zip(&expected) {
        assert!(
            (found - expected).abs() < 1e-12 * (1.0 + expected.abs()),
            "{found} {expected}"
        );
    }
    assert_eq!(found.len(), expected.len());
}

/// The lists of numbers behind a key, outside of comments.
fn lists(text: &str, key: &str) -> Vec<Vec<f64>> {
    let lines = text.lines().map(str::trim_start);
    let lines = lines.filter_map(|line| line.strip_prefix(key));
    let list = |line: &str| {
        let line = line.replace(['f', '{', '}', '[', ']', '=', ':'], " ");
        let parts = line.split(|c: char| c == ',' || c.is_whitespace());
        parts.filter_map(|part| part.parse().ok()).collect()
    };
    lines.map(list).collect()
}

#[test]
fn inav_takes_whole_counts_and_gains_and_leaves_what_its_file_states() {
    let (text, notes) = exported("inav");
    let of = |name: &str| {
        let value = |axis: &str| lists(&text, &format!("set {name}_{axis} "))[0][0];
        Vector3::from(["x", "y", "z"].map(value))
    };
    let (zero, gain, gyro_zero) = (of("acczero"), of("accgain"), of("gyro_zero"));
    let [per_g, per_rad_s] = [2048.0 / 9.80665, 16.4 * 180.0 / std::f64::consts::PI];
    let divisors = divisors(&text);
    off_by_what_is_stated(
        &notes,
        |v| v,
        |n| {
            let n = [0, 1].map(|k| n[k].component_div(&divisors[k]));
            let rate = (n[0] * per_rad_s - gyro_zero) / per_rad_s;
            let counted = (n[1] * per_g - zero).component_mul(&gain) / 4096.0;
            [rate, counted / per_g]
        },
    );
    let accel = notes
        .iter()
        .find(|note| note.starts_with("accelerometers:"));
    assert!(numbers(accel.unwrap())[0] < 2e6 / 4096.0);
}

/// librealsense, `ds-calib-parsers.cpp`, `dm_v2_imu_calib_parser::get_intrinsic`, takes the gyro bias of the table for
/// degrees per second, and `motion-transform.cpp` then subtracts it from rad/s.
#[test]
fn the_memory_of_a_realsense_gives_the_test_vectors_to_32_bits() {
    let memory = bytes(&record(), "realsense", None).0;
    assert_eq!(memory.len(), 520);
    let whole = |at: usize| u32::from_le_bytes(memory[at..at + 4].try_into().unwrap());
    // Memory, calibration and IMU table, each behind a head with its kind, size and sum.
    for (head, kind) in [(0, 0x09), (16, 0x20), (32, 0x20)] {
        let size = whole(head + 4) as usize;
        let mut sum = flate2::Crc::new();
        sum.update(&memory[head + 16..head + 16 + size]);
        assert_eq!(sum.sum(), whole(head + 12));
        assert_eq!(memory[head + 2], kind);
    }
    assert_eq!((whole(36), whole(48)), (244, 1 << 8));
    let values: Vec<f64> = (0..24)
        .map(|k| f64::from(f32::from_bits(whole(48 + 13 * 4 + 4 * k))))
        .collect();
    let text = exported("imu-calib").0;
    let divisors = divisors(&text);
    for vector in &record().test_vectors {
        for (k, at) in [(1, 0), (0, 12)] {
            let n = halves(&vector.raw)[k].component_div(&divisors[k]);
            let u = halves(&vector.calibrated)[k];
            let matrix = Matrix3::from_column_slice(&values[at..at + 9]);
            let unit = [PI / 180.0, 1.0][k];
            let bias = Vector3::from_column_slice(&values[at + 9..at + 12]) * unit;
            assert!((matrix * n - bias - u).norm() < 1e-5 * (1.0 + u.norm()));
        }
    }
}
