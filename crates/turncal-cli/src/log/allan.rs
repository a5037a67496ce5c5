//! `turncal allan`

use std::path::PathBuf;

use anyhow::Context;

use crate::arguments::{Delivery, OfLog, run_or_log};
use crate::terminal::Activity;
use turncal::noise::{NoiseAnalysis, Stretch};
use turncal_report::allan;

/// Computes the Allan deviation of a stationary recording and its noise figures
///
/// Shows the overlapping Allan deviation of every axis with its confidence interval; the coefficients of random walk,
/// bias instability, rate random walk, quantisation and ramp (with σ if detected, otherwise as an upper limit); and an
/// [imu.noise] table for run.toml. Uses the whole recording if it is stationary, otherwise its longest static interval.
#[derive(Debug, clap::Args)]
#[command(mut_arg("output", |output| output.help("Directory for the report and figures")))]
#[command(after_help = "Examples:
  turncal allan imu.csv
  turncal allan run.toml
  turncal allan run.toml --segment z_up -o noise
  turncal allan run.toml --json")]
pub struct Allan {
    /// A run.toml, a log, or - for text on standard input
    #[arg(value_name = "RUN.toml|LOG", value_parser = run_or_log)]
    run: PathBuf,
    #[command(flatten)]
    of_log: OfLog,
    /// Use the segment with this label (the longest one if several segments have this label)
    #[arg(long, value_name = "LABEL")]
    segment: Option<String>,
    #[command(flatten)]
    delivery: Delivery,
}

impl Allan {
    pub fn run(&self) -> anyhow::Result<()> {
        let activity = Activity::new("reading");
        let run = self.of_log.open(&self.run)?.run;
        drop(activity);
        let stretch = Stretch::find(&run, self.segment.as_deref())
            .with_context(|| self.run.display().to_string())?;
        let begun = self.delivery.begin(&[&self.run])?;
        let activity = Activity::new("identifying noise");
        let analysis = NoiseAnalysis::new(&run, stretch);
        drop(activity);
        begun.deliver(&allan::document(&run.recording.name, &analysis))
    }
}
