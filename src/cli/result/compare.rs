//! `turncal compare`: calibrations side by side.

use std::path::{Path, PathBuf};

use clap::error::ErrorKind;

use crate::calibration::{Named, compare};
use crate::cli::arguments::{Delivery, at_temperature};
use crate::cli::terminal::short_names;
use crate::report::comparison;

/// Compares calibrations, parameter by parameter, with their σ
///
/// All calibrations are first converted to the general installation form and one body frame. Without a truth, the first
/// is the reference. For three or more, the mean, scatter and χ² of the scatter relative to the stated σ are also
/// shown.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  turncal compare monday.json friday.json --truth truth.json")]
pub struct Compare {
    /// Two or more calibrations (one is enough with --truth)
    #[arg(required = true, value_name = "CALIBRATION.json")]
    calibrations: Vec<PathBuf>,
    /// True values, if known
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Temperature of the comparison, °C [default: reference temperature of each calibration]
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    temperature_degc: Option<f64>,
    #[command(flatten)]
    delivery: Delivery,
}

impl Compare {
    pub fn run(&self) -> anyhow::Result<()> {
        if self.calibrations.len() == 1 && self.truth.is_none() {
            let message = "one calibration can be compared only with a truth; give --truth or a second calibration\n";
            clap::Error::raw(ErrorKind::TooFewValues, message).exit();
        }
        let paths: Vec<&Path> = self
            .truth
            .iter()
            .chain(&self.calibrations)
            .map(PathBuf::as_path)
            .collect();
        let records = paths
            .iter()
            .map(|path| at_temperature(path, self.temperature_degc))
            .collect::<anyhow::Result<Vec<_>>>()?;
        let names = short_names(&paths);
        let named: Vec<Named> = names
            .iter()
            .zip(&records)
            .map(|(name, record)| Named { name, record })
            .collect();
        let (truth, calibrations) = named.split_at(usize::from(self.truth.is_some()));
        let comparison = compare(calibrations, truth.first().copied())?;
        let begun = self.delivery.begin(&paths)?;
        begun.deliver(&comparison::document(&comparison))
    }
}
