//! The filter against batch least squares on the same linear problem.

use super::batch::batch_estimate;
use crate::calibration::gauss_newton::UNWATCHED;
use crate::calibration::{NoisePolicy, Options, Outcome, PARAMETERS, Problem, estimate};
use crate::imu::InstallationForm;
use crate::run::Run;
use crate::simulation::Scenario;
use crate::units::ARCSEC;
use nalgebra::{UnitQuaternion, Vector3};

/// With the noise that the run states, which is that of its data.
fn stated() -> Options {
    Options::default().noise(NoisePolicy::Stated)
}

/// Largest difference of estimate and of covariance, in σ and its products.
fn difference(problem: &Problem, outcome: &Outcome) -> (f64, f64) {
    let batch = batch_estimate(problem, outcome).unwrap();
    let sigma = batch.sigma();
    let filter = &outcome.estimate;
    let apart = filter.vector() - batch.vector();
    let (mut estimate, mut covariance) = (0f64, 0f64);
    for i in (0..PARAMETERS).filter(|&i| sigma[i] > 0.0) {
        estimate = estimate.max((apart[i] / sigma[i]).abs());
        for j in (0..PARAMETERS).filter(|&j| sigma[j] > 0.0) {
            let apart = outcome.covariance_by_noise[(i, j)] - batch.covariance[(i, j)];
            covariance = covariance.max((apart / (sigma[i] * sigma[j])).abs());
        }
    }
    println!("estimate {estimate:.1e} σ, covariance {covariance:.1e}");
    (estimate, covariance)
}

#[test]
fn batch_least_squares_gives_the_filters_estimate_and_covariance() {
    let simulated = Scenario::load("demo").unwrap().simulate(1, 0).unwrap();
    let problem = Problem::new(&simulated.run, &stated());
    let outcome = estimate(&problem, UNWATCHED).unwrap();
    assert!(outcome.converged);
    let (estimate, covariance) = difference(&problem, &outcome);
    assert!(estimate < 1e-6 && covariance < 1e-6);
}

/// The first 200 s of the demo's run.
fn short() -> Run {
    shortened(Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run)
}

fn shortened(mut run: Run) -> Run {
    run.recording.imu.gyro.to_mut().truncate(20_000);
    run.recording.imu.accel.to_mut().truncate(20_000);
    run.recording.imu.stretches[0].samples.end = 20_000;
    if let Some(table) = &mut run.recording.table {
        let readings = table.time.partition_point(|&t| t <= 200.0);
        table.time.truncate(readings);
        table.attitude.truncate(readings);
    }
    run
}

#[test]
fn it_agrees_on_what_the_gate_leaves_out() {
    let mut run = short();
    if let Some(table) = &mut run.recording.table {
        let outlier = UnitQuaternion::new(Vector3::y() * 30.0 * ARCSEC);
        table.attitude[300] = outlier * table.attitude[300];
    }
    let problem = Problem::new(&run, &stated().installation(InstallationForm::SixAngle));
    let outcome = estimate(&problem, UNWATCHED).unwrap();
    assert!(outcome.innovations.iter().any(|i| !i.accepted));
    let (estimate, covariance) = difference(&problem, &outcome);
    assert!(estimate < 1e-6 && covariance < 1e-6);
}

#[test]
fn it_agrees_where_gyros_or_table_have_no_error_and_the_problem_fewer_unknowns() {
    let mut quiet = short();
    quiet.instrument.noise.gyro.random_walk = 0.0;
    let mut exact = short();
    exact.table.position_sigma = 0.0;
    for run in [quiet, exact] {
        let problem = Problem::new(&run, &stated());
        let outcome = estimate(&problem, UNWATCHED).unwrap();
        let (estimate, covariance) = difference(&problem, &outcome);
        assert!(estimate < 1e-6 && covariance < 1e-6);
    }
}

#[test]
fn two_recordings_together_are_both_stacked() {
    let scenario = Scenario::load("demo").unwrap();
    let one = short();
    let other = scenario.simulate_recording(1, 0, 1, &Default::default());
    let other = shortened(other.unwrap().run);
    let problem = Problem::new(&one, &stated()).and(&other);
    let outcome = estimate(&problem, UNWATCHED).unwrap();
    assert!(outcome.converged);
    let (together, covariance) = difference(&problem, &outcome);
    assert!(together < 1e-6 && covariance < 1e-6);
    // The order of recordings does not matter.
    let turned = Problem::new(&other, &stated()).and(&one);
    let turned = estimate(&turned, UNWATCHED).unwrap();
    let sigma = outcome.estimate.sigma();
    for i in (0..PARAMETERS).filter(|&i| sigma[i] > 0.0) {
        let apart = turned.estimate.vector()[i] - outcome.estimate.vector()[i];
        // Both stop within 0.02 σ of where nothing moves.
        assert!(
            (apart / sigma[i]).abs() < 0.02,
            "{i}: {} σ",
            apart / sigma[i]
        );
    }
}
