use crate::calibration::gauss_newton::UNWATCHED;
use crate::calibration::reduction::Script;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::calibration::{Options, Outcome, Problem, estimate};
use crate::run::Run;
use crate::simulation::Scenario;

fn run() -> Run {
    Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run
}

fn estimated(run: &Run, noise: NoisePolicy) -> Outcome {
    let problem = Problem::new(run, &Options::default().noise(noise));
    estimate(&problem, UNWATCHED).unwrap()
}

fn figures(outcome: &Outcome, source: Source) -> &SourceFigures {
    let mut sources = outcome.noise.sources.iter();
    sources.find(|figures| figures.source == source).unwrap()
}

#[test]
fn right_figures_are_kept_and_change_nothing() {
    let run = run();
    let stated = estimated(&run, NoisePolicy::Stated);
    let auto = estimated(&run, NoisePolicy::Auto);
    assert!(auto.noise.test.is_some_and(|test| !test.rejected));
    assert_eq!(auto.estimate, stated.estimate);
    assert_eq!(auto.model, stated.model);
}

#[test]
fn an_angle_random_walk_stated_at_a_third_is_found() {
    let mut run = run();
    run.instrument.noise.gyro.random_walk /= 3.0;
    let outcome = estimated(&run, NoisePolicy::Auto);
    assert!(outcome.noise.learnt && outcome.converged);
    // What a run states of which a table's readings leave nothing to be told is no part of it.
    run.standstill.turning = 1e-8;
    assert_eq!(
        estimated(&run, NoisePolicy::Auto).noise.test,
        outcome.noise.test
    );
    let walk = figures(&outcome, Source::AngleRandomWalk);
    let truth = 3.0 * walk.stated.unwrap();
    let [low, high] = walk.interval.unwrap();
    assert!(low < truth && truth < high, "{walk}, true {truth:.3e}");
    assert!(outcome.noise.test.unwrap().rejected);
}

#[test]
fn attitude_noise_of_moves_is_found() {
    let mut run = run();
    // As much in every move of ten seconds as ten times the σ of a table position.
    let density = 10.0 * run.table.position_sigma / 10f64.sqrt();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let dwells = run.dwells(run.aiding());
    let period = run.recording.imu.period;
    for pair in dwells.windows(2) {
        for k in pair[0].samples.end..pair[1].samples.start {
            let normal = Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng));
            run.recording.imu.gyro.to_mut()[k] += normal * (density * period.sqrt());
        }
    }
    let outcome = estimated(&run, NoisePolicy::Auto);
    assert!(outcome.noise.learnt && outcome.converged);
    let problem = Problem::new(&run, &Options::default());
    let at = &outcome.linearised_at;
    let script = Script::new(&problem, &outcome.prior_attitudes, at).unwrap();
    let moves = script.moves();
    // Noise by time and by rate do the same in moves that are all alike.
    let found = outcome.model.motion_noise.gyro;
    let variance =
        found.by_duration.powi(2) * moves.duration + found.by_motion.powi(2) * moves.motion.gyro;
    let ratio = (variance / (density.powi(2) * moves.duration)).sqrt();
    // A few dozen moves with three axes each.
    assert!((ratio - 1.0).abs() < 0.3, "{ratio}");
}

#[test]
#[ignore = "statistical: 100 runs"]
fn right_figures_are_given_up_in_hardly_any_run() {
    let scenario = Scenario::load("demo").unwrap();
    let given_up = (0..100).filter(|&number| {
        let run = scenario.simulate(2, number).unwrap().run;
        estimated(&run, NoisePolicy::Auto).noise.learnt
    });
    // One in a thousand: more than two of 100 have a chance of 0.02 %.
    assert!(given_up.count() <= 2);
}
