//! `turncal calibrate`

mod continued;
mod deliver;
mod follow;
mod incoming;
mod lines;
mod lot;
mod magnetometer;
mod merge;
mod not_met;
mod screen;

pub use magnetometer::of_magnetometer;
pub use merge::Merge;
pub use not_met::NotMet;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, bail};
use clap::error::ErrorKind;

use crate::arguments::{
    Estimation, OfLog, Overwrite, REQUIRED, one_of, run_file, run_or_log, seconds, shard,
};
use crate::terminal::Activity;
use turncal::calibration::{AtRest, Method, Problem, Solution, Together, in_body_frame, triads_of};
use turncal::imu::{BodyFrame, InstallationForm};
use turncal::models;
use turncal::recording::Recording;
use turncal::run::Run;
use turncal::study::Shard;
use turncal_files::{Campaign, Opened, is_toml};
use turncal_report as report;
use turncal_report::Document;
use turncal_report::calibration::Truth;
use turncal_report::terminal::printable;

use follow::Follow;

/// Heading of the options for a log that is still being written.
const FOLLOWING: &str = "Following a log";

/// Estimates scale factors, misalignments and biases from a run
///
/// Writes DIR/calibration.json and DIR/report/, and prints a summary. Exit status: 0 if the values may be used; 1 if
/// they must not be used (verdict FAILED); 3 if --require or a specification is not met.
///
/// With --temperature, the parameters depend on the temperature column; if the recording has only one attitude, only
/// the biases do.
///
/// A campaign.toml lists several recordings of one instrument. These recordings are calibrated jointly: the parameters
/// may depend on temperature and differ from day to day.
///
/// A log with a magnetometer alone gives the ellipsoid of its values: symmetric matrix and hard iron.
///
/// If a sensor lies still in a different position in each of several logs, these logs are treated as one recording.
///
/// Several run.toml files (or, with --lot, logs) are the units of a lot. turncal writes the calibration of each unit
/// into DIR/units/NAME/ and a summary of the lot into DIR/lot.json, lot.csv and index.html. The lot lists units that
/// could not be calibrated, with the reason; the command then fails, but only after all results are written. If you run
/// the same command again, it calibrates only units that are missing or have changed.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal calibrate imu.csv --latitude 48.1 --sensor bmi088
  turncal calibrate my-run/run.toml
  turncal calibrate my-run/run.toml -o mine --truth my-run/truth.json
  turncal calibrate my-run/run.toml --method six-position
  turncal calibrate my-run/run.toml --aiding velocity
  turncal calibrate my-run/run.toml --json | jq .gyro.scale
  turncal calibrate my-run/run.toml --temperature
  turncal calibrate x_up.csv x_down.csv y_up.csv y_down.csv z_up.csv
  turncal calibrate campaign.toml -o mine
  turncal calibrate lot/*/run.toml -o lot-result \\
      --specification specification.toml
  turncal calibrate --follow - --sensor bmi088 < /dev/ttyUSB0
  turncal calibrate --follow imu.csv --specification mems-by-hand
  turncal calibrate lot/*/run.toml --shard 3/8 -o part-3")]
