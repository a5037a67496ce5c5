//! What calibrations give, held to twelve digits: a change of the code shows in which figure it moved what.
//!
//! `TURNCAL_LOCK=write cargo test --release -- --ignored lock` rewrites `tests/suite/lock.json` on purpose.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use turncal::calibration::{
    Calibration, Method, NoisePolicy, Options, Problem, Solution, Together, UNWATCHED,
};
use turncal::run::Run;
use turncal::simulation::{Scenario, SimulatedCampaign};

use super::shared::shared;

/// By how much a parameter may move in units of its σ, and any other figure in parts of itself.
const SAME: f64 = 1e-9;
/// What twelve digits leave open of a value.
const LAST_DIGIT: f64 = 1.5e-11;
/// Seeds of each scenario: all, and those of the fast tier.
const SEEDS: u64 = 40;
const FAST_SEEDS: u64 = 2;
const SCENARIOS: [&str; 3] = ["demo", "mems", "nineteen-position"];
const CAMPAIGNS: [&str; 2] = ["days", "five-soaks"];
const RECORDS: [(&str, Method); 12] = [
    ("nineteen-position-clean", Method::Ekf),
    ("nineteen-position-full", Method::Ekf),
    ("nineteen-position-velocity", Method::Ekf),
    ("real-mems-lot-0", Method::Ekf),
    ("real-mems-lot-1", Method::Ekf),
    ("real-mems-raw-sections", Method::Ekf),
    ("real-mems-raw-sections", Method::SixPosition),
    ("real-mems-six-position", Method::Ekf),
    ("real-mems-six-position", Method::SixPosition),
    ("real-mems-static", Method::Ekf),
    ("three-axis-counts", Method::Ekf),
    ("three-axis-counts", Method::SixPosition),
];

/// The figures of one calibration.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Figures {
    /// Value and σ by parameter.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    parameters: BTreeMap<String, (f64, f64)>,
    /// What is no parameter, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    others: BTreeMap<String, f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    findings: Vec<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failure: Option<String>,
}

/// Twelve digits of a number.
fn rounded(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap()
}

impl Figures {
    fn of(problem: &Problem, method: Method) -> Self {
        let solved = problem.solve(method, UNWATCHED).and_then(|mut solution| {
            let assessment = solution.assess(problem)?;
            let record = solution.calibration(problem, &assessment);
            Ok((solution, record))
        });
        match solved {
            Ok((solution, record)) => Self::of_record(&solution, &record),
            Err(error) => Self {
                failure: Some(error.to_string()),
                ..Self::default()
            },
        }
    }

    fn of_record(solution: &Solution, record: &Calibration) -> Self {
        let of = |name: &String| {
            let sigma = record.sigma_of(name).copied().unwrap_or(0.0);
            (
                name.clone(),
                (rounded(record[name.as_str()]), rounded(sigma)),
            )
        };
        let terms = record.terms.iter();
        let terms = terms.map(|(name, term)| {
            let sigma = term.sigma.unwrap_or(0.0);
            (name.clone(), (rounded(term.value), rounded(sigma)))
        });
        let parameters = record.parameters.iter().map(of).chain(terms).collect();
        let mut others = BTreeMap::new();
        if let Some(outcome) = solution.outcome() {
            let cost = outcome.passes.last().map_or(0.0, |pass| pass.cost);
            others.insert("cost".to_owned(), rounded(cost));
            others.insert("passes".to_owned(), outcome.passes.len() as f64);
            others.insert("heading".to_owned(), rounded(outcome.attitude_sigma.z));
        }
        if let Some(consistency) = &record.consistency {
            others.insert("nis".to_owned(), rounded(consistency.all.nis));
        }
        let kinds = record.findings.iter().map(|finding| finding.kind.clone());
        Self {
            parameters,
            others,
            findings: kinds.collect(),
            failure: None,
        }
    }

    /// What differs from these, each with the largest difference of its kind.
    fn differences(&self, before: &Self) -> Vec<String> {
        let mut all = Vec::new();
        if self.failure != before.failure {
            all.push(format!(
                "failure {:?}, was {:?}",
                self.failure, before.failure
            ));
        }
        if self.findings != before.findings {
            all.push(format!(
                "findings {:?}, were {:?}",
                self.findings, before.findings
            ));
        }
        let names = |of: &Self| -> Vec<String> { of.parameters.keys().cloned().collect() };
        if names(self) != names(before) {
            all.push(format!(
                "parameters {:?}, were {:?}",
                names(self),
                names(before)
            ));
        }
        let pairs = || {
            self.parameters
                .iter()
                .filter_map(|(name, now)| Some((name, now, before.parameters.get(name)?)))
        };
        let moved = pairs().map(|(name, now, was)| {
            let off = now.0 - was.0;
            let digits = off.abs() <= LAST_DIGIT * was.0.abs();
            (name, if digits { 0.0 } else { off / was.1 })
        });
        let grown = pairs().map(|(name, now, was)| (name, part(now.1, was.1)));
        let others = self
            .others
            .iter()
            .filter_map(|(name, now)| Some((name, part(*now, *before.others.get(name)?))));
        for (kind, differences) in [
            ("moved, σ", moved.collect::<Vec<_>>()),
            ("σ", grown.collect()),
            ("other", others.collect()),
        ] {
            let size =
                |&&(_, by): &&(&String, f64)| if by.is_nan() { f64::INFINITY } else { by.abs() };
            let largest = differences
                .iter()
                .max_by(|a, b| size(a).total_cmp(&size(b)));
            if let Some((name, by)) = largest.filter(|of| size(of) > SAME) {
                all.push(format!("{kind}: {name} by {by:.2e}"));
            }
        }
        all
    }
}

