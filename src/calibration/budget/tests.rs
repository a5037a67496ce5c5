use super::*;
use crate::calibration::model::Model;
use crate::calibration::{ErrorTerm, NoisePolicy, Options, UNWATCHED, estimate};
use crate::imu::{Sensor, Term};
use crate::run::{Aiding, Run};
use crate::simulation::Scenario;

/// The square of the step of the differences.
const EXACT: f64 = 1e-4;

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

/// Covariance of the parameters with another model at the same point.
fn once_more(problem: &Problem, outcome: &Outcome) -> ParameterMatrix {
    let Solved {
        script, effects, ..
    } = &*outcome.solved;
    let chain = effects.chain(problem, script).unwrap();
    let weighed = effects.weighed(&chain, problem, script).unwrap();
    weighed.posterior.parameter_covariance
}

#[test]
fn parts_add_to_the_covariance_of_the_estimate() {
    for aiding in [Aiding::Table, Aiding::Velocity] {
        let run = simulated("demo");
        let problem = Problem::new(&run, &Options::default().aiding(aiding));
        let outcome = estimate(&problem, UNWATCHED).unwrap();
        let budget = Budget::new(&problem, &outcome).unwrap();
        let off = difference(&budget.covariance(), &outcome.estimate.covariance);
        println!("{aiding:?}: {off:.1e}");
        assert!(off < EXACT, "{off}");
        for part in &budget.parts {
            for i in outcome.estimate.estimated() {
                let share = part.covariance[(i, i)] / outcome.estimate.covariance[(i, i)];
                assert!(share > -EXACT, "{:?}: {share}", part.source);
            }
        }
    }
}

type Change = fn(&mut Model, f64);

/// Factors on what states the size of a source.
const CHANGES: [(BudgetSource, Change); 11] = [
    (BudgetSource::White(Sensor::Gyro), |m, f| {
        m.noise.gyro.random_walk *= f
    }),
    (BudgetSource::White(Sensor::Accel), |m, f| {
        m.noise.accel.random_walk *= f;
    }),
    (BudgetSource::TablePosition, |m, f| m.position_sigma *= f),
    (BudgetSource::TableReading, |m, f| m.reading_sigma *= f),
    (BudgetSource::Prior, |m, f| m.prior_sigma *= f),
    (BudgetSource::Wander(Sensor::Gyro), |m, f| {
        m.noise.gyro.gauss_markov.as_mut().unwrap().sigma *= f;
    }),
    (BudgetSource::Wander(Sensor::Accel), |m, f| {
        m.noise.accel.gauss_markov.as_mut().unwrap().sigma *= f;
    }),
    (BudgetSource::VelocityAtRest, |m, f| {
        *m.standstill_sigma.accel.as_mut().unwrap() *= f;
    }),
    (BudgetSource::TableNorth, |m, f| m.geometry.base.z *= f),
    (BudgetSource::TableLevel, |m, f| {
        m.geometry.base.x *= f;
        m.geometry.base.y *= f;
    }),
    (BudgetSource::Term(Term::AccelSecondOrder), |m, f| {
        m.term_sigma *= f
    }),
];

/// Where the gains are those of the least covariance it does not change to first order when they do: what a
/// source adds with the gains as they are is the derivative of the covariance of whole passes by its
/// variance, times that variance. Holds each part against passes; returns how many there were.
fn held_against_passes(run: &Run, options: &Options) -> usize {
    const STEP: f64 = 0.02;
    let problem = Problem::new(
        run,
        &options.clone().noise(NoisePolicy::Stated).no_auto_terms(),
    );
    let outcome = estimate(&problem, UNWATCHED).unwrap();
    let budget = Budget::new(&problem, &outcome).unwrap();
    let mut model = outcome.model.clone();
    let at_rest = problem.stretches()[0].standstill_sigma(&model, Sensor::Accel);
    model.standstill_sigma.accel = Some(at_rest);
    let sigma = outcome.estimate.sigma();
    let parts = CHANGES.into_iter().filter_map(|(source, change)| {
        let part = budget.parts.iter().find(|part| part.source == source)?;
        Some((part, change))
    });
    let mut checked = 0;
    for (part, change) in parts {
        let covariance = |factor: f64| {
            let mut model = model.clone();
            change(&mut model, factor.sqrt());
            once_more(&problem.with_model(model), &outcome)
        };
        let lost = (covariance(1.0 + STEP) - covariance(1.0 - STEP)) / (2.0 * STEP);
        let apart = lost - part.covariance;
        let apart = (0..PARAMETERS)
            .filter(|&i| sigma[i] > 0.0)
            .map(|i| (apart[(i, i)] / sigma[i].powi(2)).abs())
            .fold(0.0, f64::max);
        println!("{}: {apart:.1e} of the variance", part.source.name());
        // Of second order in the step.
        assert!(apart < STEP.powi(2), "{:?}: {apart}", part.source);
        checked += 1;
    }
    checked
}

#[test]
fn each_part_is_what_passes_lose_when_its_source_is_taken_away() {
    assert_eq!(
        held_against_passes(&simulated("demo"), &Options::default()),
        6
    );
}

#[test]
#[ignore = "slow: 22 passes with biases that vary"]
fn each_part_is_what_passes_lose_of_a_table_with_errors_and_biases_that_vary() {
    let order = ErrorTerm::Instrument(Term::AccelSecondOrder);
    let options = Options::default()
        .with(ErrorTerm::GaussMarkovBias)
        .with(order);
    assert_eq!(held_against_passes(&simulated("real-table"), &options), 11);
}

#[test]
#[ignore = "slow"]
fn each_part_is_what_passes_lose_of_records_without_a_table() {
    for name in ["mems", "nineteen-position"] {
        let run = simulated(name);
        assert!(held_against_passes(&run, &Options::default()) >= 4);
        let problem = Problem::new(&run, &Options::default());
        let outcome = estimate(&problem, UNWATCHED).unwrap();
        let budget = Budget::new(&problem, &outcome).unwrap();
        let off = difference(&budget.covariance(), &outcome.estimate.covariance);
        println!("{name}: {off:.1e}");
        assert!(off < EXACT, "{off}");
    }
}

#[test]
fn few_degrees_of_freedom_widen_the_interval() {
    // JCGM 100, table G.2: t of 95.45 %.
    for (freedom, t) in [
        (1.0, 13.97),
        (10.0, 2.28),
        (100.0, 2.025),
        (f64::INFINITY, 2.0),
    ] {
        assert!((coverage_factor(freedom) - t).abs() < 0.005, "{freedom}");
    }
}
