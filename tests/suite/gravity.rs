//! Gravity at rest alone: still files, tables of means, and logs without gyros.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;
use turncal::calibration::{
    Method, Options, PARAMETERS, Problem, UNWATCHED, from_vector, sensor_and_parameter, to_vector,
};
use turncal::earth::Site;
use turncal::imu::{GaussMarkov, Instrument, Noise, PerSensor, Prior, Sensor};
use turncal::recording::Recording;
use turncal::run::{Aiding, Run};
use turncal::simulation::Scenario;
use turncal::units::{DEGREE, MICRO_G};
use turncal_files::Opened;
use turncal_files::draft::Stated;

use crate::shared::shared;

/// Accelerometer K and D, m/s², of the rebuilt logs.
const TRUTH: [[f64; 3]; 2] = [[1.008, 0.994, 1.015], [0.12, -0.2, 0.31]];
const FACES: [&str; 6] = [
    "x_up.txt",
    "x_down.txt",
    "y_up.txt",
    "y_down.txt",
    "z_up.txt",
    "z_down.txt",
];

fn turncal(arguments: &[&str], files: &[PathBuf]) -> std::process::Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    command.arg("calibrate").args(files).args(arguments);
    command.output().unwrap()
}

/// The calibration in JSON, and what is said on standard error.
fn calibrated(arguments: &[&str], files: &[PathBuf]) -> (Value, String) {
    let output = turncal(&[arguments, &["--json"]].concat(), files);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    (serde_json::from_slice(&output.stdout).unwrap(), said)
}

fn faces() -> Option<Vec<PathBuf>> {
    let directory = shared("field/c10-six-files-mti")?;
    Some(FACES.map(|face| directory.join(face)).to_vec())
}

/// K and D of the accelerometers are the truth within their σ and these limits, and six parameters are determined.
fn assert_true(result: &Value, [scale, bias]: [f64; 2]) {
    assert_eq!(result["verdict"]["word"], "partial");
    for (of, kind, limit) in [(0, "scale", scale), (1, "bias", bias)] {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let number = |value: &Value| value["accel"][kind][axis].as_f64().unwrap();
            let (off, sigma) = (number(result) - TRUTH[of][axis], number(&result["sigma"]));
            assert!(
                off.abs() < 4.0 * sigma && off.abs() < limit,
                "{kind} {axis}: {off} ± {sigma}"
            );
            let name = Value::from(format!("accel.{kind}.{name}"));
            assert!(result["parameters"].as_array().unwrap().contains(&name));
        }
    }
}

#[test]
fn six_still_files_are_one_recording_and_give_scale_and_bias() {
    let Some(files) = faces() else { return };
    let (result, said) = calibrated(&["--gravity", "9.809"], &files);
    assert!(
        said.contains("treats the logs as one recording of one sensor"),
        "{said}"
    );
    assert_true(&result, [3e-4, 150.0 * MICRO_G]);
    let inputs = result["provenance"]["inputs"].as_array().unwrap();
    assert_eq!(inputs.len(), 6);
    // The unit of the gyros is not told, and is asked for.
    assert!(
        said.contains("left out") && said.contains("--gyro-unit"),
        "{said}"
    );
    let (result, _) = calibrated(&["--gravity", "9.809", "--gyro-unit", "rad/s"], &files);
    assert_true(&result, [3e-4, 150.0 * MICRO_G]);
    assert!((result["gyro"]["bias"][0].as_f64().unwrap() / DEGREE - 0.8).abs() < 0.02);
    let lot = turncal(&["--lot", "--json"], &files);
    let said = String::from_utf8_lossy(&lot.stderr);
    assert!(said.contains("6 of 6 units were not calibrated"), "{said}");
}

#[test]
fn names_of_files_are_labels_and_a_wrong_one_is_named() {
    let Some(files) = faces() else { return };
    let directory = tempfile::tempdir().unwrap();
    let copied: Vec<PathBuf> = FACES
        .iter()
        .map(|face| directory.path().join(face))
        .collect();
    for (file, copy) in files.iter().zip(&copied) {
        std::fs::copy(file, copy).unwrap();
    }
    std::fs::copy(&files[0], &copied[2]).unwrap();
    let (result, _) = calibrated(&[], &copied);
    let findings = result["findings"].to_string();
    assert!(findings.contains("The labels contradict"), "{findings}");
}

#[test]
fn files_laid_end_to_end_are_read_over_the_names_between_them() {
    let Some(files) = faces() else { return };
    let directory = tempfile::tempdir().unwrap();
    let joined = directory.path().join("all.txt");
    let all: Vec<u8> = files
        .iter()
        .flat_map(|file| std::fs::read(file).unwrap())
        .collect();
    std::fs::write(&joined, all).unwrap();
    for unit in [&[][..], &["--gyro-unit", "rad/s"]] {
        let arguments = [&["--gravity", "9.809"], unit].concat();
        let (result, _) = calibrated(&arguments, std::slice::from_ref(&joined));
        assert_true(&result, [3e-4, 150.0 * MICRO_G]);
        let findings = result["findings"].to_string();
        assert!(findings.contains("no row like the others"), "{findings}");
    }
}

