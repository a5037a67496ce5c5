//! Further terms of the instrument: recovered where they are modelled, betrayed where they are not.

use nalgebra::{DMatrix, DVector, SMatrix};
use rayon::prelude::*;
use turncal::calibration::result::{Calibration, EQUATION, EQUATION_WITH_TERMS};
use turncal::calibration::{
    ErrorTerm, NoisePolicy, Options, Outcome, Problem, UNWATCHED, estimate, mean_square_interval,
    to_vector,
};
use turncal::imu::{InstallationForm, TERM_PARAMETERS, Term, TermVector};
use turncal::simulation::{Scenario, Simulated};
use turncal::turntable::TABLE_GEOMETRY;

use crate::shared::{read, shared};
use crate::simulated::says;

/// With the noise that the run states, which is that of its data, and without terms that it does not state.
fn stated() -> Options {
    Options::default()
        .noise(NoisePolicy::Stated)
        .no_auto_terms()
}

const FORM: InstallationForm = InstallationForm::General;
/// Fixed before the first run was made.
const SEED: u64 = 41;

/// An instrument with one term, a tenth of what is usual before calibration and more than σ after it.
fn scenario(term: Term) -> Scenario {
    let mut scenario = Scenario::load("demo").unwrap();
    for parameter in term.parameters() {
        scenario.instrument.term_sigma[parameter] = term.usual_sigma();
    }
    scenario
}

/// 1σ of the parameters of terms.
fn sigma(outcome: &Outcome) -> TermVector {
    outcome
        .auxiliary
        .sigma()
        .fixed_rows::<TERM_PARAMETERS>(TABLE_GEOMETRY)
        .into()
}

/// NEES of a term's parameters in one run, and how many they are.
fn nees(term: Term, stream: u64) -> (f64, usize) {
    let Simulated { run, terms, .. } = scenario(term).simulate(SEED, stream).unwrap();
    let outcome = estimate(&Problem::new(&run, &stated()), UNWATCHED).unwrap();
    assert!(outcome.converged, "{}: {stream}", term.name());
    assert!(outcome.auxiliary.unobserved().next().is_none());
    let error = outcome.auxiliary.terms() - terms;
    let sigma = sigma(&outcome);
    let of_term: Vec<usize> = term.parameters().collect();
    // In units of σ the covariance is a correlation matrix, which inverts without loss.
    let correlation = DMatrix::from_fn(of_term.len(), of_term.len(), |a, b| {
        let [i, j] = [of_term[a], of_term[b]];
        let covariance = outcome.auxiliary.covariance[(TABLE_GEOMETRY + i, TABLE_GEOMETRY + j)];
        covariance / (sigma[i] * sigma[j])
    });
    let error = DVector::from_fn(of_term.len(), |a, _| error[of_term[a]] / sigma[of_term[a]]);
    let nees = error.dot(&correlation.cholesky().unwrap().solve(&error));
    (nees, of_term.len())
}

fn recovered_as_well_as_sigma_says(runs: u64) {
    for term in Term::ALL {
        let all: Vec<(f64, usize)> = (0..runs)
            .into_par_iter()
            .map(|stream| nees(term, stream))
            .collect();
        let count: usize = all.iter().map(|(_, count)| count).sum();
        let mean = all.iter().map(|(nees, _)| nees).sum::<f64>() / count as f64;
        let (low, high) = mean_square_interval(count, 0.002);
        let name = term.name();
        println!("{name}: NEES/n {mean:.3} of {count}, 99.8 % interval {low:.3} to {high:.3}");
        assert!((low..high).contains(&mean), "{name}: {mean}");
    }
}

#[test]
fn the_square_of_specific_force_in_gyros_is_recovered_as_well_as_its_sigma_says() {
    let all = [0, 1].map(|stream| nees(Term::G2Sensitivity, stream));
    let (low, high) = mean_square_interval(6, 0.002);
    let mean = all.iter().map(|(nees, _)| nees).sum::<f64>() / 6.0;
    assert!((low..high).contains(&mean), "{mean}");
}

#[test]
#[ignore = "slow: several calibrations"]
fn each_term_is_recovered_as_well_as_its_sigma_says() {
    recovered_as_well_as_sigma_says(2);
}

#[test]
#[ignore = "statistical: 120 runs"]
fn each_term_is_recovered_as_well_as_its_sigma_says_over_many_runs() {
    recovered_as_well_as_sigma_says(24);
}

#[test]
fn a_written_run_keeps_its_terms_and_its_truth_has_them() {
    let directory = tempfile::tempdir().unwrap();
    let (models, run) = (
        directory.path().join("scenario.toml"),
        directory.path().join("run"),
    );
    let instrument = directory.path().join("with-offset.toml");
    let paper = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/imu/paper.toml");
    let text =
        std::fs::read_to_string(paper).unwrap() + "\n[terms]\ntime-offset = { sigma = 2.0 }\n";
    std::fs::write(&instrument, text).unwrap();
    let demo = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../models/scenario/demo.toml"
    );
    let text = std::fs::read_to_string(demo).unwrap();
    let text = text.replace("model = \"paper\"", "model = \"with-offset.toml\"");
    std::fs::write(&models, text).unwrap();
    let mut command = assert_cmd::Command::new(env!("CARGO_BIN_EXE_turncal"));
    let simulate = command.arg("simulate").arg(&models).arg("-o").arg(&run);
    simulate.assert().success();

    let scenario = Scenario::load(models.to_str().unwrap()).unwrap();
    let made = scenario.simulate(scenario.seed, 0).unwrap();
    let read = turncal_files::read_run(&run.join("run.toml")).unwrap();
    assert_eq!(read.instrument.term_sigma, made.run.instrument.term_sigma);
    let truth = turncal_files::read_calibration(&run.join("truth.json")).unwrap();
    let offset = made.terms[Term::TimeOffset.parameters().start];
    assert_eq!(truth.terms["accel.time_offset"].value, offset);
    assert_eq!(truth.terms.len(), 1);
}

