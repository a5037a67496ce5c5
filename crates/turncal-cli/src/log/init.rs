//! `turncal init`

use std::path::{Path, PathBuf};

use crate::arguments::{OfLog, keep, show_found};
use crate::terminal::{Activity, print};
use turncal_files::draft::Draft;
use turncal_files::write_whole;
use turncal_logs::DataFile;

/// Drafts a run.toml from a log
///
/// Identifies the columns (by name or value), the time unit, the sensor units (from gravity at rest and from the change
/// of gravity direction during turns) and the white noise at rest, and gives a reason for each guess. Fields that
/// cannot be determined from the log are marked TODO.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal init imu.csv
  turncal init imu.csv.gz -o run.toml
  turncal init flight.ulg
  turncal init Gyroscope.csv Accelerometer.csv")]
pub struct Init {
    /// Log: a text file of numbers with or without a line of column names (`.csv`, `.txt`, `.tsv`, `.dat` or `.log`,
    /// also compressed as `.gz`); or an MCAP, ROS bag, PX4 ULog, ArduPilot DataFlash, MAT, NPY or NPZ file, whose
    /// streams init lists
    #[arg(value_name = "IMU.csv")]
    log: PathBuf,
    /// Log of the accelerometers (the same as --accel-file)
    #[arg(value_name = "ACCEL.csv", conflicts_with_all = ["stream", "accel_file"])]
    accel: Option<PathBuf>,
    #[command(flatten)]
    of_log: OfLog,
    /// File to write [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
}

impl Init {
    pub fn run(&self) -> anyhow::Result<()> {
        let activity = Activity::new("reading");
        let (stream, stated) = self.of_log.stated()?;
        let log = DataFile::from(self.log.as_path());
        let accel = self.accel.as_deref().or(stated.accel_file.as_deref());
        let draft = match accel {
            Some(accel) => Draft::of_two_files(&log, &accel.into(), &self.name(accel), &stated)?,
            None => Draft::of_stream(&log, stream, &stated)?,
        };
        drop(activity);
        let text = draft.to_toml(&self.name(&self.log));
        let Some(output) = &self.output else {
            return print(text.as_bytes());
        };
        keep(output, [&*self.log].into_iter().chain(accel))?;
        write_whole(output, text.as_bytes(), self.force)?;
        show_found(&self.log, &draft.found());
        tell!("written: {}", output.display());
        let lines = text.lines().zip(1..);
        let open: Vec<_> = lines.filter(|(line, _)| line.contains("TODO:")).collect();
        for (line, number) in &open {
            tell!("to do:   line {number} {}", line.trim_start_matches("# "));
        }
        let first = if open.is_empty() {
            ""
        } else {
            "complete these lines, then "
        };
        tell!("next:    {first}turncal check {}", output.display());
        Ok(())
    }

    /// Name of a log as written in the new file. By default the new file is next to the log.
    fn name(&self, log: &Path) -> String {
        let directory = |path: &Path| {
            let parent = path.parent().filter(|parent| *parent != Path::new(""));
            parent.unwrap_or(Path::new(".")).canonicalize().ok()
        };
        let place = self.output.as_deref().unwrap_or(&self.log);
        let name = match (log.file_name(), log.canonicalize()) {
            (Some(name), _) if directory(place) == directory(log) => PathBuf::from(name),
            (_, Ok(full)) => full,
            _ => log.to_owned(),
        };
        name.to_string_lossy().into_owned()
    }
}
