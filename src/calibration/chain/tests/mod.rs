mod batch;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use super::{Chain, Dispersion, Effect, Sizes, Slip};
use crate::attitude::{exp, matrix, quaternion};
use crate::calibration::constants::Sites;
use crate::calibration::iterations::{Solved, solve};
use crate::calibration::start::coarse::coarse_start;
use crate::calibration::{
    AttitudePrior, ErrorTerm, Estimate, Linearisation, NoisePolicy, Options, PARAMETERS,
    ParameterVector, Posterior, Prior, Problem, Script, Source, UNWATCHED, nees, to_vector,
};
use crate::imu::{PerSensor, Triad};
use crate::run::{Aiding, Run};
use crate::simulation::Scenario;
use crate::units::{ARCSEC, DEGREE};
use batch::batch_estimate;

fn run(name: &str) -> Run {
    Scenario::load(name).unwrap().simulate(1, 0).unwrap().run
}

/// A problem with its coarse start.
fn started<'a>(
    run: &'a Run,
    options: &Options,
) -> (Problem<'a>, Vec<AttitudePrior>, Linearisation) {
    let problem = Problem::new(run, options);
    let start = coarse_start(&problem).unwrap();
    (problem, start.attitudes, start.at)
}

fn prior(problem: &Problem, chain: &Chain, at: &Linearisation) -> Prior {
    Prior::new(&chain.constants, &problem.model, at)
}

/// With constant biases.
fn constant(mut run: Run) -> Run {
    run.instrument.noise.gyro.gauss_markov = None;
    run.instrument.noise.accel.gauss_markov = None;
    run
}

fn kinds() -> Vec<(Run, Options)> {
    let options = plain();
    let by_hand = options.clone().aiding(Aiding::Velocity);
    vec![
        (run("demo"), options.clone()),
        (run("demo"), by_hand.clone()),
        (constant(run("mems")), options),
        (constant(run("mems")), by_hand),
    ]
}

/// Largest difference of estimate and of covariance between an estimate and batch least squares, in σ and its products.
fn from_batch(problem: &Problem) -> f64 {
    let outcome = crate::calibration::estimate(problem, UNWATCHED).unwrap();
    assert!(outcome.converged);
    let batch = batch_estimate(problem, &outcome).unwrap();
    let sigma = batch.sigma();
    let linear = &outcome.solved.posterior.parameter_covariance;
    let chain = Estimate::with_curvature(outcome.estimate.triads, linear);
    let apart = chain.vector() - batch.vector();
    let mut most = 0f64;
    for i in (0..PARAMETERS).filter(|&i| sigma[i] > 0.0) {
        most = most.max((apart[i] / sigma[i]).abs());
        for j in (0..PARAMETERS).filter(|&j| sigma[j] > 0.0) {
            let apart = chain.covariance[(i, j)] - batch.covariance[(i, j)];
            most = most.max((apart / (sigma[i] * sigma[j])).abs());
        }
    }
    println!("{}: {most:.1e}", problem.run().recording.name);
    most
}

/// Noise as stated, and no term that may be absent.
fn plain() -> Options {
    Options::default()
        .noise(NoisePolicy::Stated)
        .no_auto_terms()
}

/// The first 200 s of a run.
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
fn batch_least_squares_gives_the_estimate_and_covariance_of_the_chain() {
    let whole = run("demo");
    let mut quiet = shortened(whole.clone());
    quiet.instrument.noise.gyro.random_walk = 0.0;
    let mut exact = shortened(whole.clone());
    exact.table.position_sigma = 0.0;
    for (run, most) in [(whole, 1e-6), (exact, 1e-6), (quiet, 1e-5)] {
        assert!(from_batch(&Problem::new(&run, &plain())) < most);
    }
}

#[test]
fn two_recordings_together_are_both_stacked() {
    let scenario = Scenario::load("demo").unwrap();
    let one = shortened(run("demo"));
    let other = scenario.simulate_recording(1, 0, 1, &Default::default());
    let other = shortened(other.unwrap().run);
    assert!(from_batch(&Problem::new(&one, &plain()).and(&other)) < 1e-6);
}

