//! `campaign.toml`: recordings of one instrument that are calibrated together.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::error::FileError;
use super::fields::{Document, Field, Fields};
use super::small_file;
use crate::calibration::{DayToDay, Group, TemperatureOptions, Together};
use crate::imu::{HIGHEST_ORDER, InstallationForm, ParameterKind};
use crate::recording::Temperature;
use crate::run::Run;
use crate::units::ARCSEC;

/// The version of the format.
const FORMAT: &str = "turncal-campaign/1";
/// Temperatures that an instrument may have, °C.
const LARGEST_TEMPERATURE: f64 = 100.0;

/// Recordings of one instrument with what they have in common.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// The name of its directory, or of the file.
    pub name: String,
    /// In the order of their names, whatever that of the file.
    pub runs: Vec<Run>,
    /// What they have in common.
    pub together: Together,
}

/// A recording as the file names it.
struct Named {
    path: PathBuf,
    temperature: Option<f64>,
}

impl Campaign {
    /// Whether a file says that it is one.
    pub fn is_at(path: &Path) -> bool {
        let Ok(text) = small_file::text(path) else {
            return false;
        };
        let document = Document {
            file: path,
            text: &text,
        };
        let Ok(table) = document.parse() else {
            return false;
        };
        let format = Fields::of(document, &table).get("format");
        format.is_some_and(|field| {
            let format = field.text();
            format.is_ok_and(|format| format.starts_with("turncal-campaign/"))
        })
    }

