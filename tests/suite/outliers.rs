//! Wild observations, tables that settle, and priors that are wrong.

use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitSphere};
use rayon::prelude::*;
use turncal::calibration::{
    Finding, FindingKind, Method, Options, Outcome, PARAMETERS, ParameterVector, Problem, Source,
    UNWATCHED, estimate, to_vector,
};
use turncal::imu::Sensor;
use turncal::run::Run;
use turncal::simulation::{Scenario, Simulated};
use turncal::units::ARCSEC;

/// Fixed before the first run was made.
const SEED: u64 = 1616;
/// Size of an outlier in σ of its observation.
const SIZE: f64 = 20.0;
/// One in so many.
const ONE_IN: f64 = 100.0;

fn direction(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from(UnitSphere.sample(rng))
}

fn spoil_reading(run: &mut Run, reading: usize, size: f64, rng: &mut ChaCha8Rng) {
    let turn = UnitQuaternion::new(direction(rng) * (size * run.table.reading_sigma));
    let table = run.recording.table.as_mut().unwrap();
    table.attitude[reading] = turn * table.attitude[reading];
}

/// The IMU jerks: at the end of a stretch of a tenth of a second it has a velocity, right after it
/// none.
fn jerk(run: &mut Run, sample: usize, rng: &mut ChaCha8Rng) {
    // What a velocity is known to after a stretch: the walk since the last one, and a pulse's share.
    let variance = run.instrument.noise.accel.random_walk.powi(2) * 0.1
        + run.recording.imu.pulse.accel.powi(2) / 12.0;
    let velocity = direction(rng) * (SIZE * variance.sqrt());
    run.recording.imu.accel.to_mut()[sample] += velocity;
    run.recording.imu.accel.to_mut()[sample + 1] -= velocity;
}

fn error(simulated: &Simulated) -> (Outcome, ParameterVector) {
    let outcome = estimate(
        &Problem::new(&simulated.run, &Options::default()),
        UNWATCHED,
    )
    .unwrap();
    assert!(outcome.converged);
    let error = outcome.estimate.vector() - to_vector(&simulated.truth);
    let normalised = error.component_div(&outcome.estimate.sigma());
    (outcome, normalised)
}

/// A dwell with outliers is less still than others, which costs weight but no truth: σ cover what is left of the errors.
#[test]
fn one_outlier_in_a_hundred_widens_sigma_by_what_it_costs() {
    const RUNS: u64 = 3;
    let scenario = Scenario::load("demo").unwrap();
    let each = (0..RUNS).into_par_iter().map(|stream| {
        let mut simulated = scenario.simulate(SEED, stream).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(stream);
        let run = &mut simulated.run;
        for dwell in run.dwells(run.aiding()) {
            for reading in dwell.position.unwrap().readings {
                if rng.random_bool(1.0 / ONE_IN) {
                    spoil_reading(run, reading, SIZE, &mut rng);
                }
            }
            for last in dwell.samples.skip(9).step_by(10) {
                if rng.random_bool(1.0 / ONE_IN) {
                    jerk(run, last, &mut rng);
                }
            }
        }
        let (_, error) = error(&simulated);
        error.norm_squared() / PARAMETERS as f64
    });
    let nees = each.sum::<f64>() / RUNS as f64;
    println!("mean square over σ² {nees:.2}");
    assert!(nees < 1.5, "{nees}");
}