/// The posterior with a size.
fn posterior(problem: &Problem, chain: &Chain, at: &Linearisation, sizes: &Sizes) -> Posterior {
    let prior = prior(problem, chain, at);
    let filtered = chain.filter(sizes).unwrap();
    let known = filtered.known(&prior);
    filtered
        .posterior_with(&known, &Sites::none(&prior))
        .unwrap()
}

#[test]
fn slopes_and_parts_are_those_of_differences() {
    for (run, options) in kinds() {
        let options = options.with(ErrorTerm::GaussMarkovBias).no_auto_terms();
        let (mut problem, priors, at) = started(&run, &options);
        for motion in [
            &mut problem.model.motion_noise.gyro,
            &mut problem.model.motion_noise.accel,
        ] {
            (motion.by_motion, motion.by_duration) = (1e-5, 1e-5);
        }
        let script = Script::new(&problem, &priors, &at).unwrap();
        let chain = Chain::new(&problem, &script, &Dispersion::alike(&problem)).unwrap();
        let filtered = chain.filter(&Sizes::default()).unwrap();
        let here = posterior(&problem, &chain, &at, &Sizes::default());
        let (smoothed, parts) = (filtered.smoothed(&here), filtered.parts(&here));
        for source in Source::ALL {
            let effect = Effect::Noise(source);
            let Some(part) = parts.get(&effect) else {
                continue;
            };
            let step = 1e-3f64;
            let of = |factor: f64| {
                let sizes = Sizes::default().with(effect, factor);
                posterior(&problem, &chain, &at, &sizes)
            };
            let (more, less) = (of(step.exp()), of((-step).exp()));
            let expected = (more.deviance - less.deviance) / (2.0 * step);
            let slope = smoothed.by_effect()[&effect].slope;
            assert!(
                (slope - expected).abs() < 1e-4 * (expected.abs() + 1.0),
                "{} {source:?}: {slope} instead of {expected}",
                run.recording.name
            );
            let expected = (more.covariance - less.covariance) / (2.0 * step);
            let off = part - expected;
            let sigma = here.covariance.diagonal().map(f64::sqrt);
            let scale = &sigma * sigma.transpose();
            let off = off.component_div(&scale).amax();
            assert!(off < 1e-4, "{} {source:?}: {off}", run.recording.name);
        }
    }
}

/// Estimates from the coarse start.
fn estimated(problem: &Problem) -> Solved {
    let start = coarse_start(problem).unwrap();
    let solved = solve(problem, (&start.at, &start.attitudes), UNWATCHED).unwrap();
    assert!(solved.converged, "{} passes", solved.passes.len());
    solved
}

fn sigma(of: &Solved) -> ParameterVector {
    of.posterior.parameter_covariance.diagonal().map(f64::sqrt)
}

/// Errors over their σ.
fn errors(of: &Solved, truth: &PerSensor<Triad>) -> Vec<f64> {
    let error = to_vector(&of.estimate.triads) - to_vector(truth);
    let over = error.component_div(&sigma(of));
    over.iter().copied().filter(|e| e.is_finite()).collect()
}

