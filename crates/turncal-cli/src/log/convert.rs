//! `turncal convert`

use std::path::PathBuf;

use crate::arguments::{OfLog, Overwrite};
use crate::terminal::Activity;
use turncal_files::draft::Draft;

/// Converts the log of another program to a plain run directory
///
/// Writes the streams of the instrument as CSV files with every column and all digits, and a draft of run.toml like
/// that of `turncal init`. Reads MCAP, ROS bags, PX4 ULog, ArduPilot DataFlash, MATLAB and NumPy files; calibrate and
/// check can also read these files directly.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal convert flight.ulg -o my-run
  turncal convert drive.mcap --stream /imu/data -o my-run")]
pub struct Convert {
    /// Log file; turncal detects its format from its content
    log: PathBuf,
    /// Directory in which to write the output
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    of_log: OfLog,
    /// Use the intact part of a damaged log, up to the first damage
    #[arg(long)]
    salvage: bool,
    #[command(flatten)]
    overwrite: Overwrite,
}

impl Convert {
    pub fn run(&self) -> anyhow::Result<()> {
        let directory = self.overwrite.directory(&self.output, &[&self.log])?;
        let activity = Activity::new("reading");
        let (stream, stated) = self.of_log.stated()?;
        let draft = Draft::of_stream(&self.log.as_path().into(), stream, &stated)?;
        activity.next("writing");
        draft.convert(&self.log, &directory.path(), self.salvage)?;
        directory.commit()?;
        drop(activity);
        let run = self.output.join("run.toml");
        tell!("{}: complete the fields marked TODO", run.display());
        Ok(())
    }
}
