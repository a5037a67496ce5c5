//! `turncal allan`

use std::path::PathBuf;

use anyhow::Context;
use turncal::noise::{NoiseAnalysis, Stretch};
use turncal::report::allan;
use turncal::run::Run;

use super::output::Delivery;
use super::progress::Activity;

/// Allan deviation of a standing record, and the noise figures that it shows
///
/// Overlapping Allan deviation of every axis with its confidence; random walk, bias instability, rate random
/// walk, quantisation and ramps as far as their slopes are there, with their σ, and what the others are
/// below; a table [imu.noise] for run.toml. Takes the whole record if it stands, else its longest
/// standstill.
#[derive(Debug, clap::Args)]
#[command(mut_arg("output", |output| output.help("Directory for a page and figures")))]
#[command(after_help = "Examples:
  turncal allan run.toml
  turncal allan run.toml --segment z_up -o noise
  turncal allan run.toml --json")]
pub struct Allan {
    /// The run; its [imu.noise] need only be near
    #[arg(value_name = "RUN.toml")]
    run: PathBuf,
    /// Take the segment of this label; the longest, if there are several
    #[arg(long, value_name = "LABEL")]
    segment: Option<String>,
    #[command(flatten)]
    delivery: Delivery,
}

impl Allan {
    pub fn run(&self) -> anyhow::Result<()> {
        let activity = Activity::new("reading");
        let run = Run::read(&self.run)?;
        drop(activity);
        let stretch = Stretch::find(&run, self.segment.as_deref())
            .with_context(|| self.run.display().to_string())?;
        let begun = self.delivery.begin(&[&self.run])?;
        let activity = Activity::new("identifying noise");
        let analysis = NoiseAnalysis::new(&run, stretch);
        drop(activity);
        begun.deliver(&allan::document(&run.name, &analysis))
    }
}
