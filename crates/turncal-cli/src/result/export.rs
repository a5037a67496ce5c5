//! `turncal export`

use crate::arguments::export_format;
use std::path::PathBuf;

use anyhow::Context;

use crate::arguments::{keep, run_file, usable};
use crate::terminal::print;
use turncal_files::export;
use turncal_files::write_whole;

/// Exports a calibration for other programs (Kalibr, PX4, ROS, C, …)
///
/// For formats whose inputs are in rad/s and m/s², the file states the number by which to divide the raw output. This
/// number is the nominal scale of the unit; for counts, it is the nominal scale of --run or, without --run, the
/// calibrated scale factor rounded to three digits. The verdict of the calibration, and the parts of it that the format
/// cannot represent, are stated in the file and on standard error (for realsense, which has no place for text, only on
/// standard error).
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal export result/calibration.json --format c -o imu.h
  turncal export result/calibration.json --format kalibr \\
      --run my-run/run.toml -o imu.yaml
  turncal export result/calibration.json --format text")]
pub struct Export {
    /// The calibration
    #[arg(value_name = "CALIBRATION.json")]
    calibration: PathBuf,
    /// Format to write
    #[arg(long, value_parser = export_format())]
    format: export::Format,
    /// Run of the same instrument that supplies noise figures, sample rate and nominal scales
    #[arg(long, value_name = "RUN.toml", value_parser = run_file)]
    run: Option<PathBuf>,
    /// Temperature for which to export the calibration, °C [default: reference temperature; c, px4 and ardupilot
    /// contain the temperature dependence]
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    temperature_degc: Option<f64>,
    /// File to write [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace an existing output file, and export a calibration even if its verdict is FAILED
    #[arg(long)]
    force: bool,
}

impl Export {
    pub fn run(&self) -> anyhow::Result<()> {
        let record = usable(&self.calibration, self.temperature_degc, self.force)?;
        let run = self
            .run
            .as_deref()
            .map(turncal_files::read_run)
            .transpose()?;
        let exported = export::write(&record, &self.format, run.as_ref())
            .with_context(|| self.calibration.display().to_string())?;
        let text = &exported.bytes;
        match &self.output {
            Some(output) => {
                let files = run.iter().flat_map(|run| &run.recording.files);
                keep(output, files.chain([&self.calibration]))?;
                write_whole(output, text, self.force)?;
            }
            None => print(text)?,
        }
        if let Some(word) = record.word() {
            tell!("verdict of the calibration: {word}");
        }
        for note in exported.notes {
            tell!("not included: {note}");
        }
        Ok(())
    }
}