/// Estimates a run of the demo whose table readings in these dwells, or from the first of them on, are changed, and holds
/// it against the truth: `named` alone stands out, no parameter is off by more than 4 σ, and no σ is over these times
/// that of the run without the change.
fn stands_out(
    (named, dwell): (Effect, usize),
    stays: bool,
    change: impl Fn(&Matrix3<f64>) -> Matrix3<f64>,
    most: f64,
) {
    let simulated = Scenario::load("demo").unwrap().simulate(1, 0).unwrap();
    let options = Options::default().no_auto_terms();
    let problem = Problem::new(&simulated.run, &options);
    let of_sound = estimated(&problem);
    let mut run = simulated.run.clone();
    let position = problem.dwells().nth(dwell).unwrap().position.as_ref();
    let mut changed = position.unwrap().readings.clone();
    let attitudes = &mut run.recording.table.as_mut().unwrap().attitude;
    if stays {
        changed.end = attitudes.len();
    }
    for attitude in &mut attitudes[changed] {
        *attitude = quaternion(&change(&matrix(attitude)));
    }
    let problem = Problem::new(&run, &options);
    let found = estimated(&problem);
    let chain = found.effects.chain(&problem, &found.script).unwrap();
    let sizes = found.effects.sizes(&chain);
    let standing_out = sizes.events().filter(|&(_, factor)| factor > 30.0);
    let standing_out: Vec<_> = standing_out.collect();
    let is_it = |of: &((Effect, usize), f64)| of.0 == (named, dwell);
    assert!(
        standing_out.len() == 1 && standing_out.iter().all(is_it),
        "{standing_out:?}"
    );
    let off = errors(&found, &simulated.truth);
    let off = off.into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    assert!(off < 4.0, "{off}");
    let grown = sigma(&found).component_div(&sigma(&of_sound));
    let grown = grown.iter().filter(|of| of.is_finite());
    let grown = grown.fold(0.0, |a: f64, b| a.max(*b));
    assert!(grown < most, "{grown}");
}

#[test]
fn a_position_that_is_a_degree_wrong_stands_out_and_leaves_no_trace() {
    let turn = exp(Vector3::new(0.6, -0.5, 0.62) * DEGREE);
    let position = Effect::Noise(Source::TablePosition);
    stands_out((position, 5), false, |attitude| turn * attitude, 2.0);
}

#[test]
fn an_instrument_or_a_table_that_slips_is_told_as_that() {
    let turn = exp(Vector3::new(0.5, 0.7, -0.5) * 72.0 * ARCSEC);
    let [mount, base] = [Slip::Mount, Slip::Base].map(Effect::Slip);
    stands_out((mount, 6), true, |attitude| attitude * turn, 3.0);
    stands_out((base, 6), true, |attitude| turn * attitude, 3.0);
}

#[test]
fn sigma_by_hand_hardly_depends_on_one_dwell() {
    let run = run("mems");
    let options = Options::default().aiding(Aiding::Velocity);
    let whole = Problem::new(&run, &options);
    let count = whole.dwells().count();
    let of_whole = sigma(&estimated(&whole));
    for left_out in [1, count / 2] {
        let part = whole.observed_in(|number| number != left_out);
        let ratio = sigma(&estimated(&part)).component_div(&of_whole);
        for ratio in ratio.iter().filter(|of| of.is_finite()) {
            assert!(
                (0.75..1.34).contains(ratio),
                "{left_out} of {count}: {ratio}"
            );
        }
    }
}

/// NEES/n over this many runs.
fn mean_nees(name: &str, aiding: Aiding, runs: u64) -> f64 {
    let mut scenario = Scenario::load(name).unwrap();
    scenario.body_frame = aiding.body_frame();
    let options = Options::default().aiding(aiding).no_auto_terms();
    let of_run = |run: u64| {
        let simulated = scenario.simulate(7, run).unwrap();
        let found = estimated(&Problem::new(&simulated.run, &options));
        let error = to_vector(&found.estimate.triads) - to_vector(&simulated.truth);
        let error = DVector::from_column_slice(error.as_slice());
        let covariance = found.posterior.parameter_covariance;
        let covariance = DMatrix::from_fn(PARAMETERS, PARAMETERS, |i, j| covariance[(i, j)]);
        let all: Vec<usize> = (0..PARAMETERS).collect();
        nees(&error, &covariance, &all).unwrap().mean
    };
    let sum: f64 = (0..runs).into_par_iter().map(of_run).sum();
    sum / runs as f64
}

#[test]
#[ignore = "statistics over many runs"]
fn sigma_are_true_on_a_table_and_by_hand() {
    for (name, aiding) in [
        ("demo", Aiding::Table),
        ("mems", Aiding::Table),
        ("mems", Aiding::Velocity),
    ] {
        let nees = mean_nees(name, aiding, 20);
        assert!((0.7..1.3).contains(&nees), "{name} {aiding:?}: {nees}");
    }
}
