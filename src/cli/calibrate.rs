//! `turncal calibrate`

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::ValueEnum;
use clap::error::ErrorKind;
use rayon::prelude::*;
use turncal::calibration::result::TermRecord;
use turncal::calibration::{
    self, Calibration, CalibrationError, ClosedForm, Estimate, NoisePolicy, Options, Problem,
    Reference, Solution, in_body_frame, triads_of,
};
use turncal::imu::{BodyFrame, InstallationForm, PerSensor, Triad};
use turncal::report::Document;
use turncal::report::calibration::{self as of_calibration, Navigated, Report};
use turncal::report::terminal::printable;
use turncal::run::Run;
use turncal::study::navigation::{FORTY_HOURS, Mission, NavigationStudyError};

use super::error_term::TermArgument;
use super::input::run_file;
use super::output::{Overwrite, print, show};
use super::progress::Activity;

/// Estimates scale factors, installation and biases of a run
///
/// Writes DIR/calibration.json and DIR/report/ and prints a summary. A filter that does not converge is a
/// failure.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal calibrate my-run/run.toml
  turncal calibrate my-run/run.toml -o mine --truth my-run/truth.json
  turncal calibrate my-run/run.toml --method six-position
  turncal calibrate my-run/run.toml --aiding velocity
  turncal calibrate my-run/run.toml --json | jq .gyro.scale")]
pub struct Calibrate {
    /// The run's run.toml
    #[arg(value_name = "RUN.toml", value_parser = run_file)]
    run: PathBuf,
    /// Directory to write [default: NAME-calibration, NAME-calibration-six-position for that method;
    /// nothing with --json]
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
    /// Error terms to estimate, beside those that the run switches on
    #[arg(long, value_name = "TERM", value_enum, value_delimiter = ',')]
    with: Vec<TermArgument>,
    /// Which noise the filter uses
    #[arg(long, value_enum, default_value_t = Noise::default())]
    noise: Noise,
    /// True calibration; the estimator does not use it, summary and report show errors against it
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
    /// Zero velocity in every dwell, and the attitude of the table
    Table,
    /// Zero velocity alone; the accelerometers define the body axes
    Velocity,
}

/// Which noise the filter uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Noise {
    /// As run.toml and models state it
    Stated,
    /// As stated unless the data contradict that, which right figures do once in a thousand runs
    Auto,
    /// As the data show it, around what is stated
    Learnt,
}

impl Default for Noise {
    fn default() -> Self {
        match NoisePolicy::default() {
            NoisePolicy::Stated => Self::Stated,
            NoisePolicy::Auto => Self::Auto,
            NoisePolicy::Learnt => Self::Learnt,
        }
    }
}