pub struct Calibrate {
    /// A run.toml, a log, or - for text on standard input; several logs of a sensor that lies still count as one
    /// recording, and other runs are units of a lot; a campaign.toml lists recordings of one instrument
    #[arg(required = true, value_name = "RUN.toml|LOG", value_parser = run_or_log)]
    runs: Vec<PathBuf>,
    #[command(flatten)]
    of_log: OfLog,
    /// Output directory [default: NAME-calibration; NAME-calibration-six-position for this method; lot-calibration for
    /// a lot; none with --json]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    #[command(flatten)]
    estimation: Estimation,
    /// Let parameters depend on the temperature column of the run (the default for campaigns whose temperatures are
    /// known)
    #[arg(long, conflicts_with_all = ["specification", "shard"])]
    temperature: bool,
    /// True parameters of the instrument; the estimator does not use them, but the summary and the report show the
    /// errors
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Parameters that must be determined; if one of them is not, the exit status is 3
    #[arg(long, value_name = "PARAMETERS", value_parser = one_of(&REQUIRED), value_delimiter = ',', conflicts_with_all = ["specification", "shard"])]
    require: Vec<&'static str>,
    /// Treat each run as a unit of a lot, even if it is the log of a sensor that lies still
    #[arg(long, conflicts_with_all = ["follow", "truth", "temperature"])]
    lot: bool,
    /// Limits for the units of a lot (a specification.toml)
    #[arg(long, value_name = "FILE", conflicts_with = "truth")]
    specification: Option<PathBuf>,
    /// Calibrate part i of M of a lot; turncal merge combines the parts
    #[arg(long, value_name = "i/M", value_parser = shard, requires = "output", conflicts_with_all = ["json", "truth"], help_heading = "Advanced")]
    shard: Option<Shard>,
    /// Follow a growing log, standard input (-) or a serial device: show the current accuracy and the next move, and
    /// calibrate when the specification can be decided, when no more rows arrive, or when Ctrl-C is pressed
    #[arg(long, conflicts_with_all = ["shard", "temperature", "truth"], help_heading = FOLLOWING)]
    follow: bool,
    /// File in which rows from standard input (-) or a device are saved; if the file exists, it must contain rows of
    /// the same kind, and new rows are appended [default: follow-TIME.csv]
    #[arg(long, value_name = "FILE", requires = "follow", help_heading = FOLLOWING)]
    keep: Option<PathBuf>,
    /// run.toml that describes the rows; rows from standard input (-) or a device are saved in the log file named
    /// there, which must not exist yet
    #[arg(long, value_name = "RUN.toml", requires = "follow", conflicts_with = "keep", value_parser = run_file, help_heading = FOLLOWING)]
    run: Option<PathBuf>,
    /// Time in s after which a followed file that has not grown counts as complete
    #[arg(long, value_name = "S", requires = "follow", value_parser = seconds, default_value = "30", help_heading = FOLLOWING)]
    patience: Duration,
    /// Print the calibration, or the evaluation of the lot, as a single JSON document, without any other output
    #[arg(long)]
    json: bool,
    /// Print all parameters, tests and findings
    #[arg(short, long, conflicts_with = "json")]
    verbose: bool,
    #[command(flatten)]
    overwrite: Overwrite,
}

impl Calibrate {
    pub fn run(&self) -> anyhow::Result<()> {
        self.estimation.check();
        if self.follow {
            return self.followed();
        }
        match self.runs.as_slice() {
            [file] if !self.is_of_lot() => {
                if Campaign::is_at(file) {
                    self.campaign(file)
                } else {
                    self.one(file)
                }
            }
            [first, ..] if self.are_logs() && !self.is_of_lot() => self.positions(first),
            _ => self.units(),
        }
    }

    /// Whether an option says that the runs are units of a lot.
    fn is_of_lot(&self) -> bool {
        self.lot || self.specification.is_some() || self.shard.is_some()
    }

    fn are_logs(&self) -> bool {
        self.runs.iter().all(|run| !is_toml(run))
    }

    /// Several logs: of one sensor at rest, or else of the units of a lot.
    fn positions(&self, first: &Path) -> anyhow::Result<()> {
        let activity = Activity::new(format!("reading {}", first.display()));
        let count = self.runs.len();
        let Some(opened) = self.of_log.open_positions(&self.runs)? else {
            drop(activity);
            tell!(
                "note: the sensor was turned in these {count} logs, so turncal treats the logs as units of a lot \
                 (--lot)"
            );
            return self.units();
        };
        tell!(
            "note: the sensor lies still in each of these {count} logs, so turncal treats the logs as one recording \
             of one sensor; for several sensors, add --lot"
        );
        let runs: Vec<&Run> = opened.iter().map(|opened| &opened.run).collect();
        let together = Together {
            temperature: None,
            ..Together::default()
        };
        let problem = self.estimation.together(&runs, &together)?;
        let whole = first.canonicalize().unwrap_or_else(|_| first.to_owned());
        let directory = whole.parent().and_then(Path::file_name);
        let name = directory.unwrap_or("positions".as_ref()).to_string_lossy();
        self.solved(&problem, &name, (first, None), activity)
    }

    /// The units of a lot.
    fn units(&self) -> anyhow::Result<()> {
        let message = if self.truth.is_some() {
            "--truth applies only to a single run; to compare the units of a lot with their true values, use turncal \
             compare\n"
        } else if !self.require.is_empty() {
            "--require applies only to a single run; for the units of a lot, use --specification\n"
        } else {
            return self.lot();
        };
        clap::Error::raw(ErrorKind::ArgumentConflict, message).exit();
    }

