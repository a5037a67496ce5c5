//! Simulations, studies of many of them, and paths before there are data.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use rayon::ThreadPoolBuilder;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use turncal::calibration::{ErrorTerm, NoisePolicy};
use turncal::imu::InstallationForm;
use turncal::models;
use turncal::models::Place;
use turncal::run::Aiding;
use turncal::simulation::{Scenario, SimulatedCampaign};
use turncal::study::navigation::FORTY_HOURS;
use turncal::study::path::{Named, PathError, PathStudy};
use turncal::study::{
    AccuracyStudy, ExperimentStudy, Shard, Study as Makes, StudyError, UNWATCHED,
};
use turncal_files::write_run;
use turncal_report::path::{Report as OfPath, in_words, moves_in_words};
use turncal_report::{Document, accuracy, experiment};

use crate::calibration::Calibration;
use crate::errors::{Given, named, names, raise, raised, wrong};
use crate::report::Report;
use crate::run::{Recorded, Run, asked_terms, error_terms, limits};
use crate::wait::{Progress, Watch, finish, wait};

/// Fewest and most runs of a study.
const RUNS: [u64; 2] = [2, 1_000_000];

#[pyfunction]
pub fn simulate(
    py: Python,
    scenario: &str,
    seed: Option<u64>,
    directory: Option<PathBuf>,
) -> PyResult<Run> {
    if SimulatedCampaign::is_named(scenario) {
        return campaign(py, scenario, seed, directory);
    }
    let scenario = Scenario::load(scenario).map_err(raise)?;
    let simulated = finish(py, move || {
        scenario.simulate(seed.unwrap_or(scenario.seed), 0)
    });
    let simulated = simulated?.map_err(raise)?;
    let truth = simulated.truth_record();
    if let Some(directory) = directory {
        std::fs::create_dir_all(&directory)?;
        write_run(&directory, &simulated.run, simulated.output, Some(&truth)).map_err(raise)?;
    }
    let truth = Py::new(py, Calibration::of_record(truth))?;
    Ok(Run::new(Recorded::of_run(simulated.run, None), Some(truth)))
}

fn campaign(
    py: Python,
    name: &str,
    seed: Option<u64>,
    directory: Option<PathBuf>,
) -> PyResult<Run> {
    if directory.is_some() {
        let expected =
            "a scenario of one recording. Use the command turncal simulate for a campaign.";
        return Err(wrong(
            "directory",
            format_args!("the campaign {name:?}"),
            expected,
        ));
    }
    let campaign = SimulatedCampaign::load(name).map_err(raise)?;
    let (name, together) = (campaign.name.clone(), campaign.together());
    let simulated = finish(py, move || {
        campaign.simulate(seed.unwrap_or(campaign.scenario.seed), 0)
    });
    let simulated = simulated?.map_err(raise)?;
    let truth = SimulatedCampaign::truth(&simulated).map(Calibration::of_record);
    let truth = truth.map(|truth| Py::new(py, truth)).transpose()?;
    let runs = simulated.into_iter().map(|of| of.run).collect();
    Ok(Run::new(Recorded::of_campaign(name, runs, together), truth))
}

/// A study with its options, which JSON preserves.
#[derive(Clone, Serialize, Deserialize)]
enum Study {
    Accuracy(AccuracyStudy),
    Experiment(ExperimentStudy),
}

/// Calls a function with the study in a variant and the report on its outcome.
macro_rules! with_study {
    ($of:expr, $function:ident($($argument:expr),*)) => {
        match $of {
            Study::Accuracy(study) => $function(study, accuracy::document, $($argument),*),
            Study::Experiment(study) => $function(study, experiment::document, $($argument),*),
        }
    };
}

impl Study {
    fn accuracy(
        mut scenario: Scenario,
        runs: u64,
        seed: u64,
        modelled: &[ErrorTerm],
        unmodelled: Vec<ErrorTerm>,
    ) -> Self {
        scenario.body_frame = Aiding::Table.body_frame();
        for &term in modelled.iter().chain(&unmodelled) {
            scenario = scenario.with_error_term(term);
        }
        Self::Accuracy(AccuracyStudy {
            scenario,
            form: InstallationForm::default(),
            unmodelled,
            auto_terms: true,
            noise: NoisePolicy::Stated,
            runs,
            seed,
        })
    }

    fn experiment(scenario: Scenario, samples: u64, seed: u64) -> PyResult<Self> {
        let (trajectory, trajectory_name) =
            models::trajectory("flight", &Place::CommandLine).map_err(raise)?;
        Ok(Self::Experiment(ExperimentStudy {
            scenario,
            trajectory,
            trajectory_name,
            intervals: FORTY_HOURS,
            samples,
            seed,
        }))
    }

    fn of_json(json: &str) -> PyResult<Self> {
        serde_json::from_str(json).map_err(raise)
    }

    fn runs(&self) -> u64 {
        match self {
            Self::Accuracy(study) => study.runs,
            Self::Experiment(study) => study.samples,
        }
    }
}

