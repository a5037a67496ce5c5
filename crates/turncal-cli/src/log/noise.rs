//! `turncal noise`

use crate::arguments::positive;
use crate::terminal::show;
use turncal::noise::conventions::{convert, known};
use turncal_report::conversion;

/// Converts a noise figure to all conventions: data sheets, Kalibr, PSINS, KF-GINS
///
/// Each output line gives a convention and the data sheets or programs that use it. Densities are two-sided, as in IEEE
/// Std 952; a one-sided density is √2 times as large. With --rate, a unit of rate or acceleration (deg/s, m/s^2) means
/// noise per sample; without --rate, it means bias instability.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:
  turncal noise 0.3 'deg/sqrt(h)'
  turncal noise 0.005 'deg/s/sqrt(Hz)' --rate 100
  turncal noise 1.7e-4 gyroscope_noise_density

Units (also in the form deg/sqrt(h), ug/sqrt(Hz), m/s^2):\n{}", known()))]
pub struct Noise {
    /// Noise figure to convert
    #[arg(value_name = "VALUE", allow_negative_numbers = true, value_parser = positive)]
    value: f64,
    /// Unit of the figure, or its name in a program
    #[arg(value_name = "UNIT")]
    unit: String,
    /// Sample rate in Hz, to convert noise per sample
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = positive)]
    rate: Option<f64>,
    /// Print the results as a single JSON document, without any other output
    #[arg(long)]
    json: bool,
}

impl Noise {
    pub fn run(&self) -> anyhow::Result<()> {
        let conversion = convert(self.value, &self.unit, self.rate)?;
        show(&conversion::document(&conversion), self.json)
    }
}
