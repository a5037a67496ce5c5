//! `turncal show`

use std::path::PathBuf;

use crate::terminal::{show, show_brief};
use turncal_report::record;

/// Shows a calibration: verdict, findings and values with their σ
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal show result/calibration.json
  turncal show result/calibration.json --verbose")]
pub struct Show {
    /// The calibration
    #[arg(value_name = "CALIBRATION.json")]
    calibration: PathBuf,
    /// Print all parameters, sources of uncertainty, noise, error terms and findings
    #[arg(short, long)]
    verbose: bool,
}

impl Show {
    pub fn run(&self) -> anyhow::Result<()> {
        let calibration = turncal_files::read_calibration(&self.calibration)?;
        let name = self.calibration.display().to_string();
        let document = record::document(&calibration, &name);
        if self.verbose {
            show(&document, false)
        } else {
            show_brief(&document)
        }
    }
}
