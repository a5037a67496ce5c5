//! Wild observations: one in a hundred costs little, and none shuts the filter's gate on the others.

use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitSphere};
use rayon::prelude::*;
use turncal::calibration::{
    Finding, FindingKind, Method, NoisePolicy, Observation, Options, Outcome, PARAMETERS,
    ParameterVector, Problem, UNWATCHED, estimate, to_vector,
};
use turncal::imu::Sensor;
use turncal::run::Run;
use turncal::simulation::{Scenario, Simulated};
use turncal::units::ARCSEC;

/// With the noise that the run states, which is that of its data.
fn stated() -> Options {
    Options::default().noise(NoisePolicy::Stated)
}

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
    let outcome = estimate(&Problem::new(&simulated.run, &stated()), UNWATCHED).unwrap();
    assert!(outcome.converged);
    let error = outcome.estimate.vector() - to_vector(&simulated.truth);
    let normalised = error.component_div(&outcome.estimate.sigma());
    (outcome, normalised)
}

fn rejected(outcome: &Outcome, observation: Observation) -> usize {
    let of_kind = outcome
        .innovations
        .iter()
        .filter(|i| i.observation == observation);
    of_kind.filter(|i| !i.accepted).count()
}

#[test]
fn one_outlier_in_a_hundred_costs_little_and_is_rejected() {
    // Few runs scatter by more than the tenth that many allow.
    one_outlier_in_a_hundred(3, 1.3);
}

#[test]
#[ignore = "statistical: 48 runs"]
fn one_outlier_in_a_hundred_costs_less_than_a_tenth_of_the_accuracy() {
    one_outlier_in_a_hundred(24, 1.1);
}

/// RMS errors over so many runs with outliers are below `limit` times those without.
fn one_outlier_in_a_hundred(runs: u64, limit: f64) {
    let scenario = Scenario::load("demo").unwrap();
    let squares = |spoilt: bool| -> (f64, usize, usize, usize) {
        (0..runs)
            .into_par_iter()
            .map(|stream| {
                let mut simulated = scenario.simulate(SEED, stream).unwrap();
                let mut rng = ChaCha8Rng::seed_from_u64(stream);
                let mut made = 0;
                if spoilt {
                    let run = &mut simulated.run;
                    for dwell in run.dwells(run.aiding()) {
                        for reading in dwell.position.unwrap().readings {
                            if rng.random_bool(1.0 / ONE_IN) {
                                spoil_reading(run, reading, SIZE, &mut rng);
                                made += 1;
                            }
                        }
                        for last in dwell.samples.skip(9).step_by(10) {
                            if rng.random_bool(1.0 / ONE_IN) {
                                jerk(run, last, &mut rng);
                                made += 1;
                            }
                        }
                    }
                }
                let (outcome, error) = error(&simulated);
                let [velocity, table] = [Observation::Velocity, Observation::Table]
                    .map(|observation| rejected(&outcome, observation));
                (error.norm_squared(), made, velocity, table)
            })
            .reduce(
                || (0.0, 0, 0, 0),
                |a, b| (a.0 + b.0, a.1 + b.1, a.2 + b.2, a.3 + b.3),
            )
    };
    let (clean, ..) = squares(false);
    let (spoilt, made, velocity, table) = squares(true);
    let ratio = (spoilt / clean).sqrt();
    println!(
        "RMS/σ {:.3} clean, {:.3} with outliers, ratio {ratio:.4} over {runs} runs; {made} outliers, \
         rejected {velocity} velocities and {table} readings",
        (clean / (runs as f64 * PARAMETERS as f64)).sqrt(),
        (spoilt / (runs as f64 * PARAMETERS as f64)).sqrt(),
    );
    assert!(ratio < limit, "{ratio}");
    let share = (velocity + table) as f64 / made as f64;
    assert!(
        (0.9..1.1).contains(&share),
        "{share} of the outliers rejected"
    );
}

#[test]
fn an_outlier_as_the_first_observation_after_a_turn_does_not_lock_the_filter_out() {
    let mut simulated = Scenario::load("demo").unwrap().simulate(SEED, 0).unwrap();
    let (_, clean) = error(&simulated);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    // A larger one would still be taken for part of the turn.
    const HIDDEN: f64 = 12.0;
    let run = &mut simulated.run;
    for dwell in &run.dwells(run.aiding())[1..] {
        spoil_reading(
            run,
            dwell.position.as_ref().unwrap().readings.start,
            HIDDEN,
            &mut rng,
        );
    }
    let dwells = run.dwells(run.aiding());
    for dwell in &dwells[1..] {
        jerk(run, dwell.samples.start + 9, &mut rng);
    }
    let (outcome, spoilt) = error(&simulated);
    let shift = (spoilt - clean).amax();
    let [velocity, table] =
        [Observation::Velocity, Observation::Table].map(|kind| rejected(&outcome, kind));
    println!(
        "{} dwells, rejected {velocity} velocities and {table} readings, shift {shift:.3} σ",
        dwells.len()
    );
    assert!(shift < 1.0, "{shift} σ");
    // The readings are partly taken for the end of the turn; the velocities only the gate can find, unless the time after
    // each turn is skipped as one in which the table settles.
    assert!(outcome.settling > 0 || velocity == dwells.len() - 1);
    assert!(table < dwells.len());
}

#[test]
fn a_table_that_settles_after_each_stop_is_said_and_costs_no_accuracy() {
    let mut simulated = Scenario::load("demo").unwrap().simulate(SEED, 0).unwrap();
    let (outcome, clean) = error(&simulated);
    assert_eq!(outcome.settling, 0);
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
        let said = |finding: &&Finding| finding.kind == "settling";
        assert_eq!(outcome.findings.iter().filter(said).count(), 1, "{size}″");
        let shift = (settling - clean).amax();
        println!("{size}″: {} steps, shift {shift:.3} σ", outcome.settling);
        assert!(shift < 1.0, "{size}″: {shift} σ");
    }
}

#[test]
fn a_table_that_is_read_once_a_second_is_not_said_to_settle() {
    let mut simulated = Scenario::load("demo").unwrap().simulate(SEED, 0).unwrap();
    let table = simulated.run.recording.table.as_mut().unwrap();
    table.axes = table.axes.iter().copied().step_by(10).collect();
    table.time = table.time.iter().copied().step_by(10).collect();
    table.attitude = table.attitude.iter().copied().step_by(10).collect();
    assert!(table.time[1] - table.time[0] > 0.99);
    let (outcome, _) = error(&simulated);
    assert_eq!(outcome.settling, 0);
}

#[test]
fn a_prior_that_is_wrong_makes_no_outliers_and_is_named_itself() {
    let mut simulated = Scenario::load("demo").unwrap().simulate(SEED, 0).unwrap();
    let (right, clean) = error(&simulated);
    let truth = simulated.truth;
    for sensor in Sensor::ALL {
        // Nominal scales are one.
        let off = truth.get(sensor).scale.add_scalar(-1.0).abs();
        simulated.run.instrument.prior.get_mut(sensor).scale_sigma = off / 20.0;
    }
    let (wrong, spoilt) = error(&simulated);
    let rejected = |outcome: &Outcome| outcome.innovations.iter().filter(|i| !i.accepted).count();
    assert_eq!(rejected(&wrong), rejected(&right));
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
        let mut solution = problem.solve(Method::Ekf, UNWATCHED).unwrap();
        let assessment = solution.assess(&problem).unwrap();
        assert!(solution.converged());
        solution.findings(&assessment)
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
        assert!(
            !findings.is_empty() && findings.iter().all(far),
            "{findings:?}"
        );
    }
}
