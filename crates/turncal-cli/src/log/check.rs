//! `turncal check`

use std::path::PathBuf;

use crate::arguments::{Delivery, OfLog, run_or_log};
use crate::calibrate::of_magnetometer;
use crate::terminal::Activity;
use turncal::survey::Survey;
use turncal_report::{check, record};

/// Describes a run and the parameters that each method could determine
///
/// Without calibrating, shows the rate, jitter, faults and resolution of the log; the dwells with their upward axis;
/// the turns with their axis and angle; how labelled sections agree with dwells and turns; the σ predicted for each
/// method and the parameters that the method could not determine; and recommended changes. Problems in the run do not
/// change the exit status.
#[derive(Debug, clap::Args)]
#[command(mut_arg("output", |output| output.help("Directory for the report and a figure of the recording")))]
#[command(after_help = "Examples:
  turncal check imu.csv
  turncal check run.toml
  turncal check run.toml -o check
  turncal check run.toml --json")]
pub struct Check {
    /// A run.toml, a log, or - for text on standard input
    #[arg(value_name = "RUN.toml|LOG", value_parser = run_or_log)]
    run: PathBuf,
    #[command(flatten)]
    of_log: OfLog,
    #[command(flatten)]
    delivery: Delivery,
}

impl Check {
    pub fn run(&self) -> anyhow::Result<()> {
        let activity = Activity::new("reading");
        let run = self.of_log.open_any(&self.run)?.run;
        let begun = self.delivery.begin(&[&self.run])?;
        activity.next("checking the run");
        let document = if run.is_of_magnetometer() {
            record::document(&of_magnetometer(&run)?, &run.recording.name)
        } else {
            check::document(&run, &Survey::of(&run))
        };
        drop(activity);
        begun.deliver(&document)?;
        if !self.delivery.json() {
            tell!("\nnext: turncal calibrate {}", said_of_the_log().join(" "));
        }
        Ok(())
    }
}

/// The words of this command line that `calibrate` takes as well.
fn said_of_the_log() -> Vec<String> {
    let words = std::env::args().skip_while(|word| word != "check").skip(1);
    let mut is_of_output = false;
    let kept = words.filter(|word| {
        let follows = std::mem::replace(&mut is_of_output, word == "-o" || word == "--output");
        let is_output = word.starts_with("-o") || word.starts_with("--output") || word == "--force";
        !follows && !is_output
    });
    let quoted = |word: String| {
        if word.contains([' ', '\'', '"', '$', '*']) {
            format!("'{}'", word.replace('\'', "'\\''"))
        } else {
            word
        }
    };
    kept.map(quoted).collect()
}