    /// Reads a campaign and its recordings, whose paths are relative to it.
    ///
    /// # Errors
    /// [`FileError`] if it or a recording cannot be read, or a value cannot be.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let text = small_file::text(path).map_err(|error| {
            let advice = "Give the path of a campaign.toml.";
            FileError::io(path, "read the campaign", &error, advice)
        })?;
        let document = Document {
            file: path,
            text: &text,
        };
        let table = document.parse()?;
        let known = ["format", "recording", "own", "day_to_day", "temperature"];
        let top = Fields::top(document, &table, &known)?;
        top.need("format", "the format of this file")?
            .choice(&[(FORMAT, ())])?;
        let directory = path.parent().unwrap_or(Path::new(""));
        let mut named = recordings(&top, directory)?;
        named.sort_by(|a, b| a.path.cmp(&b.path));
        if let Some(pair) = named.windows(2).find(|pair| pair[0].path == pair[1].path) {
            let advice = "Name every recording once.";
            let found = format_args!("{} twice", pair[0].path.display());
            let place = super::error::Place::File;
            return Err(FileError::new(
                path,
                place,
                found,
                "each recording once",
                advice,
            ));
        }
        let temperature = temperature(&top)?;
        let runs = named.par_iter().map(|named| {
            let mut run = Run::read(&named.path)?;
            let of_meta = run.recording.meta.get("temperature_degc");
            let stated = named
                .temperature
                .or_else(|| of_meta.and_then(|text| text.parse().ok()))
                .filter(|t: &f64| t.abs() <= LARGEST_TEMPERATURE);
            let of_run = &mut run.recording.imu.temperature;
            *of_run = of_run.take().or(stated.map(Temperature::constant));
            Ok(run)
        });
        let mut runs: Vec<Run> = runs.collect::<Result<_, FileError>>()?;
        doubt_stuck(&mut runs);
        let day_to_day = day_to_day(&top, &runs)?;
        let temperature = match temperature {
            Stated::Follows(options) => Some(options),
            Stated::Constant => None,
            Stated::NotSaid => {
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

/// The `campaign.toml` of recordings with these paths, relative to it, that differ from day to day by this 1σ.
pub fn campaign_text(paths: &[String], day_to_day: &DayToDay) -> String {
    let mut text = format!("format = \"{FORMAT}\"\n");
    for path in paths {
        text += &format!(
            "\n[[recording]]\nrun = {}\n",
            toml::Value::from(path.as_str())
        );
    }
    let lines = Group::all().filter_map(|group| {
        let (key, unit) = DayToDay::key(group);
        let first = group
            .parameters(InstallationForm::General)
            .first()
            .copied()?;
        Some((key, day_to_day.parameters[first] / unit))
    });
    let mounting = (MOUNTING.to_owned(), day_to_day.mounting / ARCSEC);
    let lines = lines.chain([mounting]).filter(|&(_, sigma)| sigma > 0.0);
    let lines: Vec<String> = lines
        .map(|(key, sigma)| format!("{key} = {}\n", three_digits(sigma)))
        .collect();
    if !lines.is_empty() {
        text += "\n# 1σ from one recording to the next\n[day_to_day]\n";
        text.extend(lines);
    }
    text
}

/// A number of three digits as TOML has it.
fn three_digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    format!("{rounded:?}")
}

fn recordings(top: &Fields, directory: &Path) -> Result<Vec<Named>, FileError> {
    let known = ["run", "temperature_degc"];
    let meaning = "a [[recording]] for each run, with run = \"its run.toml\"";
    let tables = top.need_tables("recording", &known, meaning)?;
    let recording = |fields: &Fields| {
        let temperature = fields.get("temperature_degc");
        let within = |field: Field| field.within(-LARGEST_TEMPERATURE, LARGEST_TEMPERATURE);
        Ok(Named {
            path: directory.join(fields.need("run", "the path of a run.toml")?.text()?),
            temperature: temperature.map(within).transpose()?,
        })
    };
    tables.iter().map(recording).collect()
}

/// Notes temperatures that never change where those of other recordings do.
fn doubt_stuck(runs: &mut [Run]) {
    let facts = |run: &Run| {
        run.recording
            .imu
            .log
            .as_ref()
            .and_then(|log| log.temperature)
    };
    let stuck: Vec<Option<f64>> = runs
        .iter()
        .map(|run| {
            facts(run)
                .filter(|of| of.smallest == of.largest)
                .map(|of| of.smallest)
        })
        .collect();
    let any_varies = runs
        .iter()
        .zip(&stuck)
        .any(|(run, stuck)| facts(run).is_some() && stuck.is_none());
    for (run, stuck) in runs.iter_mut().zip(stuck).filter(|_| any_varies) {
        if let Some(value) = stuck {
            run.recording.notes.push(format!(
                "The temperature of {} is {value} °C in every row, that of other recordings varies: is its sensor stuck? \
                 Say temperature_degc beside the recording in the campaign, and leave the column out of its run.toml.",
                run.recording.name
            ));
        }
    }
}

/// What a campaign says of temperature.
enum Stated {
    Follows(TemperatureOptions),
    Constant,
    NotSaid,
}

fn temperature(top: &Fields) -> Result<Stated, FileError> {
    let Some(field) = top.get("temperature") else {
        return Ok(Stated::NotSaid);
    };
    if !field.is_table() {
        return Ok(match field.flag()? {
            true => Stated::Follows(TemperatureOptions::default()),
            false => Stated::Constant,
        });
    }
    let known = ["highest_order", "rate", "reference_degc"];
    let Some(fields) = top.table("temperature", &known)? else {
        return Ok(Stated::NotSaid);
    };
    let mut options = TemperatureOptions::default();
    if let Some(field) = fields.get("highest_order") {
        let highest = field.within(1.0, HIGHEST_ORDER as f64)?;
        options.highest_order = highest.round() as usize;
    }
    if let Some(field) = fields.get("rate") {
        options.rate = field.flag()?;
    }
    if let Some(field) = fields.get("reference_degc") {
        options.reference = Some(field.within(-LARGEST_TEMPERATURE, LARGEST_TEMPERATURE)?);
    }
    Ok(Stated::Follows(options))
}

/// The key of the mounting in `[day_to_day]`.
const MOUNTING: &str = "mounting_arcsec";

/// The name of a group in `own`.
fn own_name(group: Group) -> String {
    let kind = match group.kind() {
        ParameterKind::Scale => "scale",
        ParameterKind::Installation => "installation",
        ParameterKind::Bias => "bias",
    };
    format!("{}.{kind}", group.sensor().name())
}

/// 1σ by which recordings differ.
fn day_to_day(top: &Fields, runs: &[Run]) -> Result<DayToDay, FileError> {
    let form = InstallationForm::General;
    let mut of_recordings = DayToDay::default();
    let sigma = &mut of_recordings.parameters;
    let keys: Vec<(String, f64)> = Group::all().map(DayToDay::key).collect();
    let known = keys.iter().map(|(key, _)| key.as_str());
    let known: Vec<&str> = known.chain([MOUNTING]).collect();
    if let Some(fields) = top.table("day_to_day", &known)? {
        if let Some(field) = fields.get(MOUNTING) {
            of_recordings.mounting = field.not_negative()? * ARCSEC;
        }
        for (group, (key, unit)) in Group::all().zip(&keys) {
            if let Some(field) = fields.get(key) {
                let stated = field.not_negative()? * unit;
                group
                    .parameters(form)
                    .into_iter()
                    .for_each(|i| sigma[i] = stated);
            }
        }
    }
    let Some(field) = top.get("own") else {
        return Ok(of_recordings);
    };
    for name in field.texts()? {
        let Some(group) = Group::all().find(|&group| own_name(group) == *name) else {
            let known: Vec<String> = Group::all().map(own_name).collect();
            return Err(field.error(
                format_args!("names among {}", known.join(", ")),
                "Name groups of parameters that each recording has for itself.",
            ));
        };
        // What differs as much as instruments do has nothing in common.
        for i in group.parameters(form) {
            let (sensor, of_triad) = crate::calibration::sensor_and_parameter(i);
            let prior = runs
                .first()
                .map(|run| run.instrument.prior.get(sensor).sigma(form));
            sigma[i] = prior.map_or(0.0, |prior| prior[of_triad]);
        }
    }
    Ok(of_recordings)
}
