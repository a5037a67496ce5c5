//! `turncal study experiment`

use std::path::Path;

use super::carry_out::carry_out;
use crate::arguments::{Delivery, Sharding, at_least_two, hours, seed};
use turncal::models;
use turncal::models::Place;
use turncal::simulation::Scenario;
use turncal::study::ExperimentStudy;
use turncal::study::navigation::INTERVAL;
use turncal_files::JobKind;
use turncal_report as report;

const HOUR: f64 = 3600.0;
const SCENARIO: &str = "experiment";

/// Simulates the turntable experiment of the paper, and shows the navigation accuracy after each calibration
///
/// Simulates many instruments with noise and Gauss–Markov biases, on a table with position errors. Calibrates each
/// instrument in all misalignment forms: with the closed form, which uses the static positions of the paper; with the
/// filter, which uses one sixth of that table time; and with the filter in the full table time. Then navigates with the
/// remaining errors, both at rest (with self-alignment or perfect alignment) and in motion. Shows the position error
/// for every method, and the parameters that cause the error.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal study experiment
  turncal study experiment --samples 200 --seed 3 -o experiment
  turncal study experiment --trajectory vehicle --hours 2 --json")]
pub struct Experiment {
    /// Number of instruments
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = at_least_two)]
    samples: u64,
    /// Random seed [default: from the scenario]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = seed)]
    seed: Option<u64>,
    /// Trajectory for navigation in motion: a TOML file or an embedded name
    #[arg(long, value_name = "TRAJECTORY", default_value = "flight")]
    trajectory: String,
    /// Navigation time in hours (whole minutes, up to 1000)
    #[arg(long, default_value_t = 40.0, value_parser = hours)]
    hours: f64,
    #[command(flatten)]
    sharding: Sharding,
    #[command(flatten)]
    delivery: Delivery,
}

impl Experiment {
    pub fn run(&self) -> anyhow::Result<()> {
        let scenario = Scenario::load(SCENARIO)?;
        let (trajectory, trajectory_name) =
            models::trajectory(&self.trajectory, &Place::CommandLine)?;
        let study = ExperimentStudy {
            seed: self.seed.unwrap_or(scenario.seed),
            scenario,
            trajectory,
            trajectory_name,
            intervals: (self.hours * HOUR / INTERVAL).round() as u32,
            samples: self.samples,
        };
        let inputs = [Path::new(&self.trajectory)];
        let part = self.sharding;
        if part.make(JobKind::StudyExperiment, &study, &self.delivery, &inputs)? {
            return Ok(());
        }
        carry_out(
            &study,
            &self.delivery,
            &inputs,
            report::experiment::document,
        )
    }
}
