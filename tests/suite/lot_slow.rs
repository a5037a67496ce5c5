//! What takes long: a lot of fifty units, a killed lot, parts of studies, a cluster.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use serde_json::Value;
use turncal::calibration::{Group, in_general_form, to_vector};
use turncal::simulation::Scenario;
use turncal::units::DEG_PER_SQRT_H;
use turncal_files::write_run;

use super::lot::{on_threads, same, turncal, words};
use super::shared::skipped;

const UNITS: u64 = 50;
/// Noise of one gyro, output of one gyro by a wrong part, a log cut off.
const NOISY: u64 = 11;
const SCALED: u64 = 23;
const CUT: u64 = 37;
/// One part in a hundred, where units of the lot differ by ± 2500 ppm.
const WRONG: f64 = 0.01;

/// A lot of the demo's instruments; gives the true parameters of each.
fn simulated(here: &Path) -> Vec<turncal::calibration::ParameterVector> {
    let scenario = Scenario::load("demo").unwrap();
    let walk = scenario.instrument.noise.gyro.random_walk;
    assert!((walk / DEG_PER_SQRT_H - 0.001).abs() < 1e-9);
    let unit = |unit: u64| {
        let made = scenario.simulate(15, unit).unwrap();
        let mut run = made.run;
        let imu = &mut run.recording.imu;
        if unit == NOISY {
            // Beside what is there, so that all is five times as much.
            let sigma = 24f64.sqrt() * walk * imu.period.sqrt();
            let mut rng = ChaCha8Rng::seed_from_u64(3);
            let more = Normal::new(0.0, sigma).unwrap();
            imu.gyro
                .to_mut()
                .iter_mut()
                .for_each(|of| of.x += more.sample(&mut rng));
        }
        if unit == SCALED {
            let factor = Vector3::new(1.0, 1.0 + WRONG, 1.0);
            imu.gyro
                .to_mut()
                .iter_mut()
                .for_each(|of| of.component_mul_assign(&factor));
        }
        run.recording
            .meta
            .insert("serial".to_owned(), format!("A-{unit}"));
        let directory = here.join(format!("lot/u{unit:02}"));
        fs::create_dir_all(&directory).unwrap();
        write_run(&directory, &run, scenario.output, None).unwrap();
        if unit == CUT {
            let log = directory.join("imu.csv.gz");
            let whole = fs::read(&log).unwrap();
            fs::write(log, &whole[..2 * whole.len() / 3]).unwrap();
        }
        to_vector(&in_general_form(&made.truth))
    };
    (0..UNITS).map(unit).collect()
}

fn calibrate<'a>(runs: &'a [String], output: &'a str) -> Vec<&'a str> {
    let runs = runs.iter().map(String::as_str);
    std::iter::once("calibrate")
        .chain(runs)
        .chain(["-o", output])
        .collect()
}

/// Begins the command, ends it by force after a while, and says whether it was done before.
fn killed_after(here: &Path, arguments: &[&str], after: Duration) -> bool {
    let mut child = Command::new(env!("CARGO_BIN_EXE_turncal"))
        .current_dir(here)
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    sleep(after);
    let done = child.try_wait().unwrap().is_some();
    let _ = child.kill();
    child.wait().unwrap();
    done
}

#[test]
#[ignore = "slow: fifty units twice, ended by force ten times"]
fn three_wrong_units_of_fifty_are_named_and_a_killed_lot_comes_to_the_same_bytes() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let truth = simulated(here);
    let runs: Vec<String> = (0..UNITS)
        .map(|k| format!("lot/u{k:02}/run.toml"))
        .collect();
    let begun = Instant::now();
    let made = turncal(here, &calibrate(&runs, "whole"));
    let taken = begun.elapsed();
    println!("{UNITS} units in {:.1} s", taken.as_secs_f64());
    assert_eq!(made.status.code(), Some(1), "{}", words(&made));

    let said = fs::read(here.join("whole/lot.json")).unwrap();
    let said: Value = serde_json::from_slice(&said).unwrap();
    for (place, unit) in said["units"].as_array().unwrap().iter().enumerate() {
        let apart: Vec<&str> = unit["apart"]
            .as_array()
            .unwrap()
            .iter()
            .filter_map(Value::as_str)
            .collect();
        let expected: &[&str] = match place as u64 {
            NOISY => &["gyro.noise.x"],
            SCALED => &["gyro.scale.y"],
            _ => &[],
        };
        assert_eq!(apart, expected, "{}", unit["name"]);
        assert_eq!(
            unit["failure"].is_string(),
            place as u64 == CUT,
            "{}",
            unit["failure"]
        );
    }
    // The spread that is claimed is that of the units' true values, within what the claimed σ of it leaves.
    let quantities = said["quantities"].as_array().unwrap();
    let mut pull = Vec::new();
    let of_all = |index: usize| -> Vec<f64> { truth.iter().map(|of| of[index]).collect() };
    for index in 0..turncal::calibration::PARAMETERS {
        let of_units = of_all(index);
        let name = turncal::calibration::parameter_name(Default::default(), index).unwrap();
        let found = quantities
            .iter()
            .find(|q| q["name"] == name.as_str())
            .unwrap();
        let used = (0..UNITS).filter(|k| *k != CUT && !(*k == SCALED && name == "gyro.scale.y"));
        let values: Vec<f64> = used.map(|k| of_units[k as usize]).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
        let true_spread =
            (squares / (values.len() - 1) as f64).sqrt() / Group::of(index).unit_value();
        let of = |key: &str| found[key].as_f64().unwrap();
        let [low, high] = [0, 1].map(|k| found["spread_interval"][k].as_f64().unwrap());
        let width = high - low;
        // Both are of the same units: they differ by the units' own σ alone, a part of the spread's σ.
        assert!((of("spread") - true_spread).abs() < 0.025 * width, "{name}");
        assert!(found["spread_is_real"].as_bool().unwrap(), "{name}");
        pull.push(of("spread") / true_spread - 1.0);
    }
    let largest = pull.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    println!("spread over that of the truth: within {largest:.1e}");

    let moments = 10;
    for moment in 1..=moments {
        let after = taken.mul_f64(f64::from(moment) / f64::from(2 * moments));
        killed_after(here, &calibrate(&runs, "killed"), after);
    }
    assert_eq!(
        turncal(here, &calibrate(&runs, "killed")).status.code(),
        Some(1)
    );
    same(&here.join("killed"), &here.join("whole"));
}

