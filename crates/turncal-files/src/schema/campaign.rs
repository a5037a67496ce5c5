//! `campaign.toml`: recordings of one instrument that are calibrated jointly.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::page::{self, Remarks};
use crate::is_toml;
use turncal::calibration::{DayToDay, TemperatureOptions, Together};
use turncal::imu::HIGHEST_ORDER;
use turncal::number::rounded;
use turncal::recording::Temperature;
use turncal::run::Run;
use turncal_input::{Celsius, Document, FileError, NonNegative, small_file};

/// The version of the file format.
const FORMAT: &str = "turncal-campaign/1";
/// Recordings of one instrument with the settings common to them.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// Name of the campaign's directory or file.
    pub name: String,
    /// Recordings sorted by name, so that their order in the file does not matter.
    pub runs: Vec<Run>,
    /// Common settings.
    pub together: Together,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CampaignFile {
    temperature: Option<TemperatureFile>,
    recording: Vec<RecordingFile>,
    /// 1σ from one recording to the next.
    #[serde(default)]
    day_to_day: BTreeMap<String, NonNegative>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RecordingFile {
    run: PathBuf,
    temperature_degc: Option<Celsius>,
}

/// Temperature dependence of parameters.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "true, false, or a table with `highest_order` (1 to 5), `rate` and `reference_degc`"
)]
enum TemperatureFile {
    Follows(bool),
    With {
        highest_order: Option<u8>,
        rate: Option<bool>,
        reference_degc: Option<Celsius>,
    },
}

impl Campaign {
    /// Whether a file describes a campaign.
    pub fn is_at(path: &Path) -> bool {
        if !is_toml(path) {
            return false;
        }
        let text = small_file::text(path, "", "").unwrap_or_default();
        let table = Document::of(path, &text).parse().ok();
        let format = table.and_then(|table| {
            let format = table.get_ref().get("format")?.get_ref().as_str()?;
            Some(format.starts_with("turncal-campaign/"))
        });
        format == Some(true)
    }

    /// Reads a campaign and its recordings, whose paths are relative to it.
    ///
    /// # Errors [`FileError`] if the campaign or a recording cannot be read, or a value is invalid.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let text = small_file::text(path, "the campaign", "Give the path of a campaign.toml.")?;
        let document = Document::of(path, &text);
        let mut file: CampaignFile = document.fill(document.of_format(FORMAT)?)?;
        if file.recording.is_empty() {
            return Err(document.missing("recording", ""));
        }
        let directory = path.parent().unwrap_or(Path::new(""));
        let named = &mut file.recording;
        for recording in named.iter_mut() {
            recording.run = directory.join(&recording.run);
        }
        named.sort_by(|a, b| a.run.cmp(&b.run));
        if let Some(pair) = named.windows(2).find(|pair| pair[0].run == pair[1].run) {
            let advice = "List each recording once.";
            let found = format_args!("{} twice", pair[0].run.display());
            return Err(FileError::of(path, found, "each recording once", advice));
        }
        let temperature = file.temperature.map(|of| temperature(document, of));
        let temperature = temperature.transpose()?;
        let runs = named.par_iter().map(|named| {
            let mut run = crate::read_run(&named.run)?;
            let of_meta = run.recording.meta.get("temperature_degc");
            let of_meta = || Celsius::try_from(of_meta?.parse::<f64>().ok()?).ok();
            let stated = named.temperature_degc.or_else(of_meta).map(|of| of.0);
            let of_run = &mut run.recording.imu.temperature;
            *of_run = of_run.take().or(stated.map(Temperature::constant));
            Ok(run)
        });
        let runs: Vec<Run> = runs.collect::<Result<_, FileError>>()?;
        let stated = &file.day_to_day;
        document.only("day_to_day", stated.keys(), &DayToDay::keys())?;
        let value = |key: &str| stated.get(key).map_or(0.0, |sigma| sigma.0);
        let day_to_day = DayToDay::of_values(value);
        let temperature = match temperature {
            Some(stated) => stated,
            None => {
                let known = |run: &Run| run.recording.imu.temperature.is_some();
                runs.iter().all(known).then(TemperatureOptions::default)
            }
        };
        Ok(Self {
            name: super::read::name(path),
            runs,
            together: Together {
                day_to_day,
                temperature,
            },
        })
    }
}

/// The `campaign.toml` for recordings with these relative paths and this 1σ between recordings.
pub fn campaign_text(paths: &[String], day_to_day: &DayToDay) -> String {
    let recording = |path: &String| RecordingFile {
        run: path.into(),
        temperature_degc: None,
    };
    let rounded_sigma = |(key, sigma)| (key, NonNegative(rounded(sigma, 3)));
    let differing = day_to_day.values().filter(|(_, sigma)| *sigma > 0.0);
    let file = CampaignFile {
        temperature: None,
        recording: paths.iter().map(recording).collect(),
        day_to_day: differing.map(rounded_sigma).collect(),
    };
    let mut remarks = Remarks::default();
    remarks.before(
        "day_to_day",
        "1σ of the difference from one recording to the next",
    );
    page::text(FORMAT, &file, &remarks)
}

/// Temperature dependence of parameters; `None` if constant.
fn temperature(
    document: Document,
    stated: TemperatureFile,
) -> Result<Option<TemperatureOptions>, FileError> {
    let usual = TemperatureOptions::default();
    let (highest_order, rate, reference) = match stated {
        TemperatureFile::Follows(follows) => return Ok(follows.then_some(usual)),
        TemperatureFile::With {
            highest_order,
            rate,
            reference_degc,
        } => (highest_order, rate, reference_degc),
    };
    let highest_order = highest_order.map_or(usual.highest_order, usize::from);
    if !(1..=HIGHEST_ORDER).contains(&highest_order) {
        let expected = format_args!("a whole number from 1 to {HIGHEST_ORDER}");
        let path = "temperature.highest_order";
        return Err(document.wrong(path, expected, "Correct this value."));
    }
    Ok(Some(TemperatureOptions {
        highest_order,
        rate: rate.unwrap_or(usual.rate),
        reference: reference.map(|of| of.0).or(usual.reference),
    }))
}
