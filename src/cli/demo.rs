//! `turncal demo`

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::Context;
use turncal::calibration::{self, ClosedForm};
use turncal::imu::InstallationForm;
use turncal::report::calibration::{self as of_calibration, Report};
use turncal::simulation::{Scenario, Simulated};

use super::calibrate::{dwell_times, filter, navigate, note, write_report};
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
    #[arg(long)]
    seed: Option<u64>,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Both installation forms of the demo are the general one.
const FORM: InstallationForm = InstallationForm::General;

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
        let outcome = filter(run, FORM, &activity)?;

        let note = note(&closed_form);
        let dwells = dwell_times(run);
        activity.next("navigating");
        let methods = [
            ("closed form", &closed_form.estimate),
            ("EKF", &outcome.estimate),
        ];
        let (effects, (quality, navigation)) = rayon::join(
            || calibration::block_effects(run, &outcome),
            || {
                let quality = outcome.quality(run);
                (quality, navigate(run, &methods, Some(&turning.truth)))
            },
        );
        let (effects, quality) = (effects?, quality?);
        let report = Report {
            title: "turncal demo",
            run,
            body_frame: run.body_frame(),
            outcome: Some(&outcome),
            effects: &effects,
            quality: Some(&quality),
            true_terms: &BTreeMap::new(),
            closed_form: Some(of_calibration::ClosedForm {
                estimate: &closed_form.estimate,
                note: &note,
                warnings: &closed_form.warnings,
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
        let record = outcome.record(run, &effects, &quality);
        record.write(&filtered.join("calibration.json"), false)?;
        let record = closed_form.record(&standing.run, &closed_form.quality(&standing.run)?);
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
    let closed_form = calibration::six_position(&standing.run, FORM)?;
    Ok((standing, closed_form))
}