#[test]
fn six_means_and_a_log_without_gyros_give_scale_and_bias() {
    for (case, file) in [
        ("c26-six-means", "means.csv"),
        ("c29-accelerometers-only", "acc.csv"),
    ] {
        let Some(directory) = shared(&format!("field/{case}")) else {
            continue;
        };
        let files = [directory.join(file)];
        let (result, _) = calibrated(&["--gravity", "9.809"], &files);
        assert_true(&result, [1.5e-4, 60.0 * MICRO_G]);
        let target = tempfile::tempdir().unwrap();
        let target = target.path().join("result");
        let output = turncal(
            &["--gravity", "9.809", "-o", target.to_str().unwrap()],
            &files,
        );
        let shown = String::from_utf8_lossy(&output.stdout);
        assert!(
            shown.contains("no gyros; accelerometers: 6 of 9 (K, D)"),
            "{shown}"
        );
    }
}

#[test]
fn an_offset_of_half_a_g_is_no_scale() {
    let Some(directory) = shared("field/c27-big-offset") else {
        return;
    };
    let files = [directory.join("imu.txt")];
    let (result, _) = calibrated(&["--gravity", "9.809", "--gyro-unit", "deg/s"], &files);
    let bias = result["accel"]["bias"][2].as_f64().unwrap();
    assert!((bias - 4.95).abs() < 1e-3, "{bias}");
    let scale = result["accel"]["scale"][2].as_f64().unwrap();
    assert!((scale - 1.015).abs() < 6e-4, "{scale}");
}

#[test]
fn real_faces_give_the_biases_of_their_pairs() {
    let Some(directory) = shared("field/r01-mpu6050-six-files") else {
        return;
    };
    for (run, wrong) in [("run_five.toml", false), ("run_wrong.toml", true)] {
        let (result, _) = calibrated(&[], &[directory.join(run)]);
        // Half sums of the pairs of faces, of 1670.7 counts for one m/s².
        for (axis, pair) in [35.996e-3, -1.075e-3].into_iter().enumerate() {
            let of = |value: &Value| value["accel"]["bias"][axis].as_f64().unwrap() / 16384.0;
            let (bias, sigma) = (of(&result), of(&result["sigma"]));
            assert!(
                (bias - pair).abs() < sigma.hypot(1.9e-3),
                "{bias} ± {sigma} g"
            );
        }
        let names = |of: &str| result[of].to_string();
        let of_z = result["sigma"]["accel"]["bias"][2].as_f64().unwrap();
        // One face tells scale and bias of its axis only together.
        assert!(
            of_z > 100.0 && !names("parameters").contains("gyro.scale"),
            "{of_z} counts"
        );
        assert_eq!(names("findings").contains("The labels contradict"), wrong);
    }
}

/// Means in positions with these directions up, of an instrument with this prior σ of angles.
struct Simulated {
    up: Vec<Vector3<f64>>,
    angles: f64,
}

const SIGMA: f64 = 200.0 * MICRO_G;
const GRAVITY: (f64, f64) = (9.81, 1e-3);

impl Simulated {
    fn instrument(&self) -> Instrument {
        let prior = |bias: f64| Prior {
            scale_sigma: Vector3::repeat(0.01),
            installation_sigma: Vector3::repeat(self.angles),
            bias: Vector3::zeros(),
            bias_sigma: Vector3::repeat(bias),
        };
        let varies = |sigma: f64| Noise {
            random_walk: sigma,
            gauss_markov: Some(GaussMarkov {
                sigma,
                correlation_time: 1e-3,
            }),
        };
        let prior = PerSensor {
            gyro: prior(0.01),
            accel: prior(0.3),
        };
        let noise = PerSensor {
            gyro: varies(1e-4),
            accel: varies(SIGMA),
        };
        Instrument::new(prior, noise)
    }