    /// Follows a log until it ends, then calibrates it.
    fn followed(&self) -> anyhow::Result<()> {
        let [source] = self.runs.as_slice() else {
            let message =
                "--follow accepts only one log; calibrate several logs when they are complete\n";
            clap::Error::raw(ErrorKind::ArgumentConflict, message).exit();
        };
        let specification = self.specification.as_deref().map(models::specification);
        let specification = specification.transpose()?;
        let follow = Follow {
            source,
            of_log: &self.of_log,
            run: self.run.as_deref(),
            options: self.estimation.options(),
            specification,
            keep: self.keep.as_deref(),
            patience: self.patience,
            silent: self.json,
        };
        self.one(&follow.run()?)
    }

    fn one(&self, path: &Path) -> anyhow::Result<()> {
        let activity = Activity::new(format!("reading {}", path.display()));
        let opened = self.of_log.open_any(path)?;
        let run = &opened.run;
        if run.is_of_magnetometer() {
            return self.magnetometer(&opened, path);
        }
        let problem = if self.temperature {
            let together = Together::default();
            let problem = self.estimation.together(&[run], &together);
            let problem = problem.inspect_err(|_| say(&run.recording))?;
            // Without a turn, only the biases against temperature can be determined.
            if let Some(at_rest) = problem.at_rest() {
                return self.at_rest(&at_rest, &problem, (&opened, path));
            }
            problem
        } else {
            self.estimation.problem(run, path)?
        };
        self.solved(
            &problem,
            &run.recording.name,
            (path, Some(&opened)),
            activity,
        )
    }

    /// Biases of a stationary instrument against temperature.
    fn at_rest(
        &self,
        at_rest: &AtRest,
        problem: &Problem,
        (opened, path): (&Opened, &Path),
    ) -> anyhow::Result<()> {
        let calibration = at_rest.record(problem);
        let document = report::at_rest::document(at_rest, problem.run(), &calibration);
        self.deliver(&calibration, &document, (opened, path))
    }

    fn campaign(&self, path: &Path) -> anyhow::Result<()> {
        let activity = Activity::new(format!("reading {}", path.display()));
        let campaign = Campaign::read(path)?;
        let runs: Vec<&Run> = campaign.runs.iter().collect();
        let problem = self.estimation.together(&runs, &campaign.together);
        let problem = problem.inspect_err(|_| {
            runs.iter().for_each(|run| say(&run.recording));
        });
        let problem = problem.with_context(|| path.display().to_string())?;
        self.solved(&problem, &campaign.name, (path, None), activity)
    }
}

pub fn say(recording: &Recording) {
    for note in recording.doubts.iter().chain(&recording.notes) {
        tell!("note: {}", printable(note));
    }
}

/// Solves a calibration problem, and shows each pass while doing so.
pub fn solve(problem: &Problem, method: Method, activity: &Activity) -> anyhow::Result<Solution> {
    let name = &problem.run().recording.name;
    activity.next(format!("calibrating {name}"));
    let solution = problem.solve(method, &|pass| {
        activity.pass(pass);
        ControlFlow::Continue(())
    });
    solution.with_context(|| name.clone())
}

/// Writes a report into a new directory.
pub fn write_report(document: &Document, directory: &Path) -> anyhow::Result<()> {
    std::fs::create_dir(directory)
        .with_context(|| format!("cannot create {}", directory.display()))?;
    Ok(report::write(document, directory)?)
}

/// The truth, converted to the general form, which can represent all other forms.
pub fn read_truth(path: &Path, run: &Run, body_frame: BodyFrame) -> anyhow::Result<Truth> {
    let record = turncal_files::read_calibration(path)?;
    if let Some(unit) = &record.unit
        && *unit != run.instrument.unit
    {
        bail!(
            "{}: the units are {} and {}, but the units of the run are {} and {}. Give the truth file of this run",
            path.display(),
            unit.gyro,
            unit.accel,
            run.instrument.unit.gyro,
            run.instrument.unit.accel
        );
    }
    let triads = triads_of(&record, &run.instrument.nominal, InstallationForm::General);
    Ok(Truth {
        triads: in_body_frame(&triads, body_frame),
        terms: record.terms,
    })
}
