//! `turncal study accuracy`

use crate::arguments::{AIDINGS, FORMS, NOISE, one_of};
use std::path::Path;

use super::carry_out::carry_out;
use crate::arguments::{
    Delivery, Sharding, With, at_least_two, error_term, needs_table, seed, with_value,
};
use turncal::calibration::{ErrorTerm, NoisePolicy};
use turncal::imu::InstallationForm;
use turncal::models::{InstallationModel, Place};
use turncal::run::Aiding;
use turncal::simulation::Scenario;
use turncal::study::AccuracyStudy;
use turncal_files::JobKind;
use turncal_report as report;

/// Tests the accuracy of the filter and the consistency of its σ
///
/// Simulates many runs, each with a different instrument, noise and table errors, and calibrates each run with the
/// filter and, using the static positions of the paper, with the closed form. Shows the RMS error of each parameter
/// group, and of the position after 40 h of navigation, compared with the Cramér–Rao bound and with the closed form.
/// Also shows whether the σ of the filter are consistent with its errors (NEES, NIS, fraction of position errors within
/// the predicted σ). The results include runs in which the filter fails.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal study accuracy --runs 500
  turncal study accuracy nineteen-position --runs 200 -o nineteen
  turncal study accuracy --installation three-angle \\
      --truth-installation three-angle
  turncal study accuracy real-table --unmodelled table-base,table-axes
  turncal study accuracy --with accel-second-order,size-effect")]
pub struct Accuracy {
    /// Scenario: a TOML file or an embedded name
    #[arg(default_value = "demo")]
    scenario: String,
    /// Path to use instead of the scenario's path: a TOML file or an embedded name
    #[arg(long, value_name = "PATH")]
    path: Option<String>,
    /// Observations used by the filter
    #[arg(long, value_parser = one_of(&AIDINGS), default_value = "table")]
    aiding: Aiding,
    /// Misalignment form of the filter
    #[arg(long, value_parser = one_of(&FORMS), default_value = "general")]
    installation: InstallationForm,
    /// Installation of the simulated instruments: a TOML file or an embedded name [default: from the scenario]
    #[arg(long, value_name = "MODEL")]
    truth_installation: Option<String>,
    /// Error terms to simulate and to estimate, in addition to those of the scenario [default: auto]
    #[arg(long, value_name = "TERM", value_parser = with_value(), value_delimiter = ',')]
    with: Vec<With>,
    /// Error terms to simulate but not to estimate
    #[arg(long, value_name = "TERM", value_parser = error_term(), value_delimiter = ',')]
    unmodelled: Vec<ErrorTerm>,
    /// Noise used by the filter; the noise that a scenario states is the true noise
    #[arg(long, value_parser = one_of(&NOISE), default_value = "stated")]
    noise: NoisePolicy,
    /// Number of runs
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = at_least_two)]
    runs: u64,
    /// Random seed [default: from the scenario]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = seed)]
    seed: Option<u64>,
    #[command(flatten)]
    sharding: Sharding,
    #[command(flatten)]
    delivery: Delivery,
}

impl Accuracy {
    pub fn run(&self) -> anyhow::Result<()> {
        With::check(&self.with);
        let mut scenario = Scenario::load(&self.scenario)?;
        scenario.body_frame = self.aiding.body_frame();
        if let Some(path) = &self.path {
            scenario = scenario.with_path(path)?;
        }
        if let Some(model) = &self.truth_installation {
            scenario.installation = InstallationModel::load(model, &Place::CommandLine)?;
        }
        for term in With::terms(&self.with).chain(self.unmodelled.iter().copied()) {
            needs_table(term, Some(self.aiding));
            scenario = scenario.with_error_term(term);
        }
        let study = AccuracyStudy {
            unmodelled: self.unmodelled.clone(),
            auto_terms: !self.with.contains(&With::None),
            form: self.installation,
            noise: self.noise,
            runs: self.runs,
            seed: self.seed.unwrap_or(scenario.seed),
            scenario,
        };
        let inputs = [Path::new(&self.scenario)];
        let part = self.sharding;
        if part.make(JobKind::StudyAccuracy, &study, &self.delivery, &inputs)? {
            return Ok(());
        }
        carry_out(&study, &self.delivery, &inputs, report::accuracy::document)
    }
}
