//! `turncal calibrate`

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::ValueEnum;
use rayon::prelude::*;
use turncal::calibration::outcome::Estimate;
use turncal::calibration::{
    self, BlockEffect, CalibrationError, ClosedForm, Outcome, Quality, Reference, block_effects,
    in_body_frame, triads_of,
};
use turncal::imu::{InstallationForm, PerSensor, Triad};
use turncal::report::Document;
use turncal::report::calibration::{self as of_calibration, Navigated, Report};
use turncal::run::record::TermRecord;
use turncal::run::{CalibrationRecord, Run};
use turncal::study::navigation::{FORTY_HOURS, Mission, NavigationStudyError};

use super::block::Block;
use super::output::{Overwrite, print, show};
use super::progress::Activity;

/// Estimates scale factors, installation and biases of a run
///
/// Writes DIR/calibration.json and DIR/report/ and prints a summary.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal calibrate my-run/run.toml
  turncal calibrate my-run/run.toml -o result --truth my-run/truth.json
  turncal calibrate my-run/run.toml --aiding velocity
  turncal calibrate my-run/run.toml --json | jq .gyro.scale")]
pub struct Calibrate {
    /// The run's run.toml
    run: PathBuf,
    /// Directory to write [default: NAME-calibration, or nothing with --json]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// How to estimate
    #[arg(long, value_enum, default_value_t = Method::Ekf)]
    method: Method,
    /// How installation angles make the installation matrix
    #[arg(long, value_enum, default_value_t = Installation::General)]
    installation: Installation,
    /// What is observed [default: table if the run has its log, else velocity]
    #[arg(long, value_enum)]
    aiding: Option<Aiding>,
    /// Blocks of states to estimate, beside those that the run switches on
    #[arg(long, value_name = "BLOCK", value_enum, value_delimiter = ',')]
    with: Vec<Block>,
    /// True calibration; the estimator never sees it, summary and report show errors against it
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Print the calibration as one JSON document and nothing else
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overwrite: Overwrite,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Method {
    /// Extended Kalman filter over the whole run
    Ekf,
    /// Closed form: from the table's positions, else from labelled sections, else from gravity
    SixPosition,
}

/// An installation form.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Installation {
    /// Six direction cosines, rows of unit norm
    General,
    /// Six off-diagonal entries, unit diagonal
    SixAngle,
    /// Identity plus a cross-product matrix
    ThreeAngle,
}

/// What the filter observes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Aiding {
    /// Standstill, and the attitude of the table
    Table,
    /// Standstill alone; the accelerometers fix the body axes
    Velocity,
}

impl From<Installation> for InstallationForm {
    fn from(form: Installation) -> Self {
        match form {
            Installation::General => Self::General,
            Installation::SixAngle => Self::SixAngle,
            Installation::ThreeAngle => Self::ThreeAngle,
        }
    }
}

/// What a method gave.
enum Result {
    Filter(Box<Outcome>),
    ClosedForm(Box<ClosedForm>),
}

impl Result {
    fn outcome(&self) -> Option<&Outcome> {
        match self {
            Self::Filter(outcome) => Some(outcome),
            Self::ClosedForm(_) => None,
        }
    }

    fn closed_form(&self) -> Option<&ClosedForm> {
        match self {
            Self::Filter(_) => None,
            Self::ClosedForm(closed_form) => Some(closed_form),
        }
    }

    fn method(&self) -> (&'static str, &Estimate) {
        match self {
            Self::Filter(outcome) => ("EKF", &outcome.estimate),
            Self::ClosedForm(closed_form) => ("closed form", &closed_form.estimate),
        }
    }

    fn note(&self) -> String {
        self.closed_form().map(note).unwrap_or_default()
    }

    fn effects(&self, run: &Run) -> std::result::Result<Vec<BlockEffect>, CalibrationError> {
        let effects = self.outcome().map(|outcome| block_effects(run, outcome));
        effects.unwrap_or(Ok(Vec::new()))
    }

    fn quality(&self, run: &Run) -> std::result::Result<Quality, CalibrationError> {
        match self {
            Self::Filter(outcome) => outcome.quality(run),
            Self::ClosedForm(closed_form) => closed_form.quality(run),
        }
    }

    fn record(&self, run: &Run, effects: &[BlockEffect], quality: &Quality) -> CalibrationRecord {
        match self {
            Self::Filter(outcome) => outcome.record(run, effects, quality),
            Self::ClosedForm(closed_form) => closed_form.record(run, quality),
        }
    }
}

