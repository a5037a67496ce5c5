//! Gyros and accelerometers in two streams, each at its own rate and by its own clock.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;
use turncal::calibration::{
    ErrorTerm, NoisePolicy, Options, Problem, UNWATCHED, estimate, mean_square_interval, to_vector,
};
use turncal::imu::{Sensor, Term};
use turncal::run::Run;
use turncal::simulation::{Scenario, Simulated};
use turncal::turntable::TABLE_GEOMETRY;
use turncal_files::write_run;

/// Fixed before the first run was made.
const SEED: u64 = 93;
/// By how much the accelerometers' clock is ahead, s.
const AHEAD: f64 = 0.003;

fn simulated(rate: f64, stream: u64) -> Simulated {
    let mut scenario = Scenario::load("mems").unwrap();
    scenario.integrator.period = 1.0 / rate;
    scenario.simulate(SEED, stream).unwrap()
}

/// Rows of a triad, its clock so much ahead.
fn rows(run: &Run, sensor: Sensor, ahead: f64) -> String {
    let imu = &run.recording.imu;
    let mut text = "t,x,y,z\n".to_owned();
    for (k, sample) in imu.of(sensor).iter().enumerate() {
        let v: Vector3<f64> = sample / imu.period;
        writeln!(
            text,
            "{:.9},{:e},{:e},{:e}",
            imu.time(k) + ahead,
            v.x,
            v.y,
            v.z
        )
        .unwrap();
    }
    text
}

/// One instrument, sensed by the gyros at 100 Hz and by the accelerometers at 93.7 Hz, as files say it.
fn two_streams(stream: u64, directory: &Path) -> (Run, Simulated) {
    let made = simulated(100.0, stream);
    let accel = simulated(93.7, stream);
    assert_eq!(made.truth, accel.truth);
    write_run(directory, &made.run, made.output, None).unwrap();
    fs::write(
        directory.join("gyro.csv"),
        rows(&made.run, Sensor::Gyro, 0.0),
    )
    .unwrap();
    fs::write(
        directory.join("accel.csv"),
        rows(&accel.run, Sensor::Accel, AHEAD),
    )
    .unwrap();
    let path = directory.join("run.toml");
    let text = fs::read_to_string(&path).unwrap();
    let (begin, rest) = text.split_once("columns = {").unwrap();
    let (_, rest) = rest.split_once('\n').unwrap();
    let columns = r#"columns = { time = "t", gyro = ["x", "y", "z"], accel = ["x", "y", "z"] }"#;
    let begin = begin.replace(
        "\"imu.csv.gz\"",
        "\"gyro.csv\"\naccel_from = { file = \"accel.csv\" }",
    );
    fs::write(&path, format!("{begin}{columns}\n{rest}")).unwrap();
    (
        turncal_files::read_run(&path).unwrap_or_else(|error| panic!("{error}")),
        made,
    )
}

/// NEES of the triads' parameters and the time offset, how many they are, the offset and its σ.
fn trial(stream: u64) -> (f64, usize, f64, f64) {
    let directory = tempfile::tempdir().unwrap();
    let (run, made) = two_streams(stream, directory.path());
    let options = Options::default()
        .noise(NoisePolicy::Stated)
        .with(ErrorTerm::Instrument(Term::TimeOffset));
    let outcome = estimate(&Problem::new(&run, &options), UNWATCHED).unwrap();
    assert!(outcome.converged, "{stream}");
    let error = outcome.estimate.vector() - to_vector(&made.truth);
    let sigma = outcome.estimate.sigma();
    let of: Vec<usize> = outcome.estimate.estimated().collect();
    // In units of σ the covariance is a correlation matrix, which inverts without loss.
    let correlation = DMatrix::from_fn(of.len(), of.len(), |a, b| {
        outcome.estimate.covariance[(of[a], of[b])] / (sigma[of[a]] * sigma[of[b]])
    });
    let errors = DVector::from_fn(of.len(), |a, _| error[of[a]] / sigma[of[a]]);
    let nees = errors.dot(&correlation.cholesky().unwrap().solve(&errors));
    let offset = Term::TimeOffset.parameters().start;
    let found = outcome.auxiliary.terms()[offset];
    let sigma = outcome.auxiliary.sigma()[TABLE_GEOMETRY + offset];
    (nees, of.len(), found, sigma)
}

