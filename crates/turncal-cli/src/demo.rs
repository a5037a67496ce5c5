//! `turncal demo`

use std::collections::BTreeMap;
use std::path::PathBuf;
use turncal_files::write_calibration;

use anyhow::{Context, bail};
use rayon::prelude::*;

use super::calibrate::{solve, write_report};
use super::simulate::{simulated, write};
use crate::arguments::{Overwrite, seed};
use crate::terminal::{Activity, show_brief};
use turncal::calibration;
use turncal::calibration::{
    Assessment, Calibration, ClosedForm, Estimate, Method, Options, Problem, Solution,
};
use turncal::imu::{PerSensor, Triad};
use turncal::models;
use turncal::models::Place;
use turncal::run::{Dwell, Run};
use turncal::simulation::{Scenario, Simulated};
use turncal::study::navigation::{FORTY_HOURS, Mission, Motion, navigate_with_each};
use turncal_files::record_inputs;
use turncal_report::calibration as of_calibration;
use turncal_report::calibration::{Report, dwell_times, note};
use turncal_report::navigation::{Flown, add_missions};
use turncal_report::{Document, Facts};

/// Simulates a calibration and compares it with the truth
///
/// Simulates an instrument with the errors of the paper on a three-axis table: ten minutes of turns for the filter, and
/// an hour of static positions for the closed form of the paper. Calibrates the instrument with both methods, compares
/// both calibrations with the truth, navigates for 40 h with each calibration, and writes a report. DIR itself is the
/// run directory for the filter. DIR also contains ekf/ with the filter calibration, six-position/ with the static run
/// and its calibration, and report/.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:  turncal demo -o my-demo --seed 3")]
pub struct Demo {
    /// Directory in which to write the output
    #[arg(short, long, value_name = "DIR", default_value = "turncal-demo")]
    output: PathBuf,
    /// Random seed [default: the scenario's]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = seed)]
    seed: Option<u64>,
    #[command(flatten)]
    overwrite: Overwrite,
}

impl Demo {
    pub fn run(&self) -> anyhow::Result<()> {
        let directory = self.overwrite.directory(&self.output, &[])?;
        let activity = Activity::new("simulating both runs");
        // With the same seed, both runs have the same instrument.
        let (turning, standing) = rayon::join(
            || simulated(&Scenario::load("demo")?, self.seed),
            || static_positions(self.seed),
        );
        let (turning, standing) = (turning?, standing?);
        let still = Problem::new(&standing.run, &Options::default());
        let whole = calibration::six_position(&still)?;
        let problem = Problem::new(&turning.run, &Options::default());
        let solution = solve(&problem, Method::Ekf, &activity)?;
        if !solution.converged() {
            bail!("the demonstration did not converge; choose another --seed");
        }
        let assessment = solution.assess(&problem)?;
        activity.next("navigating");
        let of_filter = solution.calibration(&problem, &assessment);
        let mut document = document(
            (&problem, &solution, &assessment, &of_filter),
            (&still, &whole),
            &turning,
        )?;

        activity.next("writing");
        let root = directory.path();
        write(&turning, &root)?;
        let [filtered, closed] = ["ekf", "six-position"].map(|method| root.join(method));
        for path in [&filtered, &closed] {
            std::fs::create_dir(path)
                .with_context(|| format!("cannot create {}", path.display()))?;
        }
        write(&standing, &closed)?;
        let of_closed_form = whole.record(&still, &whole.quality(&still)?);
        for (mut record, of, run, path) in [
            (of_filter, &root, &turning.run, filtered),
            (of_closed_form, &closed, &standing.run, closed.clone()),
        ] {
            record_inputs(&mut record, [&*of.join("run.toml")], run);
            write_calibration(&record, &path.join("calibration.json"), false)?;
        }
        write_report(&document, &root.join("report"))?;
        directory.commit()?;
        drop(activity);

        let page = self.output.join("report").join("index.html");
        let mut files = Facts::default();
        files.push("report", page.display().to_string());
        files.push("with a log of your own", "turncal calibrate LOG");
        document.brief.push(files.into());
        show_brief(&document)
    }
}

