//! `turncal demo`

use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::Write;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use clap::Parser;
use flate2::read::GzDecoder;
use rayon::prelude::*;
use turncal::calibration::{
    self, Assessment, ClosedForm, Estimate, Method, Options, Problem, Solution,
};
use turncal::imu::{PerSensor, Triad};
use turncal::models::{self, Place, path_by_hand};
use turncal::report::calibration::{self as of_calibration, Report, dwell_times, navigate, note};
use turncal::report::navigation::{Flown, add_missions};
use turncal::report::{Document, Facts};
use turncal::run::{Dwell, Run};
use turncal::simulation::{Scenario, Simulated};
use turncal::study::navigation::{FORTY_HOURS, Mission, Motion};
use turncal::turntable::Moves;
use turncal::units::DEGREE;

use super::calibrate::{solve, stamp, write_report};
use super::simulate::{simulated, write};

use crate::cli::Cli;
use crate::cli::arguments::{Overwrite, number, seed};
use crate::cli::terminal::{Activity, show_brief};

/// Simulates a calibration and compares it with the truth
///
/// Simulates an instrument with the paper's errors on a three-axis table: ten minutes with turns for the filter, and an
/// hour of static positions for the paper's closed form. Calibrates it with both methods, compares both with the truth,
/// navigates for 40 h with each and writes a report. DIR is the run directory of the filter. It contains ekf/ with the
/// filter calibration, six-position/ with the static run and its calibration, and report/.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal demo -o my-demo --seed 3
  turncal demo --follow --speed 10")]