/// Options of a study as JSON, for [`study`], [`study_part`] and [`study_merged`].
#[pyfunction]
pub fn study_options(
    name: &str,
    scenario: Option<&str>,
    runs: u64,
    seed: Option<u64>,
    with_: Given,
    unmodelled: Given,
) -> PyResult<String> {
    if !(RUNS[0]..=RUNS[1]).contains(&runs) {
        let expected = format!("a whole number from {} to {}", RUNS[0], RUNS[1]);
        return Err(wrong("runs", runs, &expected));
    }
    let of = named("name", name, &[("accuracy", true), ("experiment", false)])?;
    if names("with_", with_)?.iter().any(|name| name == "none") {
        let expected = "names of terms. Omit it: a study estimates the terms that it simulates.";
        return Err(wrong("with_", "\"none\"", expected));
    }
    let (_, modelled) = asked_terms(with_)?;
    let unmodelled = error_terms("unmodelled", unmodelled)?;
    if !of && (scenario.is_some() || !modelled.is_empty() || !unmodelled.is_empty()) {
        return Err(raised(
            "study \"experiment\": found scenario, with_ or unmodelled, expected none of them. Omit them, or use study \
             \"accuracy\".",
        ));
    }
    let usual = if of { "demo" } else { "experiment" };
    let name = scenario.unwrap_or(usual);
    let scenario = Scenario::load(name).map_err(raise)?;
    let seed = seed.unwrap_or(scenario.seed);
    let study = if of {
        Study::accuracy(scenario, runs, seed, &modelled, unmodelled)
    } else {
        Study::experiment(scenario, runs, seed)?
    };
    serde_json::to_string(&study).map_err(raise)
}

/// The whole study on this computer.
#[pyfunction]
pub fn study(py: Python, options: &str, progress: Option<Py<PyAny>>) -> PyResult<Report> {
    let of = Study::of_json(options)?;
    let progress = Progress::new(py, progress, Some(of.runs()))?;
    let made = wait(py, &progress, move |watch| with_study!(&of, whole(watch)));
    made?.map(Report).map_err(raise)
}

fn whole<S: Makes>(
    study: &S,
    document: fn(&S::Outcome) -> Document,
    watch: &Watch,
) -> Result<Document, StudyError> {
    Ok(document(&study.run(&|| watch.step())?))
}

/// Runs of part `part` of `parts`, on one thread, as bytes.
#[pyfunction]
pub fn study_part<'py>(
    py: Python<'py>,
    options: &str,
    part: u64,
    parts: u64,
) -> PyResult<Bound<'py, PyBytes>> {
    let of = Study::of_json(options)?;
    let shard: Shard = format!("{part}/{parts}").parse().map_err(raise)?;
    let pool = ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .map_err(raise)?;
    let bytes = py.detach(|| pool.install(|| with_study!(&of, trials(shard))));
    Ok(PyBytes::new(py, &bytes.map_err(raised)?))
}

fn trials<S: Makes<Trial: Serialize>>(
    study: &S,
    _: fn(&S::Outcome) -> Document,
    shard: Shard,
) -> Result<Vec<u8>, String> {
    let runs: Vec<u64> = shard.runs(study.runs()).collect();
    let made = study.trials(&runs, UNWATCHED);
    // MessagePack preserves every bit of a number.
    let bytes = made.map(|made| rmp_serde::to_vec(&made));
    bytes
        .map_err(|error| error.to_string())?
        .map_err(|error| error.to_string())
}

/// The study of all its parts, in order.
#[pyfunction]
pub fn study_merged(py: Python, options: &str, parts: Vec<Vec<u8>>) -> PyResult<Report> {
    let of = Study::of_json(options)?;
    let document = finish(py, move || with_study!(&of, merged(&parts)))?;
    document.map(Report).map_err(raised)
}

fn merged<S: Makes<Trial: DeserializeOwned>>(
    study: &S,
    document: fn(&S::Outcome) -> Document,
    parts: &[Vec<u8>],
) -> Result<Document, String> {
    let mut all = Vec::new();
    for (bytes, part) in parts.iter().zip(1..) {
        let shard: Shard = format!("{part}/{}", parts.len())
            .parse()
            .map_err(|error: turncal::study::ShardError| error.to_string())?;
        let made: Vec<S::Trial> =
            rmp_serde::from_slice(bytes).map_err(|error| error.to_string())?;
        all.extend(shard.runs(study.runs()).zip(made));
    }
    all.sort_by_key(|(run, _)| *run);
    let trials = all.into_iter().map(|(_, trial)| trial).collect();
    let outcome = study.outcome(trials).map_err(|error| error.to_string())?;
    Ok(document(&outcome))
}

#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "called from one place, by keyword"
)]
pub fn evaluate(
    py: Python,
    path: String,
    scenario: Option<String>,
    imu: Option<String>,
    table: Option<String>,
    aiding: Option<&str>,
    with_: Given,
    specification: Option<PathBuf>,
) -> PyResult<Report> {
    let all = [("table", Aiding::Table), ("velocity", Aiding::Velocity)];
    let aiding = aiding.map(|name| named("aiding", name, &all)).transpose()?;
    let (auto_terms, terms) = asked_terms(with_)?;
    let limits = specification.as_deref().map(limits).transpose()?;
    let report = finish(py, move || {
        let mut study = PathStudy::load(&Named {
            path: &path,
            scenario: scenario.as_deref(),
            imu: imu.as_deref(),
            table: table.as_deref(),
            by_hand: false,
            aiding,
            terms,
        })?;
        study.options.auto_terms = auto_terms;
        let evaluation = study.evaluate()?;
        let checks = limits.map(|limits| evaluation.decided(&limits));
        let report = OfPath {
            name: &study.scenario.path_name,
            with: &in_words(&study),
            moves: &moves_in_words(&study.scenario),
            evaluation: &evaluation,
            checks: checks.as_deref(),
            design: None,
        };
        Ok::<_, PathError>(Report(report.document()))
    });
    report?.map_err(raise)
}