#[test]
fn with_none_no_error_term_of_the_instrument_is_estimated() {
    let directory = tempfile::tempdir().unwrap();
    let turncal = |arguments: &[&str]| {
        let mut command = assert_cmd::Command::new(env!("CARGO_BIN_EXE_turncal"));
        command.current_dir(&directory).args(arguments);
        command.assert().success()
    };
    turncal(&["simulate", "demo", "-o", "run"]);
    let calibrate = ["calibrate", "run/run.toml", "--json", "--with", "none"];
    let calibrated = turncal(&calibrate);
    let record: Calibration = serde_json::from_slice(&calibrated.get_output().stdout).unwrap();
    assert!(record.terms.is_empty(), "{:?}", record.terms);
}

#[test]
fn a_record_with_terms_says_that_the_correction_is_not_all() {
    let run = Scenario::load("real-table")
        .unwrap()
        .simulate(SEED, 0)
        .unwrap()
        .run;
    let equation = |options: &Options| {
        let problem = Problem::new(&run, options);
        let outcome = estimate(&problem, UNWATCHED).unwrap();
        let quality = outcome.quality(&problem).unwrap();
        outcome.record(&problem, &quality).equation.unwrap()
    };
    // Errors of the table are none of the instrument.
    assert_eq!(equation(&stated()), EQUATION);
    let with_term = stated().with(ErrorTerm::Instrument(Term::TimeOffset));
    assert_eq!(equation(&with_term), EQUATION_WITH_TERMS);
}

fn without_terms(term: Term) -> (Outcome, SMatrix<f64, 24, 1>) {
    let Simulated { mut run, truth, .. } = scenario(term).simulate(SEED, 0).unwrap();
    run.instrument.term_sigma = TermVector::zeros();
    let outcome = estimate(&Problem::new(&run, &stated()), UNWATCHED).unwrap();
    let error = outcome.estimate.vector() - to_vector(&truth);
    let normalised = error.component_div(&outcome.estimate.sigma());
    (outcome, normalised)
}

#[test]
fn a_term_that_is_not_modelled_spoils_parameters_and_shows_in_the_innovations() {
    for term in [
        Term::AccelSecondOrder,
        Term::AccelAsymmetry,
        Term::SizeEffect,
        Term::TimeOffset,
        Term::GSensitivity,
    ] {
        let (outcome, normalised) = without_terms(term);
        let nis = outcome.consistency.all.mean;
        println!("{}: NIS {nis:.2}, {:.1} σ", term.name(), normalised.amax());
        assert!(normalised.amax() > 5.0, "{}", term.name());
        assert!(nis > 1.2, "{}: {nis}", term.name());
        assert!(says(&outcome, "NIS"));
    }
}

#[test]
fn a_record_with_three_terms_gives_all_of_them_within_four_sigma() {
    let Some(directory) = shared("nineteen-position-full") else {
        return;
    };
    let run = read(&directory);
    let terms = [Term::AccelSecondOrder, Term::SizeEffect, Term::TimeOffset];
    let terms = terms.map(ErrorTerm::Instrument);
    let options = terms.into_iter().fold(stated(), Options::with);
    let outcome = estimate(&Problem::new(&run, &options), UNWATCHED).unwrap();
    let truth = turncal_files::read_calibration(&directory.join("truth.json")).unwrap();
    let truth = turncal::calibration::triads_of(&truth, &run.instrument.nominal, FORM);
    let error = outcome.estimate.vector() - to_vector(&truth);
    for index in outcome.estimate.estimated() {
        let sigmas = error[index] / outcome.estimate.sigma()[index];
        assert!(sigmas.abs() < 4.0, "{index}: {sigmas}");
    }
    // truth.json: f − Ka2 f², lever arms subtracted, f − tGA ω × f.
    let g = |micro_g: f64| -micro_g * 9.797e-6 / 9.797f64.powi(2);
    let arms = [-0.01, -0.02, -0.03, -0.04, -0.05, -0.06];
    let mut expected = TermVector::zeros();
    for (k, value) in [10.0, 20.0, 30.0].map(g).into_iter().enumerate() {
        expected[Term::AccelSecondOrder.parameters().start + k] = value;
    }
    for (k, value) in arms.into_iter().enumerate() {
        expected[Term::SizeEffect.parameters().start + k] = value;
    }
    expected[Term::TimeOffset.parameters().start] = 0.005;
    for k in 0..TERM_PARAMETERS {
        let sigma = sigma(&outcome)[k];
        let off = (outcome.auxiliary.terms()[k] - expected[k]).abs();
        assert!(
            off <= 4.0 * sigma,
            "{:?}: {off} of σ {sigma}",
            Term::parameter_name(k)
        );
        // Nothing is within four σ by knowing nothing.
        assert!(sigma <= 0.1 * expected[k].abs(), "{k}: {sigma}");
    }
}
