use crate::calibration::pass::{Gate, pass};
use crate::calibration::{
    ErrorTerm, Options, Outcome, Prior, Problem, Reduction, UNWATCHED, estimate,
};
use crate::imu::Term;
use crate::run::Aiding;
use crate::simulation::Scenario;

/// A run, calibrated: what rows say with a prior by which these are off is what rows without columns of them say.
fn with_and_without_columns(scenario: &str, options: &Options, off: &[ErrorTerm]) {
    let simulated = Scenario::load(scenario).unwrap().simulate(3, 0);
    let run = simulated.unwrap().run;
    let problem = Problem::new(&run, options);
    let mut outcome = estimate(&problem, UNWATCHED).unwrap();
    // What is off is zero; navigation that does not know of it could be nowhere else.
    outcome.linearised_at.terms.fill(0.0);
    let problem = outcome.as_calibrated(&problem);
    let mut model = problem.model.clone();
    off.iter().for_each(|&term| model.switch_off(term));
    let without = problem.with_model(model);
    let of_all = outcome.posterior(&without, &outcome.reduction(&problem).unwrap());
    let of_few = outcome.posterior(&without, &outcome.reduction(&without).unwrap());
    let sigma = of_few.parameter_covariance.diagonal().map(f64::sqrt);
    for (_, index) in crate::calibration::constants::parameters(&of_few.constants) {
        let apart = (of_all.parameters[index] - of_few.parameters[index]) / sigma[index];
        let ratio = of_all.parameter_covariance[(index, index)].sqrt() / sigma[index];
        assert!(apart.abs() < 1e-6, "{scenario} {index}: {apart} σ");
        assert!((ratio - 1.0).abs() < 1e-7, "{scenario} {index}: σ {ratio}");
    }
    assert!((of_all.cost - of_few.cost).abs() < 1e-3);
    assert!((of_all.deviance - of_few.deviance).abs() < 1e-3);
}

#[test]
fn columns_that_are_off_change_nothing() {
    let table = [
        ErrorTerm::TableBase,
        ErrorTerm::Instrument(Term::AccelSecondOrder),
        ErrorTerm::Instrument(Term::GSensitivity),
    ];
    let plain = Options::default();
    let with = table.into_iter().fold(plain.clone(), Options::with);
    with_and_without_columns("demo", &with, &table[..2]);
    let velocity = with.aiding(Aiding::Velocity);
    with_and_without_columns("nineteen-position", &velocity, &table[1..]);
    let varying = plain.with(ErrorTerm::GaussMarkovBias).with(table[2]);
    with_and_without_columns("mems", &varying, &table[2..]);
}

/// Innovations need what is known of the constants as each comes in, rows do not.
#[test]
fn the_likelihood_of_all_innovations_is_that_of_the_rows() {
    let mut run = Scenario::load("demo").unwrap().simulate(3, 0).unwrap().run;
    // No innovation is kept of positions: let them say nothing.
    run.standstill.position_sigma = 1e3;
    let problem = Problem::new(&run, &Options::default());
    let outcome = estimate(&problem, UNWATCHED).unwrap();
    let deviance = |factor: f64| {
        let mut model = problem.model.clone();
        model.noise.gyro.random_walk *= factor;
        let problem = problem.with_model(model);
        let script = outcome.script(&problem).unwrap();
        let replay = pass(&problem, &script, Gate::As(&outcome.accepted())).unwrap();
        let rows = outcome.reduction(&problem).unwrap();
        (
            replay.deviance(),
            outcome.posterior(&problem, &rows).deviance,
        )
    };
    let (with, without) = (deviance(1.0), deviance(2.0));
    let (ours, theirs) = (without.0 - with.0, without.1 - with.1);
    assert!((ours - theirs).abs() < 1e-3, "{ours} {theirs}");
}