#[test]
fn a_table_that_settles_after_each_stop_costs_no_accuracy() {
    let mut simulated = Scenario::load("demo").unwrap().simulate(SEED, 0).unwrap();
    let (_, clean) = error(&simulated);
    let dwells = simulated.run.dwells(simulated.run.aiding());
    let still = simulated.run.recording.imu.clone();
    for size in [10.0, 60.0] {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        simulated.run.recording.imu = still.clone();
        let imu = &mut simulated.run.recording.imu;
        for dwell in &dwells[1..] {
            // The body is turned by this as it stops, and comes back.
            let about = direction(&mut rng) * (size * ARCSEC);
            let stop = dwell.samples.start;
            let off = |sample: usize| about * (-((sample - stop) as f64) * imu.period / 0.3).exp();
            let gyro = imu.gyro.to_mut();
            gyro[stop - 1] += about;
            for sample in dwell.samples.clone() {
                gyro[sample] += off(sample + 1) - off(sample);
                let force = still.accel.at(sample);
                imu.accel.to_mut()[sample] -= off(sample).cross(&force);
            }
        }
        let (outcome, settling) = error(&simulated);
        let shift = (settling - clean).amax();
        println!("{size}″: shift {shift:.3} σ");
        assert!(shift < 1.0, "{size}″: {shift} σ");
        let settles = outcome
            .noise
            .sources
            .iter()
            .find(|of| of.source == Source::Settling);
        let found = settles.unwrap().used;
        println!("{size}″: {found}″ found");
        // Of a turn about a random direction, each axis has 1/√3 (RMS); found to a factor of two.
        assert!((0.29..1.15).contains(&(found / size)), "{size}″: {found}″");
        let is_named = outcome.findings.iter().any(|of| of.code == "W15");
        assert!(is_named, "{size}″");
    }
}

#[test]
fn a_prior_that_is_wrong_costs_nothing_and_is_named_itself() {
    let mut simulated = Scenario::load("demo").unwrap().simulate(SEED, 0).unwrap();
    let (_, clean) = error(&simulated);
    let truth = simulated.truth;
    for sensor in Sensor::ALL {
        // Nominal scales are one.
        let off = truth.get(sensor).scale.add_scalar(-1.0).abs();
        simulated.run.instrument.prior.get_mut(sensor).scale_sigma = off / 20.0;
    }
    let (wrong, spoilt) = error(&simulated);
    assert!((spoilt - clean).amax() < 0.1);
    let named = |finding: &Finding| finding.kind == "far-from-prior";
    assert!(wrong.findings.iter().any(named));
}

/// Between moves that a bias prior 20 σ off turns into others, and with a scale that is off by as much, noise and error
/// terms are told of the instrument as it is calibrated.
#[test]
fn a_prior_that_is_wrong_is_neither_noise_nor_an_error_term() {
    let wrong = |scenario: &str, spoil: fn(&mut Run)| {
        let mut run = Scenario::load(scenario).unwrap().simulate(SEED, 0).unwrap();
        spoil(&mut run.run);
        let problem = Problem::new(&run.run, &Options::default());
        let solution = problem.solve(Method::Ekf, UNWATCHED).unwrap();
        assert!(solution.converged());
        solution.findings().to_vec()
    };
    fn by_scale(rows: &mut [Vector3<f64>], sigma: &Vector3<f64>) {
        let scale = sigma.map(|sigma| 1.0 + 20.0 * sigma);
        rows.iter_mut()
            .for_each(|row| row.component_mul_assign(&scale));
    }
    let mems = wrong("mems", |run| {
        let prior = &mut run.instrument.prior;
        prior.gyro.bias += prior.gyro.bias_sigma * 20.0;
        by_scale(run.recording.imu.accel.to_mut(), &prior.accel.scale_sigma);
    });
    let positions = wrong("nineteen-position", |run| {
        let prior = &run.instrument.prior;
        by_scale(run.recording.imu.gyro.to_mut(), &prior.gyro.scale_sigma);
    });
    for findings in [mems, positions] {
        // A scale that is off by 20 σ, a tenth, may be beyond what is careless, too.
        let far = |finding: &Finding| {
            finding.is(FindingKind::FarFromPrior) || finding.is(FindingKind::PriorContradicted)
        };
        // What a path does not show is said of it whatever the prior is.
        let of_prior = |finding: &Finding| far(finding) || finding.is(FindingKind::TermNotShown);
        assert!(
            findings.iter().any(far) && findings.iter().all(of_prior),
            "{findings:?}"
        );
    }
}
