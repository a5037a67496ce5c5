//! A simulated campaign: one instrument recorded several times.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::scenario::ChamberFile;
use super::{Chamber, Draws, Scenario, Simulated};
use crate::calibration::result::Calibration;
use crate::calibration::{DayToDay, Difference, ParameterVector, TemperatureOptions, Together};
use crate::models::{self, ModelError, Place, Room};
use crate::turntable::TableError;
use turncal_input::NonNegative;

/// Simulated recordings of one instrument.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SimulatedCampaign {
    /// A short name for titles and file names.
    pub name: String,
    /// The scenario common to all recordings.
    pub scenario: Scenario,
    /// Name of each recording, and its climatic chamber, if any.
    pub recordings: Vec<(String, Option<Chamber>)>,
    /// σ of the differences between recordings.
    pub day_to_day: DayToDay,
}

/// Random streams per campaign; more than its maximum number of recordings.
const STREAMS: u64 = 1 << 10;

impl SimulatedCampaign {
    /// Whether the name refers to a campaign: a file that lists recordings or, if there is no such file, an embedded
    /// campaign.
    pub fn is_named(name_or_path: &str) -> bool {
        match models::text(Room::Campaign, name_or_path, &Place::CommandLine) {
            Ok(text) if text.place == Place::Embedded => true,
            Ok(text) => text.text.lines().any(|line| line.trim() == "[[recording]]"),
            Err(_) => false,
        }
    }

    /// Finds and reads a campaign, by embedded name or path, with the models that it refers to.
    ///
    /// # Errors
    /// Returns an error if one of these files does not exist or is malformed.
    pub fn load(name_or_path: &str) -> Result<Self, ModelError> {
        let text = models::text(Room::Campaign, name_or_path, &Place::CommandLine)?;
        let file: CampaignFile = text.parse()?;
        let name = match &text.place {
            // An embedded campaign refers to an embedded scenario; a campaign file refers to a scenario by its path.
            Place::File(path) => path.with_file_name(&file.scenario).display().to_string(),
            _ => file.scenario.clone(),
        };
        let beside = std::path::Path::new(&name).is_file();
        let mut scenario = Scenario::load(if beside { &name } else { &file.scenario })?;
        scenario.seed = file.seed.unwrap_or(scenario.seed);
        if file.recording.is_empty() || file.recording.len() as u64 > STREAMS {
            return Err(text.inconsistent(format!("expected 1 to {STREAMS} [[recording]]")));
        }
        let recordings = file.recording.into_iter().map(|recording| {
            let chamber = recording.chamber.map(ChamberFile::in_si).transpose();
            let chamber = chamber.map_err(|message| text.inconsistent(message))?;
            let inherited = |mut own: Chamber| {
                if let Some(common) = &scenario.chamber {
                    own.sensor_noise = own.sensor_noise.max(common.sensor_noise);
                }
                own
            };
            Ok((recording.name, chamber.map(inherited)))
        });
        let recordings = recordings.collect::<Result<_, ModelError>>()?;
        let stated = &file.day_to_day;
        (text.document()).only("day_to_day", stated.keys(), &DayToDay::keys())?;
        let value = |key: &str| stated.get(key).map_or(0.0, |sigma| sigma.0);
        Ok(Self {
            name: text.name(),
            recordings,
            day_to_day: DayToDay::of_values(value),
            scenario,
        })
    }

    /// Simulates all recordings of one instrument. The same seed and stream give the same bits; a Monte Carlo study
    /// keeps the seed and increments the stream.
    ///
    /// # Errors
    /// Returns an error if the table cannot follow the path.
    pub fn simulate(&self, seed: u64, stream: u64) -> Result<Vec<Simulated>, TableError> {
        let all = (0..).zip(&self.recordings);
        all.map(|(number, (name, chamber))| {
            let mut scenario = self.scenario.clone();
            scenario.name.clone_from(name);
            scenario.chamber = chamber.clone().or(scenario.chamber);
            let of = stream.wrapping_mul(STREAMS) + number;
            let mut rng = Draws::thermal(seed, of ^ (1 << 63));
            let mut unit = || -> f64 { StandardNormal.sample(&mut rng) };
            let DayToDay {
                parameters,
                mounting,
            } = self.day_to_day;
            let own = Difference {
                parameters: ParameterVector::from_fn(|i, _| unit() * parameters[i]),
                mounting: Vector3::from_fn(|_, _| unit() * mounting),
            };
            scenario.simulate_recording(seed, stream, of, &own)
        })
        .collect()
    }

    /// The common truth of simulated recordings, in the file's quantity, with its temperature dependence over their
    /// temperature range.
    pub fn truth(simulated: &[Simulated]) -> Option<Calibration> {
        let first = simulated.first()?;
        Some(first.truth_over(simulated, &first.common))
    }

    /// Common and individual properties of the recordings, as a user would state them.
    pub fn together(&self) -> Together {
        let chambers = self.recordings.iter().map(|(_, own)| own);
        let warms = self.scenario.chamber.is_some() || chambers.flatten().next().is_some();
        Together {
            day_to_day: self.day_to_day,
            temperature: warms.then(TemperatureOptions::default),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CampaignFile {
    scenario: String,
    seed: Option<u64>,
    #[serde(default)]
    day_to_day: BTreeMap<String, NonNegative>,
    recording: Vec<RecordingFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RecordingFile {
    name: String,
    chamber: Option<ChamberFile>,
}