#[test]
fn a_term_that_is_off_is_zero_wherever_it_was_linearised() {
    let order = ErrorTerm::Instrument(Term::AccelSecondOrder);
    let scenario = Scenario::load("real-table").unwrap().with_error_term(order);
    let run = scenario.simulate(23, 0).unwrap().run;
    let problem = Problem::new(&run, &Options::default());
    let mut outcome = estimate(&problem, UNWATCHED).unwrap();
    let mut model = problem.model.clone();
    model.switch_off(order);
    let off = problem.with_model(model);
    let posterior = |outcome: &Outcome| {
        let reduction = outcome.reduction(&problem).unwrap();
        outcome.posterior(&off, &reduction)
    };
    let there = posterior(&outcome);
    let shift = outcome.linearised_at.terms;
    outcome.linearised_at.terms.fill(0.0);
    let at_zero = posterior(&outcome);
    assert!(shift.amax() > 0.0);
    let sigma = at_zero.parameter_covariance.diagonal().map(f64::sqrt);
    let apart = (there.parameters - at_zero.parameters).zip_map(&sigma, |apart, sigma| {
        if sigma > 0.0 {
            (apart / sigma).abs()
        } else {
            0.0
        }
    });
    let moved = at_zero.parameters.zip_map(&sigma, |moved, sigma| {
        if sigma > 0.0 {
            (moved / sigma).abs()
        } else {
            0.0
        }
    });
    println!("{} of {} σ", apart.amax(), moved.amax());
    assert!(apart.amax() < 1e-2 * moved.amax(), "{}", apart.amax());
}

#[test]
fn folded_rows_have_the_sums_of_all_rows() {
    let run = Scenario::load("demo").unwrap().simulate(3, 0).unwrap().run;
    let problem = Problem::new(&run, &Options::default());
    let outcome = estimate(&problem, UNWATCHED).unwrap();
    let script = outcome.script(&problem).unwrap();
    let mut accepted = outcome.accepted();
    // Both leave out the same.
    accepted[7] = false;
    let whole = script.reduce(&problem, &accepted).unwrap();
    let folded = script.fold(&problem, &accepted).unwrap();
    let rows = |of: &Reduction| of.parts.iter().map(|part| part.rows.nrows()).sum::<usize>();
    let columns = whole.constants.len() + 1;
    assert!(rows(&whole) > 5 * columns && rows(&folded) == columns);
    let scale = whole.squares().map_diagonal(f64::sqrt);
    let apart = (whole.squares() - folded.squares()).component_div(&(&scale * scale.transpose()));
    assert!(apart.amax() < 1e-12, "{}", apart.amax());
    let [all, few] = [&whole, &folded].map(|of| outcome.posterior(&problem, of));
    assert!((all.deviance - few.deviance).abs() < 1e-6 * all.deviance.abs());
    let sigma = all.covariance.diagonal().map(f64::sqrt);
    assert!((all.mean - few.mean).component_div(&sigma).amax() < 1e-6);
}

#[test]
fn sigma_without_some_rows_is_that_of_the_other_rows() {
    let run = Scenario::load("demo").unwrap().simulate(3, 0).unwrap().run;
    let problem = Problem::new(&run, &Options::default());
    let outcome = estimate(&problem, UNWATCHED).unwrap();
    let whole = outcome.reduction(&problem).unwrap();
    let prior = Prior::new(&whole.constants, &problem.model, &outcome.linearised_at);
    let last = whole.parts.last().unwrap().time;
    // A first part before all times, two groups, an empty one, and a last part after all times.
    let times = [0.2 * last, 0.5 * last, 0.8 * last, 0.8 * last];
    let found = whole.sigma_without(&prior, &times);
    assert_eq!(found.len(), 3);
    for (pair, found) in times.windows(2).zip(found) {
        let mut others = whole.clone();
        let is_between = |time: f64| time > pair[0] && time <= pair[1];
        others.parts.retain(|part| !is_between(part.time));
        assert_eq!(others.parts.len() < whole.parts.len(), pair[0] < pair[1]);
        let expected = others.posterior(&prior).parameter_covariance.diagonal();
        for (found, expected) in found.iter().zip(&expected.map(f64::sqrt)) {
            assert!(
                (found - expected).abs() <= 1e-9 * expected,
                "{found} {expected}"
            );
        }
    }
    assert!(whole.sigma_without(&prior, &[]).is_empty());
}
