//! What error terms explain: the data show the right one, and what they do not show is in σ.

use rayon::prelude::*;
use turncal::calibration::{
    ErrorTerm, Estimate, Method, NoisePolicy, Options, Outcome, PARAMETERS, Problem, Solution,
    UNWATCHED, estimate, nees, to_vector,
};
use turncal::imu::Term;
use turncal::run::Run;
use turncal::simulation::Scenario;
use turncal::turntable::AxisError;

/// Fixed before the first run was made.
const SEED: u64 = 23;
const ORDER: ErrorTerm = ErrorTerm::Instrument(Term::AccelSecondOrder);

/// A run of an instrument or a table with an error term that run.toml does not state, or without.
fn simulated(unmodelled: Option<ErrorTerm>) -> Run {
    let mut scenario = Scenario::load("demo").unwrap();
    if let Some(term) = unmodelled {
        scenario = scenario.with_error_term(term);
    }
    let mut run = scenario.simulate(SEED, 0).unwrap().run;
    run.instrument.term_sigma.fill(0.0);
    run.table.geometry = Default::default();
    run
}

/// The terms that are named as there.
fn shown(outcome: &Outcome) -> Vec<ErrorTerm> {
    let terms = outcome.terms.iter().filter(|of| of.shown);
    terms.map(|of| of.term).collect()
}

#[test]
fn the_error_term_that_is_there_is_named_and_none_where_none_is() {
    let gyro = |term| Some(ErrorTerm::Instrument(term));
    named_is(vec![
        Some(ORDER),
        Some(ErrorTerm::TableAxes(AxisError::Tilt)),
        gyro(Term::GyroAsymmetry),
        gyro(Term::GyroNonlinearity),
        gyro(Term::G2Sensitivity),
        None,
    ]);
}

#[test]
#[ignore = "statistical: 13 runs"]
fn each_error_term_that_is_there_is_named() {
    // Positions at right angles do not tell errors of encoders and wobble from those of positions.
    let hidden = [AxisError::Encoder, AxisError::Wobble].map(ErrorTerm::TableAxes);
    let shown = |term: &ErrorTerm| !hidden.contains(term);
    let all = ErrorTerm::constant().filter(shown).map(Some);
    named_is(all.collect());
}

/// Terms that most paths do not tell from another.
fn alike(term: ErrorTerm) -> Vec<ErrorTerm> {
    let pairs = [
        [Term::AccelSecondOrder, Term::AccelAsymmetry],
        [Term::GyroSecondOrder, Term::GyroAsymmetry],
    ];
    let pairs = pairs.map(|pair| pair.map(ErrorTerm::Instrument));
    let pair = pairs.into_iter().find(|pair| pair.contains(&term));
    pair.map_or(vec![term], |pair| pair.to_vec())
}

/// For each of these error terms, which is there and not stated, or none.
fn named_is(all: Vec<Option<ErrorTerm>>) {
    let named = |unmodelled: Option<ErrorTerm>| {
        let run = simulated(unmodelled);
        let problem = Problem::new(&run, &Options::default());
        let outcome = estimate(&problem, UNWATCHED).unwrap();
        (unmodelled, shown(&outcome), outcome.findings)
    };
    let found: Vec<_> = all.into_par_iter().map(named).collect();
    for (unmodelled, shown, findings) in found {
        println!("{unmodelled:?}: {shown:?}");
        match unmodelled {
            None => assert!(shown.is_empty(), "{shown:?}"),
            Some(term) => {
                let alike = alike(term);
                assert!(!shown.is_empty(), "{term:?}");
                assert!(
                    shown.iter().all(|of| alike.contains(of)),
                    "{term:?}: {shown:?}"
                );
                let told = findings.iter().find(|of| of.kind == "error-term-estimated");
                let told = told.unwrap().figures["terms"].as_array().unwrap();
                let names = told.iter().map(|of| of["term"].as_str().unwrap());
                let is_alike = |name| alike.iter().any(|of| of.name() == name);
                assert!(names.clone().all(is_alike), "{told:?}");
            }
        }
    }
}

#[test]
fn an_error_term_that_the_data_show_is_in_the_estimate_and_in_sigma() {
    const RUNS: u64 = 4;
    let terms = [Term::GyroNonlinearity, Term::GyroAsymmetry];
    let trials: Vec<(Term, u64)> = terms
        .into_iter()
        .flat_map(|term| (0..RUNS).map(move |stream| (term, stream)))
        .collect();
    let mean_square = |(term, stream): (Term, u64)| {
        let scenario = Scenario::load("demo").unwrap();
        let scenario = scenario.with_error_term(ErrorTerm::Instrument(term));
        let mut simulated = scenario.simulate(SEED, stream).unwrap();
        simulated.run.instrument.term_sigma.fill(0.0);
        let all: Vec<usize> = (0..PARAMETERS).collect();
        let of = |options: Options| {
            let problem = Problem::new(&simulated.run, &options);
            let solution: Solution = problem.solve(Method::Ekf, UNWATCHED).unwrap();
            let Estimate { triads, covariance } = solution.estimate();
            let error = to_vector(triads) - to_vector(&simulated.truth);
            nees(&error, covariance, &all).unwrap().mean
        };
        let stated = Options::default().noise(NoisePolicy::Stated);
        let (without, with) = (of(stated.clone().no_auto_terms()), of(stated));
        println!("{term:?} {stream}: NEES/n {without:.2} without, {with:.2} with");
        (without, with)
    };
    let each = trials.into_par_iter().map(mean_square);
    let (without, with): (Vec<f64>, Vec<f64>) = each.unzip();
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    let (without, with) = (mean(&without), mean(&with));
    println!("NEES/n {without:.1} without, {with:.2} with");
    // 1 in 1,000 of 8 runs of 24 parameters is above 1.36.
    assert!(without > 5.0 && with < 1.36, "{without} {with}");
}

#[test]
#[ignore = "statistical: 200 runs"]
fn sound_runs_show_no_term_and_no_event() {
    const RUNS: u64 = 200;
    let scenario = Scenario::load("demo").unwrap();
    let alarms = (0..RUNS).into_par_iter().map(|stream| {
        let run = scenario.simulate(SEED, stream).unwrap().run;
        let problem = Problem::new(&run, &Options::default());
        let outcome = estimate(&problem, UNWATCHED).unwrap();
        let alarm = !shown(&outcome).is_empty() || !outcome.events.is_empty();
        if alarm {
            println!("{stream}: {:?} {:?}", shown(&outcome), outcome.events);
        }
        usize::from(alarm)
    });
    let alarms: usize = alarms.sum();
    // The probabilities of averages are approximate: none is named in 98 of 100.
    assert!(50 * alarms <= RUNS as usize, "{alarms} of {RUNS}");
}
