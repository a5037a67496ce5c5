//! `turncal simulate`

use std::path::{Path, PathBuf};
use turncal_files::write_calibration;

use anyhow::Context;

use crate::arguments::{Overwrite, seed};
use crate::terminal::Activity;
use turncal::simulation::{Scenario, Simulated, SimulatedCampaign};
use turncal_files::{campaign_text, write_run};

/// Simulates a run with known truth from a scenario, and writes its directory
///
/// Writes run.toml, its logs and truth.json. The scenario is a TOML file or an embedded name from turncal list.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:  turncal simulate nineteen-position -o my-run --seed 7
          turncal simulate five-soaks -o my-campaign"
)]
pub struct Simulate {
    /// Scenario or campaign: a TOML file or an embedded name
    scenario: String,
    /// Directory in which to write the output
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Random seed [default: from the scenario]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = seed)]
    seed: Option<u64>,
    #[command(flatten)]
    overwrite: Overwrite,
}

impl Simulate {
    pub fn run(&self) -> anyhow::Result<()> {
        if SimulatedCampaign::is_named(&self.scenario) {
            return self.campaign();
        }
        let scenario = Scenario::load(&self.scenario)?;
        let directory = self
            .overwrite
            .directory(&self.output, &[Path::new(&self.scenario)])?;
        let activity = Activity::new(format!("simulating {}", scenario.name));
        let simulated = simulated(&scenario, self.seed)?;
        activity.next("writing");
        write(&simulated, &directory.path())?;
        directory.commit()?;
        drop(activity);
        if simulated.geometry.rows_range(3..).amax() > 0.0 {
            tell!(
                "note: the axes of the simulated table have errors (non-orthogonality, wobble, encoders) that the \
                 quaternions in the table log cannot show, so the misalignment σ of a calibration with these files \
                 will be too small. turncal study accuracy estimates these errors."
            );
        }
        tell!(
            "{}: {:.0} s written to {}",
            scenario.name,
            simulated.run.recording.imu.duration(),
            self.output.display()
        );
        Ok(())
    }
}

impl Simulate {
    fn campaign(&self) -> anyhow::Result<()> {
        let campaign = SimulatedCampaign::load(&self.scenario)?;
        let directory = self
            .overwrite
            .directory(&self.output, &[Path::new(&self.scenario)])?;
        let activity = Activity::new(format!("simulating {}", campaign.name));
        let seed = self.seed.unwrap_or(campaign.scenario.seed);
        let simulated = campaign.simulate(seed, 0);
        let simulated =
            simulated.with_context(|| format!("campaign {} cannot be simulated", campaign.name))?;
        activity.next("writing");
        let mut paths = Vec::new();
        for recording in &simulated {
            let name = &recording.run.recording.name;
            let of_recording = directory.path().join(name);
            std::fs::create_dir(&of_recording)
                .with_context(|| format!("cannot create {}", of_recording.display()))?;
            write(recording, &of_recording)?;
            paths.push(format!("{name}/run.toml"));
        }
        if let Some(truth) = SimulatedCampaign::truth(&simulated) {
            write_calibration(&truth, &directory.path().join("truth.json"), false)?;
        }
        let text = campaign_text(&paths, &campaign.day_to_day);
        let path = directory.path().join("campaign.toml");
        std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        directory.commit()?;
        drop(activity);
        tell!(
            "{}: {} written to {}",
            campaign.name,
            turncal_input::counted(simulated.len(), "recording"),
            self.output.display()
        );
        Ok(())
    }
}

/// Simulates a run with this seed or the seed of the scenario.
pub fn simulated(scenario: &Scenario, seed: Option<u64>) -> anyhow::Result<Simulated> {
    scenario
        .simulate(seed.unwrap_or(scenario.seed), 0)
        .with_context(|| format!("scenario {} cannot be simulated", scenario.name))
}

/// Writes a simulated run with its truth into an existing directory.
pub fn write(simulated: &Simulated, directory: &Path) -> anyhow::Result<()> {
    let truth = simulated.truth_record();
    write_run(directory, &simulated.run, simulated.output, Some(&truth))?;
    Ok(())
}