impl Calibrate {
    pub fn run(&self) -> anyhow::Result<()> {
        let activity = Activity::new(format!("reading {}", self.run.display()));
        let mut run = Run::read(&self.run)?;
        match self.aiding {
            Some(Aiding::Table) if run.table.is_none() => {
                return Err(CalibrationError::NoTable)
                    .with_context(|| self.run.display().to_string());
            }
            // What the filter is not to observe is not there.
            Some(Aiding::Velocity) => run.table = None,
            Some(Aiding::Table) | None => {}
        }
        for block in &self.with {
            block.switch_on(&mut run)?;
        }
        let form = self.installation.into();
        let truth = self
            .truth
            .as_deref()
            .map(|path| read_truth(path, &run))
            .transpose()?;
        let (truth, true_terms) = truth.unzip();
        let true_terms = true_terms.unwrap_or_default();
        let truth_in_form = truth
            .as_ref()
            .map(|truth| PerSensor::from_fn(|sensor| truth.get(sensor).in_form(form)));
        let target = match (&self.output, self.json) {
            (Some(directory), _) => Some(directory.clone()),
            (None, true) => None,
            (None, false) => Some(PathBuf::from(format!("{}-calibration", run.name))),
        };
        let directory = target
            .as_deref()
            .map(|target| {
                let inputs: Vec<&Path> = [Some(&self.run), self.truth.as_ref()]
                    .into_iter()
                    .flatten()
                    .map(PathBuf::as_path)
                    .collect();
                self.overwrite.directory(target, &inputs)
            })
            .transpose()?;

        let result = match self.method {
            Method::Ekf => Result::Filter(Box::new(filter(&run, form, &activity)?)),
            Method::SixPosition => {
                let closed_form = calibration::six_position(&run, form)
                    .with_context(|| self.run.display().to_string())?;
                Result::ClosedForm(Box::new(closed_form))
            }
        };
        let (effects, (quality, navigation)) = rayon::join(
            || result.effects(&run),
            || {
                let quality = result.quality(&run);
                (quality, navigate(&run, &[result.method()], truth.as_ref()))
            },
        );
        let (effects, quality) = (effects?, quality?);
        let record = result.record(&run, &effects, &quality);
        let note = result.note();
        let dwells = dwell_times(&run);
        let report = Report {
            title: &run.name,
            run: &run,
            body_frame: record.body_frame,
            outcome: result.outcome(),
            effects: &effects,
            quality: Some(&quality),
            true_terms: &true_terms,
            closed_form: result
                .closed_form()
                .map(|closed_form| of_calibration::ClosedForm {
                    estimate: &closed_form.estimate,
                    note: &note,
                    warnings: &closed_form.warnings,
                }),
            truth: truth_in_form.as_ref(),
            dwells: &dwells,
            navigation: navigation.as_deref(),
        };
        let document = report.document();
        activity.next("writing");
        if let Some(directory) = directory {
            record.write(&directory.path().join("calibration.json"), false)?;
            write_report(&document, &directory.path().join("report"))?;
            directory.commit()?;
        }
        drop(activity);
        if self.json {
            return print(&record.to_json(Path::new("standard output"))?);
        }
        show(&document, false)?;
        if let Some(target) = target {
            let page = target.join("report").join("index.html");
            eprintln!("\nreport: {}", page.display());
        }
        Ok(())
    }
}

/// Runs the filter; a run that does not converge is a failure.
pub fn filter(run: &Run, form: InstallationForm, activity: &Activity) -> anyhow::Result<Outcome> {
    activity.next(format!("calibrating {}", run.name));
    let outcome = calibration::estimate(run, form, &|pass| activity.pass(pass))
        .with_context(|| run.name.clone())?;
    if !outcome.converged {
        bail!("{}: {}", run.name, outcome.warnings.join(" "));
    }
    Ok(outcome)
}

/// What a closed form was made of, in a few words.
pub fn note(closed_form: &ClosedForm) -> String {
    let PerSensor { gyro, accel } = closed_form.positions;
    let turns = closed_form.turns;
    let from = match closed_form.reference {
        Reference::Table => {
            format!("{gyro} positions for the gyros, {accel} for the accelerometers")
        }
        Reference::Labels => format!("{accel} labelled positions and {turns} labelled turns"),
        Reference::Gravity => {
            format!("gravity in {accel} dwells and its direction over {turns} turns")
        }
    };
    let minutes = closed_form.standing_time / 60.0;
    let digits = usize::from(minutes < 10.0);
    format!("{from}, {minutes:.digits$} min of standing")
}

/// Navigates 40 h standing level at the run's site by the calibration of each method.
pub fn navigate(
    run: &Run,
    methods: &[(&'static str, &Estimate)],
    truth: Option<&PerSensor<Triad>>,
) -> std::result::Result<Vec<Navigated>, NavigationStudyError> {
    let mission = Mission::standing_level(&run.site, FORTY_HOURS);
    let all = methods.par_iter().map(|&(method, estimate)| {
        let outlook = mission.outlook(estimate, truth)?;
        Ok(Navigated { method, outlook })
    });
    all.collect()
}

/// Begin and end of each dwell, s.
pub fn dwell_times(run: &Run) -> Vec<Range<f64>> {
    run.dwells()
        .into_iter()
        .map(|dwell| run.imu.time(dwell.samples.start)..run.imu.time(dwell.samples.end))
        .collect()
}

/// Writes a report into a new directory.
pub fn write_report(document: &Document, directory: &Path) -> anyhow::Result<()> {
    std::fs::create_dir(directory)
        .with_context(|| format!("cannot create {}", directory.display()))?;
    Ok(turncal::report::write(document, directory)?)
}

/// In the general form, which can hold any truth, with the constants beside it that it states.
fn read_truth(
    path: &Path,
    run: &Run,
) -> anyhow::Result<(PerSensor<Triad>, BTreeMap<String, TermRecord>)> {
    let record = CalibrationRecord::read(path)?;
    if let Some(unit) = &record.unit
        && *unit != run.unit
    {
        bail!(
            "{}: units are {} and {}, those of the run {} and {}; give the truth of this run",
            path.display(),
            unit.gyro,
            unit.accel,
            run.unit.gyro,
            run.unit.accel
        );
    }
    let triads = triads_of(&record, &run.nominal, InstallationForm::General);
    Ok((in_body_frame(&triads, run.body_frame()), record.terms))
}
