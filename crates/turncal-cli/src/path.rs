//! `turncal path`

use crate::arguments::{AIDINGS, one_of};
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Subcommand;

use crate::NotMet;
use crate::arguments::{Delivery, OfLog, With, needs_table, with_value};
use crate::terminal::Activity;
use turncal::calibration::Word;
use turncal::models::specification;
use turncal::run::Aiding;
use turncal::study::path::{Evaluation, Named, PathStudy};
use turncal_files::Opened;
use turncal_input::small_file;
use turncal_report::path::{Report, in_words, moves_in_words};

/// Predicts the calibration accuracy of a table path or of moves by hand, before any data exist
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

/// Predicts the σ for a path, the value of each move, and the errors that the path cannot reveal
///
/// The path is a TOML file, an embedded name, or a list of moves by hand, separated by commas: x_up … z_down, and turns
/// such as "turn x 90". With a run.toml, turncal predicts the σ for the recording described by this file. The
/// prediction is the Cramér–Rao bound for the stated noise. With a specification, the exit status is 3 if the σ are too
/// large to decide any of the limits.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal path evaluate three-axis
  turncal path evaluate three-axis --imu navigation-fog -o expected
  turncal path evaluate z_up,x_up,x_down,y_up,y_down --imu bmi088
  turncal path evaluate my-run/run.toml")]
pub struct Evaluate {
    /// Path: a TOML file, an embedded name, a list of moves such as "z_up, turn x 90", or a run.toml
    path: String,
    /// Scenario that provides the site, rate, instrument and table [default: demo; by hand: mems]
    #[arg(long, value_name = "SCENARIO")]
    scenario: Option<String>,
    /// Instrument to use instead of the scenario's instrument: a TOML file or an embedded name
    #[arg(long, value_name = "MODEL")]
    imu: Option<String>,
    /// Table to use instead of the scenario's table: a TOML file or an embedded name
    #[arg(long, value_name = "MODEL")]
    table: Option<String>,
    /// Observations used by the filter [default: table; by hand: velocity]
    #[arg(long, value_parser = one_of(&AIDINGS))]
    aiding: Option<Aiding>,
    /// Error terms to estimate. auto: average over the absence and the typical magnitudes of every term; none: only K,
    /// E and D; or names of terms that are always estimated [default: auto]
    #[arg(long, value_name = "TERM", value_parser = with_value(), value_delimiter = ',')]
    with: Vec<With>,
    /// Specification; turncal tests whether the predicted σ are small enough to decide pass or fail
    #[arg(long, value_name = "FILE")]
    specification: Option<PathBuf>,
    #[command(flatten)]
    delivery: Delivery,
}

impl Evaluate {
    fn run(&self) -> anyhow::Result<()> {
        With::check(&self.with);
        let specification = self.specification.as_deref().map(specification);
        let specification = specification.transpose()?;
        let file = Path::new(&self.path);
        let inputs: Vec<&Path> = std::iter::once(file)
            .chain(self.specification.as_deref())
            .collect();
        let begun = self.delivery.begin(&inputs)?;
        let activity = Activity::new("evaluating the path");
        let (name, with, moves, evaluation) = if is_run(file) {
            self.of_run(file)?
        } else {
            self.of_path()?
        };
        drop(activity);
        let checks = specification.map(|of| evaluation.decided(&of));
        let report = Report {
            name: &name,
            with: &with,
            moves: &moves,
            evaluation: &evaluation,
            checks: checks.as_deref(),
        };
        let document = report.document();
        begun.deliver(&document)?;
        match document.verdict {
            Some((Word::Undecided, text)) => {
                Err(NotMet::Specification(format!("{name}: {text}")).into())
            }
            _ => Ok(()),
        }
    }

    fn named(&self) -> Named<'_> {
        Named {
            path: &self.path,
            scenario: self.scenario.as_deref(),
            imu: self.imu.as_deref(),
            table: self.table.as_deref(),
            aiding: self.aiding,
            terms: With::terms(&self.with).collect(),
        }
    }

    fn of_run(&self, file: &Path) -> anyhow::Result<(String, String, Vec<String>, Evaluation)> {
        let Opened { run, .. } = OfLog::default().open(file)?;
        let aiding = self.aiding.unwrap_or_else(|| run.aiding());
        With::terms(&self.with).for_each(|term| needs_table(term, Some(aiding)));
        let mut options = self.named().options(aiding);
        options.auto_terms = With::is_auto(&self.with);
        let evaluation = Evaluation::of_run(&run, &options).with_context(|| self.path.clone())?;
        let with = format!("Recording of {}, with the noise stated there", self.path);
        Ok((run.recording.name.clone(), with, Vec::new(), evaluation))
    }

    fn of_path(&self) -> anyhow::Result<(String, String, Vec<String>, Evaluation)> {
        let mut study = PathStudy::load(&self.named())?;
        study.options.auto_terms = With::is_auto(&self.with);
        let aiding = study.options.aiding;
        With::terms(&self.with).for_each(|term| needs_table(term, aiding));
        let name = study.scenario.path_name.clone();
        let moves = moves_in_words(&study.scenario);
        let evaluation = study.evaluate().with_context(|| format!("path {name}"))?;
        Ok((name, in_words(&study), moves, evaluation))
    }
}

/// Whether a file describes a run.
fn is_run(file: &Path) -> bool {
    file.is_file() && small_file::read_text(file).is_ok_and(|text| text.contains("turncal-run/"))
}