/// Report on the filter calibration, with the closed form from the same table time and from its full time.
fn document(
    (problem, solution, assessment, calibration): (&Problem, &Solution, &Assessment, &Calibration),
    (still, whole): (&Problem, &ClosedForm),
    turning: &Simulated,
) -> anyhow::Result<Document> {
    let run = problem.run();
    let minutes = |run: &Run| run.recording.imu.duration() / 60.0;
    let (table_time, whole_time) = (minutes(run), minutes(still.run()));
    let closed_form = cut(still, table_time / whole_time)?;
    let note = format!(
        "{}; only the first part of each dwell, so that the total is equal to the {table_time:.0} min table time of \
         the filter",
        note(&closed_form)
    );
    let methods = [
        ("closed form", &closed_form.estimate),
        ("EKF", solution.estimate()),
    ];
    let navigation = navigate_with_each(&run.site, &methods, Some(&turning.truth));
    let report = Report {
        title: "turncal demo",
        run,
        aiding: problem.model.aiding,
        body_frame: problem.model.aiding.body_frame(),
        outcome: solution.outcome(),
        findings: solution.findings(),
        calibration,
        budget: assessment.budget.as_ref(),
        predicted: None,
        specification: None,
        quality: Some(&assessment.quality),
        true_terms: &BTreeMap::new(),
        closed_form: Some(of_calibration::ClosedForm {
            estimate: &closed_form.estimate,
            note: &note,
        }),
        truth: Some(&turning.truth),
        dwells: &dwell_times(problem),
        navigation: navigation.as_deref(),
    };
    let mut document = report.document();
    let estimates = [&closed_form.estimate, solution.estimate(), &whole.estimate];
    let names = [
        format!("closed form, {table_time:.0} min"),
        format!("EKF, {table_time:.0} min"),
        format!("closed form, {whole_time:.0} min"),
    ];
    add_missions(
        &mut document,
        &names,
        &fly(run, &estimates, &turning.truth)?,
    );
    Ok(document)
}

/// Static positions used by the closed form of the paper.
fn static_positions(seed: Option<u64>) -> anyhow::Result<Simulated> {
    simulated(&Scenario::load("demo-six-position")?, seed)
}

/// Closed form from the first part of each dwell, with a total time of this fraction of the run.
fn cut(problem: &Problem, part: f64) -> anyhow::Result<ClosedForm> {
    let imu = &problem.run().recording.imu;
    let at_rest: f64 = problem.dwells().map(|dwell| dwell.duration(imu)).sum();
    let moves = imu.duration() - at_rest;
    let part = (part * imu.duration() - moves) / at_rest;
    let dwells = problem.dwells();
    let dwells: Vec<Dwell> = dwells.map(|dwell| dwell.first_part(part, imu)).collect();
    Ok(calibration::six_position_of(problem, &dwells)?)
}

/// Navigates for 40 h with each estimate, stationary and in flight.
fn fly(run: &Run, estimates: &[&Estimate], truth: &PerSensor<Triad>) -> anyhow::Result<Vec<Flown>> {
    let (flight, _) = models::trajectory("flight", &Place::Embedded)?;
    let still = Mission::standing_level(&run.site, FORTY_HOURS);
    let flying = Mission {
        motion: Motion::Moving(flight.at_latitude(run.site.latitude)),
        ..still.clone()
    };
    let missions = [
        (
            "stationary and level",
            "When the body is stationary, gyro bias causes nearly all of the error, and only time at rest reduces the \
             σ of this bias.",
            still,
        ),
        (
            "in flight",
            "In flight, turns and accelerations bring in the scale factors and misalignments, which the filter \
             observes within minutes.",
            flying,
        ),
    ];
    let missions = missions.into_iter().map(|(how, shows, mission)| {
        let ends = estimates.par_iter().map(|estimate| {
            let outlook = mission.outlook(estimate, Some(truth))?;
            outlook.into_iter().last().context("no navigation")
        });
        Ok(Flown {
            how,
            shows,
            ends: ends.collect::<anyhow::Result<_>>()?,
        })
    });
    missions.collect()
}