const RUNS: &str = "5";

fn parts_of_a_study(here: &Path, study: &[&str], count: u64, order: &[u64]) -> Vec<u8> {
    let mut merge = vec!["merge".to_owned(), "--json".to_owned()];
    for i in order {
        let (shard, part) = (format!("{i}/{count}"), format!("{}-{count}-{i}", study[1]));
        let arguments = [study, &["--shard", &shard, "-o", &part]].concat();
        let made = on_threads(here, &(1 + i % 2).to_string(), &arguments);
        assert!(made.status.success(), "{}", words(&made));
        merge.push(part);
    }
    let merge: Vec<&str> = merge.iter().map(String::as_str).collect();
    let merged = turncal(here, &merge);
    assert!(merged.status.success(), "{}", words(&merged));
    merged.stdout
}

#[test]
#[ignore = "slow: a study four times"]
fn parts_of_a_study_on_any_threads_and_in_any_order_are_the_whole() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let study = ["study", "accuracy", "--runs", RUNS, "--seed", "4"];
    let whole = on_threads(here, "2", &[&study[..], &["--json"]].concat());
    assert!(whole.status.success());
    for (count, order) in [(1, &[1][..]), (2, &[2, 1]), (7, &[5, 1, 7, 3, 2, 6, 4])] {
        assert!(
            parts_of_a_study(here, &study, count, order) == whole.stdout,
            "{count}"
        );
    }
    let experiment = ["study", "experiment", "--samples", "2", "--hours", "2"];
    let whole = turncal(here, &[&experiment[..], &["--json"]].concat());
    assert!(parts_of_a_study(here, &experiment, 2, &[2, 1]) == whole.stdout);

    // A part that is there is not made again, one that was changed is refused.
    let again = [&study[..], &["--shard", "1/2", "-o", "accuracy-2-1"]].concat();
    assert!(words(&turncal(here, &again)).contains("already exists"));
    let results = here.join("accuracy-2-1/runs.msgpack");
    let mut bytes = fs::read(&results).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&results, bytes).unwrap();
    let refused = turncal(here, &["merge", "accuracy-2-1", "accuracy-2-2"]);
    assert!(words(&refused).contains("digest"), "{}", words(&refused));
}

/// A process that ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Python with Dask: TURNCAL_PYTHON or python3.
fn python() -> Option<String> {
    let python = std::env::var("TURNCAL_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has = Command::new(&python)
        .args(["-c", "import dask, distributed"])
        .output();
    if has.is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    skipped(&format!(
        "{python} has no dask and distributed; set TURNCAL_PYTHON to one that has them"
    ));
    None
}

fn cluster(python: &str, here: &Path, arguments: &[&str]) -> Running {
    let child = Command::new(python)
        .args(["-m", "dask"])
        .args(arguments)
        .args(["--scheduler-file", "scheduler.json"])
        .current_dir(here)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    Running(child.unwrap())
}

#[test]
#[ignore = "slow: a study on a cluster of Python processes, three times"]
fn a_study_on_dask_is_the_same_with_one_worker_or_two_and_one_of_them_killed() {
    let Some(python) = python() else {
        return;
    };
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let study = ["study", "accuracy", "--runs", "12", "--seed", "4"];
    let whole = turncal(here, &[&study[..], &["-o", "whole"]].concat());
    assert!(whole.status.success(), "{}", words(&whole));
    let script =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("examples/on_dask.py");
    let _scheduler = cluster(
        &python,
        here,
        &["scheduler", "--port", "0", "--no-dashboard"],
    );
    let worker = || {
        let alone = ["worker", "--no-nanny", "--nthreads", "1", "--no-dashboard"];
        cluster(&python, here, &alone)
    };
    let first = worker();
    let mut second = None;
    for (output, kill) in [("one", false), ("two", false), ("killed", true)] {
        if output == "two" {
            second = Some(worker());
        }
        let mut job = Command::new(&python);
        job.arg(&script)
            .args(["--scheduler-file", "scheduler.json", "6", output]);
        job.arg(env!("CARGO_BIN_EXE_turncal"))
            .args(study)
            .current_dir(here);
        let mut job = job.stdout(Stdio::null()).spawn().unwrap();
        if kill {
            // Once a first part is there, others are being made.
            let parts = here.join("killed-parts");
            let patience = Instant::now() + Duration::from_secs(60);
            while fs::read_dir(&parts).map_or(0, Iterator::count) < 2 && Instant::now() < patience {
                sleep(Duration::from_millis(20));
            }
            assert!(
                job.try_wait().unwrap().is_none(),
                "done before the worker was killed"
            );
            drop(second.take());
        }
        assert!(job.wait().unwrap().success(), "{output}");
        same(&here.join(output), &here.join("whole"));
    }
    drop(first);
}
