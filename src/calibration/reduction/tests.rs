use super::*;
use crate::calibration::pass::{Gate, Mode, PassResult, pass};
use crate::calibration::{ErrorTerm, Options, Outcome, Problem, UNWATCHED, estimate};
use crate::imu::Term;
use crate::run::Aiding;
use crate::simulation::Scenario;

/// A run, calibrated, with rows of this model at the point where it was.
fn against_passes(scenario: &str, options: &Options, off: &[ErrorTerm]) {
    let simulated = Scenario::load(scenario).unwrap().simulate(3, 0);
    let mut run = simulated.unwrap().run;
    // The cost of a pass does not count positions: let them say nothing.
    run.standstill.position_sigma = 1e3;
    let problem = Problem::new(&run, options);
    let mut outcome = estimate(&problem, UNWATCHED).unwrap();
    // A pass leaves a term that is off at the value where it is linearised.
    outcome.linearised_at.terms.fill(0.0);
    let problem = outcome.as_calibrated(&problem);
    let (priors, at) = (&outcome.prior_attitudes, &outcome.linearised_at);
    let reduction = outcome.reduction(&problem).unwrap();
    let both = |terms: &[ErrorTerm]| {
        let mut model = problem.model.clone();
        terms.iter().for_each(|&term| model.switch_off(term));
        let prior = Prior::new(&reduction.constants, &model, at);
        let gate = Gate::As(&outcome.innovations);
        let whole = pass(&problem.with_model(model), priors, at, Mode::Held(gate)).unwrap();
        (reduction.posterior(&prior).unwrap(), whole)
    };
    let compared = |(posterior, whole): &(Posterior, PassResult)| {
        let step = to_vector(&whole.estimate.triads) - to_vector(&at.triads);
        for (_, index) in reduction.parameters() {
            let sigma = whole.covariance[(index, index)].sqrt();
            let off = (posterior.parameters[index] - step[index]) / sigma;
            let ratio = posterior.parameter_covariance[(index, index)].sqrt() / sigma;
            assert!(off.abs() < 1e-6, "{scenario} {index}: {off} σ");
            assert!((ratio - 1.0).abs() < 1e-7, "{scenario} {index}: σ {ratio}");
        }
    };
    let (with, without) = (both(&[]), both(off));
    compared(&with);
    compared(&without);
    let ours = without.0.cost - with.0.cost;
    let theirs = without.1.cost - with.1.cost;
    assert!((ours - theirs).abs() < 1e-3, "{scenario}: {ours} {theirs}");
    let ours = without.0.deviance - with.0.deviance;
    let theirs = without.1.deviance() - with.1.deviance();
    assert!((ours - theirs).abs() < 1e-3, "{scenario}: {ours} {theirs}");
}

#[test]
fn a_prior_and_rows_are_a_pass_of_the_whole_filter_whatever_is_on() {
    let table = [
        ErrorTerm::TableBase,
        ErrorTerm::Instrument(Term::AccelSecondOrder),
        ErrorTerm::Instrument(Term::GSensitivity),
    ];
    let plain = Options::default();
    let with = table.into_iter().fold(plain.clone(), Options::with);
    against_passes("demo", &with, &table[..2]);
    let velocity = with.aiding(Aiding::Velocity);
    against_passes("nineteen-position", &velocity, &table[1..]);
    let varying = plain.with(ErrorTerm::GaussMarkovBias).with(table[2]);
    against_passes("mems", &varying, &table[2..]);
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
        outcome.posterior(&off, &reduction).unwrap()
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
