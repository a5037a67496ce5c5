use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use super::at_rest::Dispersion;
use super::estimate::{Estimated, estimate};
use super::{Chain, Effect, Sizes, Slip};
use crate::attitude::{exp, matrix, quaternion};
use crate::calibration::start::coarse::coarse_start;
use crate::calibration::{
    AttitudePrior, ErrorTerm, Linearisation, NoisePolicy, Options, PARAMETERS, ParameterVector,
    Posterior, Prior, Problem, Script, Source, nees, to_vector,
};
use crate::imu::{PerSensor, Triad};
use crate::run::{Aiding, Run};
use crate::simulation::Scenario;
use crate::units::{ARCSEC, DEGREE};

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

/// Largest difference of two covariances, over their σ.
fn apart(one: &DMatrix<f64>, other: &DMatrix<f64>) -> f64 {
    let mut most = 0.0f64;
    for i in 0..one.nrows() {
        for j in 0..one.nrows() {
            let scale = (one[(i, i)] * one[(j, j)]).sqrt();
            most = most.max((one[(i, j)] - other[(i, j)]).abs() / scale);
        }
    }
    most
}

/// With constant biases.
fn constant(mut run: Run) -> Run {
    run.instrument.noise.gyro.gauss_markov = None;
    run.instrument.noise.accel.gauss_markov = None;
    run
}

fn kinds() -> Vec<(Run, Options)> {
    let options = Options::default().noise(NoisePolicy::Stated);
    let by_hand = options.clone().aiding(Aiding::Velocity);
    vec![
        (run("demo"), options.clone()),
        (run("demo"), by_hand.clone()),
        (constant(run("mems")), options),
        (constant(run("mems")), by_hand),
    ]
}

#[test]
fn a_chain_with_constant_biases_says_what_the_filter_says() {
    for (run, options) in kinds() {
        let (problem, priors, at) = started(&run, &options);
        let script = Script::new(&problem, &priors, &at).unwrap();
        let reduction = script.reduce(&problem, &[]).unwrap();
        let filter = reduction.posterior(&Prior::new(&reduction.constants, &problem.model, &at));
        let chain = Chain::new(&problem, &script, &Dispersion::alike(&problem)).unwrap();
        let slips = [Slip::Mount, Slip::Base].map(Effect::Slip);
        let none = slips
            .into_iter()
            .fold(Sizes::default(), |sizes, slip| sizes.with(slip, 0.0));
        let filtered = chain.filter(&none).unwrap();
        let posterior = filtered.posterior(&prior(&problem, &chain, &at));
        let name = &run.recording.name;
        let sigma = filter.covariance.diagonal().map(f64::sqrt);
        let off = (&posterior.mean - &filter.mean)
            .component_div(&sigma)
            .amax();
        assert!(off < 1e-6, "{name}: {off}");
        let off = apart(&filter.covariance, &posterior.covariance);
        assert!(off < 1e-6, "{name}: {off}");
        let off = posterior.deviance - filter.deviance;
        assert!(off.abs() < 1e-4, "{name}: {off} of {}", filter.deviance);
    }
}

/// The posterior with a size.
fn posterior(problem: &Problem, chain: &Chain, at: &Linearisation, sizes: &Sizes) -> Posterior {
    let filtered = chain.filter(sizes).unwrap();
    filtered.posterior(&prior(problem, chain, at))
}

#[test]
fn slopes_and_parts_are_those_of_differences() {
    for (run, options) in kinds() {
        let options = options.with(ErrorTerm::GaussMarkovBias);
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
        let here = filtered.posterior(&prior(&problem, &chain, &at));
        let smoothed = filtered.smoothed(&here);
        for source in Source::ALL {
            let effect = Effect::Noise(source);
            let Some(part) = smoothed.parts.get(&effect) else {
                continue;
            };
            let step = 1e-3f64;
            let of = |factor: f64| {
                let sizes = Sizes::default().with(effect, factor);
                posterior(&problem, &chain, &at, &sizes)
            };
            let (more, less) = (of(step.exp()), of((-step).exp()));
            let expected = (more.deviance - less.deviance) / (2.0 * step);
            let slope = smoothed.of(effect).slope;
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
fn estimated(problem: &Problem) -> Estimated {
    let start = coarse_start(problem).unwrap();
    let estimated = estimate(problem, &start.attitudes, start.at).unwrap();
    assert!(estimated.converged, "{} passes", estimated.passes);
    estimated
}

fn sigma(of: &Estimated) -> ParameterVector {
    of.posterior.parameter_covariance.diagonal().map(f64::sqrt)
}

/// Errors over their σ.
fn errors(of: &Estimated, truth: &PerSensor<Triad>) -> Vec<f64> {
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
    let options = Options::default();
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
    let found = estimated(&Problem::new(&run, &options));
    let standing_out = found.sizes.events().filter(|&(_, factor)| factor > 30.0);
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