fn as_claimed(runs: u64) {
    let trials: Vec<_> = (0..runs).into_par_iter().map(trial).collect();
    let count: usize = trials.iter().map(|trial| trial.1).sum();
    let mean = trials.iter().map(|trial| trial.0).sum::<f64>() / count as f64;
    let (low, high) = mean_square_interval(count, 0.002);
    println!("NEES/n {mean:.4} of {count}, 99.8 % interval {low:.4} to {high:.4}");
    // What is sensed now has a later stamp.
    let off = |&(_, _, found, sigma): &(f64, usize, f64, f64)| (found + AHEAD) / sigma;
    let squares = trials.iter().map(|trial| off(trial).powi(2)).sum::<f64>() / runs as f64;
    let limits = mean_square_interval(trials.len(), 0.002);
    let first = trials[0];
    println!(
        "offset {:.4} ± {:.4} ms; mean square {squares:.3}, {limits:.3?}",
        1e3 * first.2,
        1e3 * first.3
    );
    assert!((low..high).contains(&mean), "NEES/n {mean}");
    assert!(squares < limits.1, "{squares}");
}

#[test]
fn two_streams_at_two_rates_are_calibrated_as_accurately_as_claimed() {
    as_claimed(2);
}

#[test]
#[ignore = "statistical: 20 runs"]
fn two_streams_at_two_rates_are_calibrated_as_accurately_as_claimed_over_many_runs() {
    as_claimed(20);
}

#[test]
fn streams_of_one_clock_are_as_one() {
    let directory = tempfile::tempdir().unwrap();
    let made = simulated(100.0, 0);
    write_run(directory.path(), &made.run, made.output, None).unwrap();
    let path = directory.path().join("run.toml");
    let one = turncal_files::read_run(&path).unwrap().recording.imu;
    let text = fs::read_to_string(&path).unwrap();
    let line = "file = \"imu.csv.gz\"";
    fs::write(
        &path,
        text.replace(line, &format!("{line}\naccel_from = {{}}")),
    )
    .unwrap();
    let two = turncal_files::read_run(&path).unwrap().recording.imu;
    assert_eq!(one.len(), two.len());
    let off = |sensor| {
        let pairs = one.of(sensor).iter().zip(two.of(sensor).iter());
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    assert!(
        off(Sensor::Gyro) < 1e-15 && off(Sensor::Accel) < 1e-12,
        "{}",
        off(Sensor::Accel)
    );
    assert!(two.pulse.accel < 1e-9, "{}", two.pulse.accel);
}

#[test]
fn a_gap_in_one_stream_is_a_gap_in_both() {
    let directory = tempfile::tempdir().unwrap();
    let (whole, _) = two_streams(0, directory.path());
    let path = directory.path().join("accel.csv");
    let text = fs::read_to_string(&path).unwrap();
    let kept = text
        .lines()
        .enumerate()
        .filter(|(k, _)| !(2000..2200).contains(k));
    let kept: String = kept.map(|(_, line)| format!("{line}\n")).collect();
    fs::write(&path, kept).unwrap();
    let run = turncal_files::read_run(&directory.path().join("run.toml")).unwrap();
    let imu = &run.recording.imu;
    assert_eq!(
        (whole.recording.imu.stretches.len(), imu.stretches.len()),
        (1, 2)
    );
    let lost: f64 = imu
        .missing()
        .map(|lost| lost.len() as f64 * imu.period)
        .sum();
    assert!((lost - 200.0 / 93.7).abs() < 0.03, "{lost} s");
}
