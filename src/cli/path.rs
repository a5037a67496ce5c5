//! `turncal path`

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Subcommand;

use crate::calibration::{ErrorTerm, Options, Word};
use crate::cli::NotMet;
use crate::cli::arguments::{Delivery, OfLog, error_term, needs_table};
use crate::cli::terminal::Activity;
use crate::formats::Opened;
use crate::models::{Instrument, Place, path_by_hand, specification, turntable};
use crate::report::path::{Report, moves_in_words};
use crate::run::Aiding;
use crate::simulation::Scenario;
use crate::study::path::{Evaluation, PathStudy};
use crate::units::DEGREE;

/// Predicts calibration accuracy for a path of a table or by hand, before any data exist
#[derive(Debug, clap::Args)]
#[command(arg_required_else_help = true)]
#[command(after_help = "Example:  turncal path evaluate three-axis")]
pub struct PathCommand {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Evaluate(Evaluate),
}

impl PathCommand {
    pub fn run(&self) -> anyhow::Result<()> {
        let Command::Evaluate(evaluate) = &self.command;
        evaluate.run()
    }
}

/// Predicts σ, the value of each move, and errors that a path cannot reveal
///
/// The path is a TOML file or an embedded name, or words for a sensor turned by hand: x_up … z_down, and turns such
/// as "turn x 90", separated by commas. For a run.toml, σ are those expected from its own recording. The prediction
/// is the Cramér–Rao bound for the stated noise. With a specification, the exit status is 3 if σ are too large to
/// decide a limit.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal path evaluate three-axis
  turncal path evaluate three-axis --imu navigation-fog -o expected
  turncal path evaluate z_up,x_up,x_down,y_up,y_down --imu bmi088
  turncal path evaluate my-run/run.toml")]
pub struct Evaluate {
    /// Path: a TOML file, an embedded name, words for turns by hand, or a run.toml
    path: String,
    /// Scenario with site, rate, instrument and table [default: demo; by hand: mems]
    #[arg(long, value_name = "SCENARIO")]
    scenario: Option<String>,
    /// Instrument that replaces the scenario's: a TOML file or an embedded name
    #[arg(long, value_name = "MODEL")]
    imu: Option<String>,
    /// Table that replaces the scenario's: a TOML file or an embedded name
    #[arg(long, value_name = "MODEL")]
    table: Option<String>,
    /// Observations of the filter [default: table; by hand: velocity]
    #[arg(long, value_enum)]
    aiding: Option<Aiding>,
    /// Error terms to estimate
    #[arg(long, value_name = "TERM", value_parser = error_term(), value_delimiter = ',')]
    with: Vec<ErrorTerm>,
    /// Limits that the calibration must decide (a specification.toml)
    #[arg(long, value_name = "FILE")]
    specification: Option<PathBuf>,
    #[command(flatten)]
    delivery: Delivery,
}

impl Evaluate {
    fn run(&self) -> anyhow::Result<()> {
        let specification = self.specification.as_deref().map(specification);
        let specification = specification.transpose()?;
        let file = Path::new(&self.path);
        let inputs: Vec<&Path> = std::iter::once(file)
            .chain(self.specification.as_deref())
            .collect();
        let begun = self.delivery.begin(&inputs)?;
        let activity = Activity::new("evaluating the path");
        let (name, with, moves, evaluation) = match is_run(file) {
            true => self.of_run(file)?,
            false => self.of_path()?,
        };
        drop(activity);
        let report = Report {
            name: &name,
            with: &with,
            moves: &moves,
            evaluation: &evaluation,
            specification: specification.as_ref(),
        };
        let document = report.document();
        begun.deliver(&document)?;
        match document.verdict {
            Some((Word::Undecided, text)) => Err(NotMet(format!("{name}: {text}")).into()),
            _ => Ok(()),
        }
    }

    fn options(&self, aiding: Aiding) -> Options {
        let terms = self
            .with
            .iter()
            .inspect(|&&term| needs_table(term, Some(aiding)));
        Options {
            terms: terms.copied().collect(),
            aiding: Some(aiding),
            ..Options::default()
        }
    }

    fn of_run(&self, file: &Path) -> anyhow::Result<(String, String, Vec<String>, Evaluation)> {
        let Opened { run, .. } = OfLog::default().open(file)?;
        let options = self.options(self.aiding.unwrap_or_else(|| run.aiding()));
        let evaluation = Evaluation::of_run(&run, &options).with_context(|| self.path.clone())?;
        let with = format!("Recording of {}, with the noise stated there", self.path);
        Ok((run.recording.name.clone(), with, Vec::new(), evaluation))
    }

    fn of_path(&self) -> anyhow::Result<(String, String, Vec<String>, Evaluation)> {
        let by_hand = self.path.contains(',') || self.path.starts_with("turn ");
        let usual = if by_hand { "mems" } else { "demo" };
        let mut scenario = Scenario::load(self.scenario.as_deref().unwrap_or(usual))?;
        if let Some(model) = &self.imu {
            scenario.instrument = Instrument::load(model, &Place::CommandLine)?;
        }
        if let Some(model) = &self.table {
            (scenario.table, scenario.table_name) = turntable(model, &Place::CommandLine)?;
        }
        if by_hand {
            scenario.integrator.lever_arm = Default::default();
            let along = path_by_hand(&self.path).and_then(|path| scenario.along(path, "by hand"));
            scenario = along.map_err(anyhow::Error::msg)?;
        } else {
            scenario = scenario.with_path(&self.path)?;
        }
        let aiding = match (self.aiding, by_hand) {
            (Some(aiding), _) => aiding,
            (None, true) => Aiding::Velocity,
            (None, false) => Aiding::Table,
        };
        scenario.body_frame = aiding.body_frame();
        for &term in &self.with {
            scenario = scenario.with_error_term(term);
        }
        let table = if by_hand {
            "turned by hand"
        } else {
            &scenario.table_name
        };
        let with = format!(
            "Instrument {}, {table}, {:.0} Hz, latitude {:.1}°",
            scenario.instrument.name,
            1.0 / scenario.integrator.period,
            scenario.site.latitude / DEGREE
        );
        let (name, moves) = (scenario.path_name.clone(), moves_in_words(&scenario));
        let options = self.options(aiding);
        let study = PathStudy {
            scenario,
            by_hand,
            options,
        };
        let evaluation = study.evaluate().with_context(|| format!("path {name}"))?;
        Ok((name, with, moves, evaluation))
    }
}

/// Whether a file describes a run.
fn is_run(file: &Path) -> bool {
    file.is_file() && std::fs::read_to_string(file).is_ok_and(|text| text.contains("turncal-run/"))
}
