//! `turncal path`

mod design;
mod setting;

use std::path::Path;

use anyhow::Context;
use clap::Subcommand;

use crate::NotMet;
use crate::arguments::{Delivery, OfLog, With};
use crate::terminal::Activity;
use design::Design;
use setting::Setting;
use turncal::calibration::Word;
use turncal::study::path::{Evaluation, PathStudy};
use turncal_files::Opened;
use turncal_input::small_file;
use turncal_report::Document;
use turncal_report::path::{Report, in_words, moves_in_words};

/// Predicts calibration accuracy for a path, or designs a path, before any data exist
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
    Design(Design),
}

impl PathCommand {
    pub fn run(&self) -> anyhow::Result<()> {
        match &self.command {
            Command::Evaluate(evaluate) => evaluate.run(),
            Command::Design(design) => design.run(),
        }
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
    #[command(flatten)]
    setting: Setting,
    #[command(flatten)]
    delivery: Delivery,
}

impl Evaluate {
    fn run(&self) -> anyhow::Result<()> {
        With::check(&self.setting.with);
        let specification = self.setting.limits()?;
        let file = Path::new(&self.path);
        let inputs: Vec<&Path> = std::iter::once(file)
            .chain(self.setting.specification.as_deref())
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
            design: None,
        };
        let document = report.document();
        begun.deliver(&document)?;
        undecided(&name, &document)
    }

    fn of_run(&self, file: &Path) -> anyhow::Result<(String, String, Vec<String>, Evaluation)> {
        let Opened { run, .. } = OfLog::default().open(file)?;
        let aiding = self.setting.aiding.unwrap_or_else(|| run.aiding());
        self.setting.check_terms(Some(aiding));
        let mut options = self.setting.named(&self.path).options(aiding);
        options.auto_terms = With::is_auto(&self.setting.with);
        let evaluation = Evaluation::of_run(&run, &options).with_context(|| self.path.clone())?;
        let with = format!("Recording of {}, with the noise stated there", self.path);
        Ok((run.recording.name.clone(), with, Vec::new(), evaluation))
    }

    fn of_path(&self) -> anyhow::Result<(String, String, Vec<String>, Evaluation)> {
        let mut study = PathStudy::load(&self.setting.named(&self.path))?;
        study.options.auto_terms = With::is_auto(&self.setting.with);
        self.setting.check_terms(study.options.aiding);
        let name = study.scenario.path_name.clone();
        let moves = moves_in_words(&study.scenario);
        let evaluation = study.evaluate().with_context(|| format!("path {name}"))?;
        Ok((name, in_words(&study), moves, evaluation))
    }
}

/// The exit status of a specification that cannot be decided.
fn undecided(name: &str, document: &Document) -> anyhow::Result<()> {
    match &document.verdict {
        Some((Word::Undecided, text)) => {
            Err(NotMet::Specification(format!("{name}: {text}")).into())
        }
        _ => Ok(()),
    }
}

/// Whether a file describes a run.
fn is_run(file: &Path) -> bool {
    file.is_file() && small_file::read_text(file).is_ok_and(|text| text.contains("turncal-run/"))
}
