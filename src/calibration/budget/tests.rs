use super::super::innovation::Innovation;
use super::super::model::Model;
use super::super::pass::{Gate, Mode, PassResult, pass};
use super::super::{ErrorTerm, NoisePolicy, Options, estimate};
use super::*;
use crate::imu::{Sensor, Term};
use crate::run::{Aiding, Run};
use crate::simulation::Scenario;

/// Rounding of the passes' covariance, which has to fall by ten orders of magnitude.
const ROUNDING: f64 = 1e-7;

fn simulated(scenario: &str) -> Run {
    let scenario = Scenario::load(scenario).unwrap();
    scenario.simulate(5, 0).unwrap().run
}

/// The largest difference of two covariances, over the σ of the second.
fn difference(a: &ParameterMatrix, b: &ParameterMatrix) -> f64 {
    let sigma = b.diagonal().map(f64::sqrt);
    let each = (0..PARAMETERS).flat_map(|i| (0..PARAMETERS).map(move |j| (i, j)));
    each.filter(|&(i, j)| sigma[i] * sigma[j] > 0.0)
        .map(|(i, j)| ((a[(i, j)] - b[(i, j)]) / (sigma[i] * sigma[j])).abs())
        .fold(0.0, f64::max)
}

fn once_more(problem: &Problem, outcome: &Outcome) -> PassResult {
    let (priors, at) = (&outcome.prior_attitudes, &outcome.linearised_at);
    let gate: &[Innovation] = &outcome.innovations;
    pass(problem, priors, at, Mode::Held(Gate::As(gate))).unwrap()
}

#[test]
fn parts_add_to_the_covariance_of_the_estimate() {
    for aiding in [Aiding::Table, Aiding::Velocity] {
        let run = simulated("demo");
        let problem = Problem::new(&run, &Options::default().aiding(aiding));
        let outcome = estimate(&problem, &|_| {}).unwrap();
        let budget = Budget::new(&problem, &outcome).unwrap();
        let off = difference(&budget.covariance(), &outcome.estimate.covariance);
        println!("{aiding:?}: {off:.1e}");
        assert!(off < ROUNDING, "{off}");
        for part in &budget.parts {
            let own = part.covariance.symmetric_eigenvalues();
            assert!(own.min() > -1e-9 * own.max(), "{:?}", part.source);
        }
    }
}

/// With the filter's gains an optimal estimate's covariance does not change to first order when gains change,
/// so what a source adds is the derivative of the covariance of whole passes by its variance, times that.
#[test]
fn each_part_is_what_passes_lose_when_its_source_is_taken_away() {
    let run = simulated("real-table");
    let mut options = Options::default().noise(NoisePolicy::Stated);
    options = options.with(ErrorTerm::GaussMarkovBias);
    options = options.with(ErrorTerm::Instrument(Term::AccelSecondOrder));
    let problem = Problem::new(&run, &options);
    let outcome = estimate(&problem, &|_| {}).unwrap();
    let budget = Budget::new(&problem, &outcome).unwrap();
    let sources = budget.parts.iter().map(|part| part.source);
    let sources: Vec<BudgetSource> = sources.collect();
    println!("{sources:?}");
    let mut model = outcome.model.clone();
    // What dwells show of their own rest, said outright.
    let at_rest = problem.stretches()[0].stillness(&model, Sensor::Accel);
    model.stillness.accel = Some(at_rest);
    type Change = fn(&mut Model, f64);
    let changes: [(BudgetSource, Change); 11] = [
        (BudgetSource::GyroNoise, |m, f| {
            m.noise.gyro.random_walk *= f
        }),
        (BudgetSource::AccelNoise, |m, f| {
            m.noise.accel.random_walk *= f
        }),
        (BudgetSource::GyroWander, |m, f| {
            m.noise.gyro.gauss_markov.as_mut().unwrap().sigma *= f;
        }),
        (BudgetSource::AccelWander, |m, f| {
            m.noise.accel.gauss_markov.as_mut().unwrap().sigma *= f;
        }),
        (BudgetSource::VelocityAtRest, |m, f| {
            *m.stillness.accel.as_mut().unwrap() *= f;
        }),
        (BudgetSource::TablePosition, |m, f| m.position_sigma *= f),
        (BudgetSource::TableReading, |m, f| m.reading_sigma *= f),
        (BudgetSource::TableNorth, |m, f| m.geometry.base.z *= f),
        (BudgetSource::TableLevel, |m, f| {
            m.geometry.base.x *= f;
            m.geometry.base.y *= f;
        }),
        (BudgetSource::AccelSecondOrder, |m, f| m.term_sigma *= f),
        (BudgetSource::Prior, |m, f| m.prior_sigma *= f),
    ];
    const STEP: f64 = 0.02;
    let mut checked = Vec::new();
    for (source, change) in changes {
        let Some(part) = budget.parts.iter().find(|part| part.source == source) else {
            continue;
        };
        let covariance = |variance: f64| {
            let mut model = model.clone();
            change(&mut model, variance.sqrt());
            once_more(&problem.with_model(model), &outcome).covariance
        };
        let lost = (covariance(1.0 + STEP) - covariance(1.0 - STEP)) / (2.0 * STEP);
        let off = difference(&lost, &outcome.estimate.covariance);
        let by = part
            .covariance
            .diagonal()
            .component_div(&outcome.estimate.covariance.diagonal());
        let apart = {
            let sigma = outcome.estimate.sigma();
            let apart = lost - part.covariance;
            (0..PARAMETERS)
                .map(|i| (apart[(i, i)] / sigma[i].powi(2)).abs())
                .fold(0.0, f64::max)
        };
        println!(
            "{:32} {:.4} of all, {off:.4}, apart {apart:.1e}",
            source.name(),
            by.max()
        );
        // Of third order in the step.
        assert!(apart < STEP.powi(2), "{source:?}: {apart}");
        checked.push(source);
    }
    assert!(checked.len() >= 9, "{checked:?}");
}