/// By which part of itself a figure differs.
fn part(now: f64, was: f64) -> f64 {
    if now == was { 0.0 } else { now / was - 1.0 }
}

/// A calibration that is held.
enum Case {
    Record(PathBuf, Method),
    Seed(&'static str, u64),
    Campaign(&'static str),
}

impl Case {
    fn figures(&self) -> Figures {
        let options = Options::default();
        match self {
            Self::Record(directory, method) => {
                let run = turncal_files::read_run(&directory.join("run.toml")).unwrap();
                Figures::of(&Problem::new(&run, &options), *method)
            }
            Self::Seed(scenario, seed) => {
                let simulated = Scenario::load(scenario)
                    .unwrap()
                    .simulate(*seed, 0)
                    .unwrap();
                Figures::of(&Problem::new(&simulated.run, &options), Method::Ekf)
            }
            Self::Campaign(name) => {
                let campaign = SimulatedCampaign::load(name).unwrap();
                let simulated = campaign.simulate(1, 0).unwrap();
                let runs: Vec<&Run> = simulated.iter().map(|one| &one.run).collect();
                let together = Together {
                    day_to_day: campaign.day_to_day,
                    ..Together::default()
                };
                let options = options.noise(NoisePolicy::Stated);
                Figures::of(
                    &Problem::together(&runs, &options, &together).unwrap(),
                    Method::Ekf,
                )
            }
        }
    }
}

fn records(which: impl Fn(&str) -> bool) -> Vec<(String, Case)> {
    let held = RECORDS.into_iter().filter(|(name, _)| which(name));
    held.filter_map(|(name, method)| {
        let label = format!(
            "{name} {}",
            match method {
                Method::Ekf => "ekf",
                Method::SixPosition => "six-position",
            }
        );
        Some((label, Case::Record(shared(name)?, method)))
    })
    .collect()
}

fn seeds(count: u64) -> impl Iterator<Item = (String, Case)> {
    let of = move |scenario| {
        (1..=count).map(move |seed| (format!("{scenario} {seed}"), Case::Seed(scenario, seed)))
    };
    SCENARIOS.into_iter().flat_map(of)
}

/// Compares these with the file.
fn hold(cases: Vec<(String, Case)>) {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("tests/suite/lock.json");
    let found: Vec<_> = cases
        .into_par_iter()
        .map(|(name, case)| (name, case.figures()))
        .collect();
    let text = fs::read_to_string(&path).unwrap_or_else(|_| "{}".to_owned());
    let mut held: BTreeMap<String, Figures> = serde_json::from_str(&text).unwrap();
    let mut differ = 0;
    for (name, now) in &found {
        let differences = match held.get(name) {
            Some(before) => now.differences(before),
            None => vec!["not held".to_owned()],
        };
        differences
            .iter()
            .for_each(|difference| println!("{name}: {difference}"));
        differ += usize::from(!differences.is_empty());
    }
    if std::env::var_os("TURNCAL_LOCK").is_some_and(|word| word == "write") {
        held.extend(found);
        let lines = held.iter().map(|(name, figures)| {
            format!(
                "{}:{}",
                serde_json::json!(name),
                serde_json::to_string(figures).unwrap()
            )
        });
        let lines: Vec<String> = lines.collect();
        fs::write(&path, format!("{{\n{}\n}}\n", lines.join(",\n"))).unwrap();
        return;
    }
    assert_eq!(differ, 0, "of {} calibrations; see above", found.len());
}

#[test]
fn figures_of_a_few_calibrations_are_those_that_are_held() {
    let few = [
        "three-axis-counts",
        "nineteen-position-velocity",
        "real-mems-raw-sections",
    ];
    let few = records(|name| few.contains(&name));
    hold(few.into_iter().chain(seeds(FAST_SEEDS)).collect());
}

#[test]
#[ignore = "slow: 134 calibrations"]
fn figures_of_all_calibrations_are_those_that_are_held() {
    let campaigns = CAMPAIGNS.map(|name| (format!("{name} 1"), Case::Campaign(name)));
    let all = records(|_| true).into_iter().chain(campaigns);
    hold(all.chain(seeds(SEEDS)).collect());
}
