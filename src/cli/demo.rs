//! `turncal demo`

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context, bail};
use turncal::calibration::{self, ClosedForm, Options, Problem};
use turncal::report::calibration::{self as of_calibration, Report};
use turncal::simulation::{Scenario, Simulated};

use super::calibrate::{dwell_times, navigate, note, solve, write_report};
use super::input::seed;
use super::output::{Overwrite, show};
use super::progress::Activity;
use super::simulate::{simulated, write};

/// Shows the main job on an embedded scenario
///
/// Simulates an instrument with the paper's errors on a three-axis table, ten minutes with turns for
/// the filter and an hour of static positions for the paper's closed form, calibrates it both ways,
/// compares both with the truth, navigates 40 h with each and writes a report. DIR is the filter's run
/// directory and holds ekf/ with its calibration, six-position/ with the static run and its
/// calibration, and report/.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:  turncal demo -o my-demo --seed 3")]
pub struct Demo {
    /// Directory to write
    #[arg(short, long, value_name = "DIR", default_value = "turncal-demo")]
    output: PathBuf,
    /// Seed of all random numbers [default: the scenario's]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = seed)]
    seed: Option<u64>,
    #[command(flatten)]
    overwrite: Overwrite,
}

impl Demo {
    pub fn run(&self) -> anyhow::Result<()> {
        let directory = self.overwrite.directory(&self.output, &[])?;
        let activity = Activity::new("simulating both runs");
        // The same seed gives both runs the same instrument.
        let (turning, standing) = rayon::join(
            || simulated(&Scenario::load("demo")?, self.seed),
            || static_positions(self.seed),
        );
        let (turning, (standing, closed_form)) = (turning?, standing?);
        let run = &turning.run;
        let problem = Problem::new(run, &Options::default());
        let solution = solve(&problem, calibration::Method::Ekf, &activity)?;
        if !solution.converged() {
            bail!("the demonstration did not converge; take another --seed");
        }

        let note = note(&closed_form);
        let dwells = dwell_times(&problem);
        activity.next("navigating");
        let methods = [
            ("closed form", &closed_form.estimate),
            ("EKF", solution.estimate()),
        ];
        let (assessment, navigation) = rayon::join(
            || solution.assess(&problem),
            || navigate(run, &methods, Some(&turning.truth)),
        );
        let assessment = assessment?;
        let mut findings = closed_form.findings.clone();
        findings.extend(solution.findings(&assessment));
        let report = Report {
            title: "turncal demo",
            run,
            aiding: problem.model.aiding,
            body_frame: problem.model.aiding.body_frame(),
            outcome: solution.outcome(),
            findings: &findings,
            effects: &assessment.error_terms,
            quality: Some(&assessment.quality),
            true_terms: &BTreeMap::new(),
            closed_form: Some(of_calibration::ClosedForm {
                estimate: &closed_form.estimate,
                note: &note,
            }),
            truth: Some(&turning.truth),
            dwells: &dwells,
            navigation: navigation.as_deref(),
        };
        let document = report.document();
        activity.next("writing");
        let root = directory.path();
        write(&turning, &root)?;
        let method = |name: &str| -> anyhow::Result<PathBuf> {
            let path = root.join(name);
            std::fs::create_dir(&path)
                .with_context(|| format!("cannot create {}", path.display()))?;
            Ok(path)
        };
        let (filtered, closed) = (method("ekf")?, method("six-position")?);
        write(&standing, &closed)?;
        let record = solution.calibration(&problem, &assessment);
        record.write(&filtered.join("calibration.json"), false)?;
        let standing = Problem::new(&standing.run, &Options::default());
        let record = closed_form.record(&standing, &closed_form.quality(&standing)?);
        record.write(&closed.join("calibration.json"), false)?;
        write_report(&document, &root.join("report"))?;
        directory.commit()?;
        drop(activity);

        show(&document, false)?;
        let page = self.output.join("report").join("index.html");
        eprintln!("\nreport: {}", page.display());
        Ok(())
    }
}

/// The static positions and what the closed form makes of them.
fn static_positions(seed: Option<u64>) -> anyhow::Result<(Simulated, ClosedForm)> {
    let standing = simulated(&Scenario::load("demo-six-position")?, seed)?;
    let problem = Problem::new(&standing.run, &Options::default());
    let closed_form = calibration::six_position(&problem)?;
    Ok((standing, closed_form))
}
