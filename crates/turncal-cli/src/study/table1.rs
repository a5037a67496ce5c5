//! `turncal study table1`

use crate::arguments::{Delivery, at_least_two, hours, latitude, seed};
use crate::terminal::Activity;
use turncal::study::Table1Study;
use turncal::study::table1::paper;
use turncal::units::DEGREE;
use turncal_report as report;

/// Reproduces Table 1 of the paper: navigation errors caused by a simplified misalignment form
///
/// Draws random misalignment angles as in the paper, calibrates gyros and accelerometers without noise (closed form,
/// six-angle and three-angle form), and navigates with the remaining errors. Shows the largest errors next to the
/// published figures, for each interpretation of the text of the paper, and states which figures a correct program
/// reproduces.
#[derive(Debug, clap::Args)]
#[command(mut_arg("output", |output| output.help("Directory for a report with Figures 2 to 9 of the paper")))]
#[command(after_help = "Examples:
  turncal study table1 -o table1
  turncal study table1 --samples 4000 --json
  turncal study table1 --hours 48 --latitude-deg 41.6")]
pub struct Table1 {
    /// Number of random samples
    #[arg(long, value_name = "N", default_value_t = paper::SAMPLES as u64, value_parser = at_least_two)]
    samples: u64,
    /// Random seed
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = seed)]
    seed: u64,
    /// Duration of each navigation run in hours (one minute to 1000 h)
    #[arg(long, default_value_t = paper::HOURS, value_parser = hours)]
    hours: f64,
    /// Geodetic latitude in degrees; the paper does not state it, but the published figures imply 45.78
    #[arg(long, default_value_t = paper::LATITUDE_DEG, value_name = "L", allow_negative_numbers = true, value_parser = latitude)]
    latitude_deg: f64,
    #[command(flatten)]
    delivery: Delivery,
}

impl Table1 {
    pub fn run(&self) -> anyhow::Result<()> {
        let study = Table1Study {
            samples: usize::try_from(self.samples)?,
            seed: self.seed,
            hours: self.hours,
            latitude: self.latitude_deg * DEGREE,
        };
        let begun = self.delivery.begin(&[])?;
        let activity = Activity::new("calibrating and navigating");
        let table = study.run()?;
        drop(activity);
        begun.deliver(&report::table1::document(&table))
    }
}