    /// Squared errors over σ², of K, E and D of the accelerometers.
    fn squares(&self, rng: &mut ChaCha8Rng) -> [[f64; 2]; 3] {
        let mut draw = || -> f64 { StandardNormal.sample(rng) };
        let site = Site::unknown().with_gravity(GRAVITY.0, GRAVITY.1);
        let instrument = self.instrument();
        let run = |accel: Vec<Vector3<f64>>| {
            let gyro = vec![Vector3::zeros(); accel.len()];
            let mut recording = Recording::from_samples("made", 0.0, 1.0, gyro, accel).unwrap();
            recording.imu.continuous = false;
            Run::new(recording, instrument.clone(), site)
        };
        let prior = Problem::new(&run(vec![Vector3::z()]), &Options::default()).model;
        let truth = prior.prior_mean + prior.prior_sigma.map(|sigma| sigma * draw());
        let triad = from_vector(prior.form, &truth).accel;
        let gravity = GRAVITY.0 + GRAVITY.1 * draw();
        let means = self.up.iter().map(|up| {
            let tilt = Vector3::from_fn(|_, _| DEGREE * draw());
            let force = UnitQuaternion::new(tilt) * up.normalize() * gravity;
            let noise = Vector3::from_fn(|_, _| SIGMA * draw());
            triad.output(&force) + noise
        });
        let run = run(means.collect());
        let problem = Problem::new(&run, &Options::default());
        let solution = problem.solve(Method::Ekf, UNWATCHED).unwrap();
        let estimate = solution.estimate();
        let off = to_vector(&estimate.triads) - truth;
        let mut sums = [[0.0; 2]; 3];
        for k in estimate.estimated().filter(|&k| k < PARAMETERS) {
            let (sensor, of_triad) = sensor_and_parameter(k);
            if sensor == Sensor::Accel {
                let [sum, count] = &mut sums[kind(of_triad)];
                *sum += off[k].powi(2) / estimate.covariance[(k, k)];
                *count += 1.0;
            }
        }
        sums
    }
}

/// K, E or D.
fn kind(of_triad: usize) -> usize {
    match of_triad {
        0..3 => 0,
        3..9 => 1,
        _ => 2,
    }
}

fn rows(of: &Matrix3<f64>) -> Vec<Vector3<f64>> {
    of.row_iter()
        .flat_map(|row| [row.transpose(), -row.transpose()])
        .collect()
}

#[test]
fn sigma_of_faces_and_of_nine_attitudes_are_true() {
    let edges = [[1.0, 1.0, 0.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0]].map(Vector3::from);
    let faces = rows(&Matrix3::identity());
    let nine = [&faces[..], &edges].concat();
    for (up, angles) in [
        (faces, 0.3 * DEGREE),
        (nine.clone(), 0.3 * DEGREE),
        (nine, 2.0 * DEGREE),
    ] {
        let made = Simulated { up, angles };
        let mut rng = ChaCha8Rng::seed_from_u64(58);
        let mut sums = [[0.0; 2]; 3];
        for _ in 0..300 {
            for (sum, of) in sums.iter_mut().zip(made.squares(&mut rng)) {
                *sum = [sum[0] + of[0], sum[1] + of[1]];
            }
        }
        let means = sums.map(|[sum, count]| sum / count);
        println!(
            "{} positions, {:.1}°: {means:.2?}",
            made.up.len(),
            angles / DEGREE
        );
        assert!(
            means.iter().all(|mean| (0.8..1.2).contains(mean)),
            "{means:?}"
        );
    }
}

#[test]
fn a_table_that_is_no_table_of_means_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let refused = |text: &str| {
        let file = directory.path().join("table.csv");
        std::fs::write(&file, text).unwrap();
        let output = turncal(&["--json"], &[Path::new(&file).to_owned()]);
        assert_eq!(output.status.code(), Some(1), "{text}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let said = refused("t,ax,ay,az\n0.1,0,0,9.8\n0.2,0,0,9.8\n0.3,0,0,9.8\n");
    assert!(
        said.contains("only 3 rows") && said.contains("means"),
        "{said}"
    );
    refused("a,b\n1,2\n");
    refused("ax,ay,az\n0,0,0\n0,0,0\n");
}

#[test]
fn full_turns_of_a_log_without_gyros_are_no_dwell() {
    let imu = Scenario::load("nine-axis")
        .unwrap()
        .simulate(1, 0)
        .unwrap()
        .run
        .recording
        .imu;
    let mut text = "t,ax,ay,az\n".to_owned();
    for (k, sample) in imu.accel.iter().enumerate() {
        let [x, y, z] = <[f64; 3]>::from(sample / imu.period);
        writeln!(
            text,
            "{:.2},{x:.6},{y:.6},{z:.6}",
            (k + 1) as f64 * imu.period
        )
        .unwrap();
    }
    let directory = tempfile::tempdir().unwrap();
    let log = directory.path().join("accel.csv");
    std::fs::write(&log, text).unwrap();
    let run = Opened::new(&log, None, &Stated::default(), |_| ())
        .unwrap()
        .run;
    let dwells = run.dwells(Aiding::Velocity);
    assert!(dwells.len() > 10, "{}", dwells.len());
    let second = (1.0 / imu.period).round() as usize;
    for dwell in dwells {
        let mean = dwell.force(&run);
        for first in dwell
            .samples
            .clone()
            .step_by(second)
            .take(dwell.samples.len() / second)
        {
            let part = run.recording.imu.accel.sum(first..first + second);
            // White noise of 1 s is below 1 mm/s², and a turn changes gravity by m/s².
            assert!(
                (part - mean).norm() < 0.05,
                "{:?} {part} {mean}",
                dwell.samples
            );
        }
    }
}