pub struct Demo {
    /// Directory to write
    #[arg(short, long, value_name = "DIR", default_value = "turncal-demo")]
    output: PathBuf,
    /// Seed of all random numbers [default: the scenario's]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = seed)]
    seed: Option<u64>,
    /// Simulate a sensor turned by hand, and follow its rows as they arrive
    #[arg(long)]
    follow: bool,
    /// With --follow: playback speed, as a multiple of real time
    #[arg(long, value_name = "N", value_parser = speed, default_value = "5", requires = "follow")]
    speed: f64,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Path of the sensor turned by hand; its third dwell is too short to count.
const BY_HAND: &str = "z_up, turn x 180, turn y 20, x_up, x_down, turn z 90, y_up, y_down, turn y 180, turn z 180, \
                       turn x 90, turn x 180, turn y 90, z_up, turn z 180";
const TOO_SHORT: usize = 1;

/// How many times as fast as the sensor.
fn speed(text: &str) -> Result<f64, String> {
    number(text, 0.1, 1000.0)
}

impl Demo {
    pub fn run(&self) -> anyhow::Result<()> {
        if self.follow {
            return self.followed();
        }
        let directory = self.overwrite.directory(&self.output, &[])?;
        let activity = Activity::new("simulating both runs");
        // The same seed gives both runs the same instrument.
        let (turning, standing) = rayon::join(
            || simulated(&Scenario::load("demo")?, self.seed),
            || static_positions(self.seed),
        );
        let (turning, standing) = (turning?, standing?);
        let still = Problem::new(&standing.run, &Options::default());
        let whole = calibration::six_position(&still)?;
        let problem = Problem::new(&turning.run, &Options::default());
        let mut solution = solve(&problem, Method::Ekf, &activity)?;
        if !solution.converged() {
            bail!("the demonstration did not converge; take another --seed");
        }
        let assessment = solution.assess(&problem)?;
        activity.next("navigating");
        let mut document = document(
            (&problem, &solution, &assessment),
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
        let of_filter = solution.calibration(&problem, &assessment);
        let of_closed_form = whole.record(&still, &whole.quality(&still)?);
        for (mut record, of, path) in [
            (of_filter, &root, filtered),
            (of_closed_form, &closed, closed.clone()),
        ] {
            stamp(&mut record, &of.join("run.toml"));
            record.write(&path.join("calibration.json"), false)?;
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

impl Demo {
    /// Writes the rows of a sensor turned by hand into a growing log, and follows it.
    fn followed(&self) -> anyhow::Result<()> {
        let mut scenario = Scenario::load("mems")?;
        scenario.path = path_by_hand(BY_HAND).map_err(anyhow::Error::msg)?;
        if let Moves::Body { steps, .. } = &mut scenario.path.moves {
            steps[TOO_SHORT].dwell = 0.5;
        }
        let folder = tempfile::tempdir()?;
        let (whole, log) = (folder.path().join("sensor"), folder.path().join("imu.csv"));
        std::fs::create_dir(&whole)?;
        write(&simulated(&scenario, self.seed)?, &whole)?;
        let rows = GzDecoder::new(File::open(whole.join("imu.csv.gz"))?);
        let rows = std::io::read_to_string(rows)?;
        let latitude = (scenario.site.latitude / DEGREE).to_string();
        let arguments = [
            "turncal",
            "calibrate",
            "--follow",
            "--patience",
            "3",
            "--latitude",
        ];
        let mut arguments: Vec<OsString> = arguments.map(OsString::from).into();
        let output: [&OsStr; 4] = [
            latitude.as_ref(),
            log.as_ref(),
            "-o".as_ref(),
            self.output.as_ref(),
        ];
        arguments.extend(output.map(OsStr::to_owned));
        if self.overwrite.force {
            arguments.push("--force".into());
        }
        let mut file = File::create(&log)?;
        let pause = Duration::from_secs_f64(scenario.integrator.period / self.speed);
        let begun = Instant::now();
        let play = move || {
            for (number, row) in (0..).zip(rows.split_inclusive('\n')) {
                thread::sleep((pause * number).saturating_sub(begun.elapsed()));
                if file.write_all(row.as_bytes()).is_err() {
                    return;
                }
            }
        };
        thread::Builder::new().name("sensor".into()).spawn(play)?;
        Cli::try_parse_from(arguments)?.run()
    }
}

/// Report on the filter calibration, with the closed form from the same table time and from its full time.
fn document(
    (problem, solution, assessment): (&Problem, &Solution, &Assessment),
    (still, whole): (&Problem, &ClosedForm),
    turning: &Simulated,
) -> anyhow::Result<Document> {
    let run = problem.run();
    let minutes = |run: &Run| run.recording.imu.duration() / 60.0;
    let (table_time, whole_time) = (minutes(run), minutes(still.run()));
    let closed_form = cut(still, table_time / whole_time)?;
    let note = format!(
        "{}; first part of each dwell, equivalent to the {table_time:.0} min table time of the filter",
        note(&closed_form)
    );
    let methods = [
        ("closed form", &closed_form.estimate),
        ("EKF", solution.estimate()),
    ];
    let navigation = navigate(run, &methods, Some(&turning.truth));
    let report = Report {
        title: "turncal demo",
        run,
        aiding: problem.model.aiding,
        body_frame: problem.model.aiding.body_frame(),
        outcome: solution.outcome(),
        findings: &solution.findings(assessment),
        effects: &assessment.error_terms,
        budget: assessment.budget.as_ref(),
        predicted: None,
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

/// Closed form from the first part of each dwell, so that the total is this fraction of the run time.
fn cut(problem: &Problem, part: f64) -> anyhow::Result<ClosedForm> {
    let imu = &problem.run().recording.imu;
    let at_rest: f64 = problem.dwells().map(|dwell| dwell.duration(imu)).sum();
    let moves = imu.duration() - at_rest;
    let part = (part * imu.duration() - moves) / at_rest;
    let dwells = problem.dwells();
    let dwells: Vec<Dwell> = dwells.map(|dwell| dwell.first_part(part, imu)).collect();
    Ok(calibration::six_position_of(problem, &dwells)?)
}

/// Navigates 40 h by each estimate, stationary and in flight.
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
            "When stationary, gyro bias causes nearly all of the error, and only time at rest reduces its σ.",
            still,
        ),
        (
            "in flight",
            "In flight, turns and accelerations excite scale factors and misalignments, which the filter observes in \
             minutes.",
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
