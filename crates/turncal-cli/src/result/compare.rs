//! `turncal compare`: comparison of calibrations.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::error::ErrorKind;

use crate::arguments::{Delivery, of_triads, usable};
use crate::terminal::short_names;
use turncal::lot::{Lot, Unit};
use turncal_report as report;

/// Compares calibrations, parameter by parameter, with their σ
///
/// turncal first converts all calibrations to the general misalignment form and one body frame. Differences are
/// relative to the truth or, for two calibrations without a truth, to the first one. With three or more calibrations,
/// turncal also shows the mean, the scatter, and the χ² of the scatter relative to the stated σ, and marks outliers.
/// Without --force, turncal refuses a calibration whose verdict is FAILED.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  turncal compare monday.json friday.json --truth truth.json")]
pub struct Compare {
    /// Two or more calibrations (one is enough with --truth)
    #[arg(required = true, value_name = "CALIBRATION.json")]
    calibrations: Vec<PathBuf>,
    /// True parameters, if known
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Temperature at which to compare the calibrations, °C [default: reference temperature of each calibration]
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    temperature_degc: Option<f64>,
    #[command(flatten)]
    delivery: Delivery,
}

impl Compare {
    pub fn run(&self) -> anyhow::Result<()> {
        if self.calibrations.len() == 1 && self.truth.is_none() {
            let message = "a single calibration can be compared only with a truth; give --truth or a second \
            calibration\n";
            clap::Error::raw(ErrorKind::TooFewValues, message).exit();
        }
        let paths = self.truth.iter().chain(&self.calibrations);
        let paths: Vec<&Path> = paths.map(PathBuf::as_path).collect();
        let named = short_names(&paths).into_iter().zip(&paths);
        let units = named.map(|(name, path)| {
            let force = self.delivery.force();
            let read = usable(path, self.temperature_degc, force)?;
            let mut calibration = of_triads(read, path)?;
            // A comparison leaves out units that did not converge, but this unit was requested explicitly.
            calibration.converged = calibration
                .converged
                .filter(|converged| *converged || !force);
            anyhow::Ok(Unit::of_record(name, calibration, None))
        });
        let mut units = units.collect::<anyhow::Result<Vec<Unit>>>()?;
        let calibrations = units.split_off(usize::from(self.truth.is_some()));
        let lot = Lot::new(calibrations, units.pop(), None);
        if let Some((unit, reason)) = lot.failures().next() {
            bail!("{}: {reason}", unit.name);
        }
        let begun = self.delivery.begin(&paths)?;
        begun.deliver(&report::lot::document(&lot))
    }
}