impl From<Noise> for NoisePolicy {
    fn from(noise: Noise) -> Self {
        match noise {
            Noise::Stated => Self::Stated,
            Noise::Auto => Self::Auto,
            Noise::Learnt => Self::Learnt,
        }
    }
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

impl From<Aiding> for turncal::run::Aiding {
    fn from(aiding: Aiding) -> Self {
        match aiding {
            Aiding::Table => Self::Table,
            Aiding::Velocity => Self::Velocity,
        }
    }
}

impl From<Method> for calibration::Method {
    fn from(method: Method) -> Self {
        match method {
            Method::Ekf => Self::Ekf,
            Method::SixPosition => Self::SixPosition,
        }
    }
}

impl Calibrate {
    pub fn run(&self) -> anyhow::Result<()> {
        if let (Method::SixPosition, Some(term)) = (self.method, self.with.first()) {
            let message = format!(
                "--with {}: --method six-position estimates scale factors, installation and biases only; \
                 leave --with out, or estimate it by --method ekf\n",
                term.0.name()
            );
            clap::Error::raw(ErrorKind::ArgumentConflict, message).exit();
        }
        for term in &self.with {
            term.needs_table(self.aiding);
        }
        let activity = Activity::new(format!("reading {}", self.run.display()));
        let run = Run::read(&self.run)?;
        if self.aiding == Some(Aiding::Table) && run.recording.table.is_none() {
            return Err(CalibrationError::NoTable).with_context(|| self.run.display().to_string());
        }
        let form = self.installation.into();
        let mut options = Options::default()
            .installation(form)
            .noise(self.noise.into());
        options.aiding = self.aiding.map(turncal::run::Aiding::from);
        let mut problem = Problem::new(&run, &options);
        for term in &self.with {
            term.switch_on(&mut problem)?;
        }
        let body_frame = problem.model.aiding.body_frame();
        let truth = self
            .truth
            .as_deref()
            .map(|path| read_truth(path, &run, body_frame))
            .transpose()?;
        let (truth, true_terms) = truth.unzip();
        let true_terms = true_terms.unwrap_or_default();
        let truth_in_form = truth
            .as_ref()
            .map(|truth| PerSensor::from_fn(|sensor| truth.get(sensor).in_form(form)));
        let target = match (&self.output, self.json) {
            (Some(directory), _) => Some(directory.clone()),
            (None, true) => None,
            (None, false) => Some(PathBuf::from(match self.method {
                Method::Ekf => format!("{}-calibration", run.recording.name),
                Method::SixPosition => format!("{}-calibration-six-position", run.recording.name),
            })),
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

        // What was found in the files may be why.
        let solution = solve(&problem, self.method.into(), &activity)
            .inspect_err(|_| say(&run.recording.notes))?;
        let method = match self.method {
            Method::Ekf => "EKF",
            Method::SixPosition => "closed form",
        };
        let (assessment, navigation) = rayon::join(
            || solution.assess(&problem),
            || navigate(&run, &[(method, solution.estimate())], truth.as_ref()),
        );
        let assessment = assessment?;
        let calibration = solution.calibration(&problem, &assessment);
        let findings = solution.findings(&assessment);
        let note = solution.closed_form().map(note).unwrap_or_default();
        let dwells = dwell_times(&problem);
        let report = Report {
            title: &run.recording.name,
            run: &run,
            aiding: problem.model.aiding,
            body_frame: calibration.body_frame,
            outcome: solution.outcome(),
            findings: &findings,
            effects: &assessment.error_terms,
            quality: Some(&assessment.quality),
            true_terms: &true_terms,
            closed_form: solution
                .closed_form()
                .map(|closed_form| of_calibration::ClosedForm {
                    estimate: &closed_form.estimate,
                    note: &note,
                }),
            truth: truth_in_form.as_ref(),
            dwells: &dwells,
            navigation: navigation.as_deref(),
        };
        let document = report.document();
        activity.next("writing");
        if let Some(directory) = directory {
            calibration.write(&directory.path().join("calibration.json"), false)?;
            write_report(&document, &directory.path().join("report"))?;
            directory.commit()?;
        }
        drop(activity);
        if self.json {
            print(&calibration.to_json(Path::new("standard output"))?)?;
        } else {
            show(&document, false)?;
        }
        if let Some(target) = target.filter(|_| !self.json) {
            let page = target.join("report").join("index.html");
            eprintln!("\nreport: {}", printable(&page.display().to_string()));
        }
        if !solution.converged() {
            bail!(
                "{}: not converged; values and σ may not be used, see the findings",
                run.recording.name
            );
        }
        if !solution.is_usable() {
            bail!(
                "{}: no noise explains what the calibration leaves; values may not be used, see the findings",
                run.recording.name
            );
        }
        Ok(())
    }
}

fn say(notes: &[String]) {
    for note in notes {
        eprintln!("note: {}", printable(note));
    }
}

/// Solves a problem, the passes being shown.
pub fn solve(
    problem: &Problem,
    method: calibration::Method,
    activity: &Activity,
) -> anyhow::Result<Solution> {
    let name = &problem.run().recording.name;
    activity.next(format!("calibrating {name}"));
    let solution = problem.solve(method, &|pass| activity.pass(pass));
    solution.with_context(|| name.clone())
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
    format!("{from}, {minutes:.digits$} min at rest")
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
pub fn dwell_times(problem: &Problem) -> Vec<Range<f64>> {
    let imu = &problem.run().recording.imu;
    let dwells = problem.dwells();
    dwells
        .map(|dwell| imu.time(dwell.samples.start)..imu.time(dwell.samples.end))
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
    body_frame: BodyFrame,
) -> anyhow::Result<(PerSensor<Triad>, BTreeMap<String, TermRecord>)> {
    let record = Calibration::read(path)?;
    if let Some(unit) = &record.unit
        && *unit != run.instrument.unit
    {
        bail!(
            "{}: units are {} and {}, those of the run {} and {}; give the truth of this run",
            path.display(),
            unit.gyro,
            unit.accel,
            run.instrument.unit.gyro,
            run.instrument.unit.accel
        );
    }
    let triads = triads_of(&record, &run.instrument.nominal, InstallationForm::General);
    Ok((in_body_frame(&triads, body_frame), record.terms))
}
