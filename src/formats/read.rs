//! `run.toml` and the files that it names, as one [`Run`].

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::draft::motion::Motion;
use super::error::{FileError, Place};
use super::fields::{Document, Fields};
use super::instrument::InstrumentFields;
use super::segments;
use super::small_file;
use super::table_log::TableLogFile;
use crate::earth::Site;
use crate::imu::{NoiseKeys, Output, PerSensor, Sensor};
use crate::noise;
use crate::recording::{ImuSamples, Recording, faults, nanoseconds};
use crate::run::{Run, SET_BY_HAND, Standstill};
use crate::units::{ARCSEC, DEGREE, MILLIGAL, PPM};

/// The version of the format of `run.toml`.
pub(super) const FORMAT: &str = "turncal-run/1";

/// Fields of `[meta]`.
pub(super) const META: [&str; 8] = [
    "instrument",
    "serial",
    "operator",
    "date",
    "temperature_degc",
    "laboratory",
    "table",
    "notes",
];

/// The fields of `run.toml` itself.
const TABLES: [&str; 7] = [
    "format",
    "site",
    "meta",
    "imu",
    "standstill",
    "turntable",
    "segments",
];

impl Run {
    /// Reads `run.toml` and the files that it names, relative to itself.
    ///
    /// Everything is checked: every field is known, every number finite and possible, time uniform,
    /// the files overlap. Samples, nominal scales and priors come back along right-front-up
    /// whatever `body_axes` says. What is not stated of place, noise, period and prior is wide, with a note that says so.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::of_text(path, &text_of(path)?, Some(path))
    }

    /// The same of the text of a `run.toml` that stands, or would stand, beside this file, and was read from `source`.
    pub(super) fn of_text(
        path: &Path,
        text: &str,
        source: Option<&Path>,
    ) -> Result<Self, FileError> {
        let document = Document { file: path, text };
        let table = document.parse()?;
        let top = Fields::top(document, &table, &TABLES)?;
        top.need("format", "the format of this file")?
            .choice(&[(FORMAT, ())])?;
        let directory = path.parent().unwrap_or(Path::new(""));
        let mut notes = Vec::new();

        let site = site(&top, &mut notes)?;
        let meta = meta(&top)?;
        let instrument = InstrumentFields::of_fields(&top, directory, &mut notes)?;
        let standstill = standstill(&top)?;
        let table_log = TableLogFile::of_fields(&top, directory, &mut notes)?;
        let (segments_file, segment_sigma) = labels(&top, directory)?.unzip();

        // The small files' fields are checked before the large files are read.
        let mut files: Vec<PathBuf> = source.map(Path::to_owned).into_iter().collect();
        files.push(instrument.log.source.file.clone());
        files.extend(other_file(&instrument));
        files.extend(table_log.as_ref().map(|log| log.source.file.clone()));
        files.extend(segments_file.clone());
        let mut imu = instrument.log.read(&mut notes)?;
        if instrument.without_period {
            imu = with_found_period(imu, &instrument, &mut notes)?;
        }
        notes.extend(faults::notes(&imu));
        notes.extend(clock_note(&imu, &instrument));
        let mut known = instrument.known;
        let without_noise =
            |sensor: &Sensor| !known.noise_is_stated.get(*sensor) && imu.has(*sensor);
        for sensor in Sensor::ALL.into_iter().filter(without_noise) {
            let random_walk = noise::white_noise(&imu, sensor);
            known.noise.get_mut(sensor).random_walk = random_walk;
            notes.push(noise_note(sensor, random_walk));
        }
        let accuracy = table_log.as_ref().map(|log| log.accuracy);
        let table = table_log
            .map(|log| log.read(&imu, &mut notes))
            .transpose()?;
        let segments = match segments_file {
            Some(file) => {
                let log = &instrument.log;
                segments::read(&file, &imu, log.stamp.lag(), log.axes, &mut notes)?
            }
            None => Vec::new(),
        };
        let run = Self {
            recording: Recording {
                name: name(path),
                meta,
                imu,
                table,
                segments,
                files,
                notes,
            },
            instrument: known,
            site,
            table: accuracy.unwrap_or_default(),
            standstill,
            segment_sigma: segment_sigma.unwrap_or(SET_BY_HAND),
        };
        let doubts = run.doubts();
        Ok(run.with_notes(doubts))
    }

    /// `[meta]` of a `run.toml` alone, for a run whose logs cannot be read.
    ///
    /// # Errors
    /// [`FileError`] if not even that can be read.
    pub fn read_meta(path: &Path) -> Result<BTreeMap<String, String>, FileError> {
        let text = text_of(path)?;
        let document = Document {
            file: path,
            text: &text,
        };
        let table = document.parse()?;
        meta(&Fields::of(document, &table))
    }

    fn with_notes(mut self, notes: Vec<String>) -> Self {
        self.recording.notes.extend(notes);
        self
    }
}

/// The file of the accelerometers, if it is another than that of the gyros.
fn other_file(instrument: &InstrumentFields) -> Option<PathBuf> {
    let (source, _) = instrument.log.accel_from.as_ref()?;
    (source.file != instrument.log.source.file).then(|| source.file.clone())
}

fn text_of(path: &Path) -> Result<String, FileError> {
    let advice = "Give the path of a run.toml.";
    small_file::text(path).map_err(|error| FileError::io(path, "read the run", &error, advice))
}

/// Rates of which nothing tells how long a row lasts, with the period at which they turn the instrument as gravity's
/// direction turns.
fn with_found_period(
    imu: ImuSamples,
    instrument: &InstrumentFields,
    notes: &mut Vec<String>,
) -> Result<ImuSamples, FileError> {
    let rates = |sensor| {
        imu.of(sensor)
            .iter()
            .map(|sample| sample / imu.period)
            .collect()
    };
    let motion = Motion::find(&PerSensor::from_fn(rates), &[], imu.period);
    let Some(period) = motion.angle.filter(|&period| period > 0.0) else {
        return Err(FileError::new(
            &instrument.log.source.file,
            Place::File,
            "rows without a time, whose turns do not show how long a row lasts",
            "a time column, or sample_period_s in run.toml",
            "Add sample_period_s to [imu].",
        ));
    };
    // The scale factors of the gyros are taken to be right on average.
    let sigma = instrument.known.prior.gyro.scale_sigma.norm() / 3.0;
    notes.push(format!(
        "run.toml does not state sample_period_s, and the log has no time. turncal found {:.4} s ± {:.1} % from the turns, \
         which widens the σ of the gyro scale factors as much.",
        period,
        100.0 * sigma
    ));
    Ok(imu.with_period(period, sigma))
}

/// What it means that stamps were taken and not `sample_period_s`.
///
/// Rates are integrated over the period to angles, increments of velocity divided by it to specific
/// force: a scale changes by as much as the period.
fn clock_note(imu: &ImuSamples, instrument: &InstrumentFields) -> Option<String> {
    let off = imu.log.as_ref()?.off_stated_period?;
    let (sensor, triad) = match instrument.log.output {
        Output::Rate => (Sensor::Gyro, "gyros"),
        Output::Pulse | Output::Increment => (Sensor::Accel, "accelerometers"),
    };
    let sigma = instrument.known.prior.get(sensor).scale_sigma.min();
    let ppm = |part: f64| format!("{:.2}", part / PPM);
    let found = format!(
        "Stamps come every {} s, {} ppm {} than sample_period_s says; stamps are taken, and the scale of the \
         {triad} is by as much another",
        nanoseconds(imu.period),
        ppm(off.abs()),
        if off > 0.0 { "more" } else { "less" },
    );
    Some(if off.abs() <= sigma {
        format!("{found}, within its prior σ of {} ppm.", ppm(sigma))
    } else {
        format!(
            "{found}, beyond its prior σ of {} ppm: if the instrument's clock is right and the stamps are not, \
             leave the time column out.",
            ppm(sigma)
        )
    })
}

/// The name of the directory of a `run.toml`, else the file's own without its endings.
pub(super) fn name(path: &Path) -> String {
    let mut full = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    if full.extension().is_some_and(|of| of == "gz") {
        full.set_extension("");
    }
    let named = match full.file_name() {
        Some(file) if file == "run.toml" => full.parent().and_then(Path::file_name),
        _ => full.file_stem(),
    };
    named.map_or_else(
        || "run".to_owned(),
        |name| name.to_string_lossy().into_owned(),
    )
}

/// That white noise is not stated, and what is taken for it.
fn noise_note(sensor: Sensor, random_walk: f64) -> String {
    let (key, unit) = NoiseKeys::of(sensor).random_walk;
    format!(
        "run.toml does not state {key}. turncal starts with {:.3}, which the quieter part of the record shows, and \
         estimates the noise from there.",
        random_walk / unit
    )
}

/// 1σ of a height that is not stated, m.
const USUAL_HEIGHT: f64 = 500.0;
/// How much gravity falls with height, (m/s²)/m.
const FREE_AIR: f64 = 0.3086 * MILLIGAL;

fn site(top: &Fields, notes: &mut Vec<String>) -> Result<Site, FileError> {
    let known = [
        "latitude_deg",
        "longitude_deg",
        "height_m",
        "gravity_m_s2",
        "gravity_sigma_mgal",
    ];
    let fields = top.table("site", &known)?;
    let get = |name| fields.as_ref().and_then(|fields| fields.get(name));
    let degrees = |name, low, high| -> Result<Option<f64>, FileError> {
        let field = get(name).map(|field| field.within(low, high));
        Ok(field.transpose()?.map(|degrees| degrees * DEGREE))
    };
    let latitude = degrees("latitude_deg", -90.0, 90.0)?;
    if latitude.is_none() && top.get("turntable").is_some() {
        let meaning = "a latitude, north positive: beside a [turntable] Earth rate must be known";
        return Err(match &fields {
            Some(fields) => fields.missing("latitude_deg", meaning),
            None => top.missing("site.latitude_deg", meaning),
        });
    }
    let longitude = degrees("longitude_deg", -180.0, 360.0)?.unwrap_or(0.0);
    // From the shore of the Dead Sea to above any laboratory.
    let height = get("height_m").map(|field| field.within(-500.0, 9000.0));
    let height = height.transpose()?;
    let mut site = match latitude {
        Some(latitude) => Site::with_normal_gravity(latitude, longitude, height.unwrap_or(0.0)),
        None => Site::unknown(),
    };
    if height.is_none() {
        site.gravity_sigma = site.gravity_sigma.hypot(FREE_AIR * USUAL_HEIGHT);
    }
    let gravity = get("gravity_m_s2");
    if let Some(field) = &gravity {
        let gravity = field.within(9.7, 9.9)?;
        site = site.with_gravity(gravity, stated_gravity_sigma(&field.as_written()?));
    }
    if let Some(field) = get("gravity_sigma_mgal") {
        site.gravity_sigma = field.within(0.0, 1e5)? * MILLIGAL;
    }
    if latitude.is_none() {
        notes.push(
            "run.toml does not state latitude_deg in [site]. turncal estimates Earth rate as an unknown vector, which \
             widens the σ of the gyro biases."
                .to_owned(),
        );
    }
    if gravity.is_none() && (latitude.is_none() || height.is_none()) {
        notes.push(format!(
            "run.toml does not state the place in [site]. turncal assumed a gravity of {:.4} ± {:.4} m/s², which widens \
             the σ of the accelerometer scale factors by as much. State latitude_deg and height_m, or gravity_m_s2.",
            site.gravity, site.gravity_sigma
        ));
    }
    Ok(site)
}

/// 1σ of a gravity that is stated without one, m/s²: of its last digit, and no less than a milligal.
fn stated_gravity_sigma(written: &str) -> f64 {
    let digits = written
        .split_once('.')
        .map_or(0, |(_, digits)| digits.len());
    let last = 10f64.powi(-i32::try_from(digits).unwrap_or(i32::MAX));
    MILLIGAL.max(last / 12f64.sqrt())
}

fn meta(top: &Fields) -> Result<BTreeMap<String, String>, FileError> {
    match top.table("meta", &META)? {
        Some(fields) => fields
            .all()
            .map(|(name, field)| Ok((name.to_owned(), field.as_written()?)))
            .collect(),
        None => Ok(BTreeMap::new()),
    }
}

/// The file of labelled sections and how well they are set.
fn labels(top: &Fields, directory: &Path) -> Result<Option<(PathBuf, f64)>, FileError> {
    let Some(fields) = top.table("segments", &["file", "position_sigma_deg"])? else {
        return Ok(None);
    };
    let file = directory.join(fields.need("file", "a file name")?.text()?);
    let sigma = match fields.get("position_sigma_deg") {
        Some(field) => field.positive()? * DEGREE,
        None => SET_BY_HAND,
    };
    Ok(Some((file, sigma)))
}

fn standstill(top: &Fields) -> Result<Standstill, FileError> {
    let mut standstill = Standstill::default();
    if let Some(fields) = top.table(
        "standstill",
        &[
            "velocity_sigma_m_s",
            "attitude_sigma_arcsec",
            "turning_deg_per_sqrt_s",
            "position_sigma_m",
        ],
    )? {
        if let Some(field) = fields.get("velocity_sigma_m_s") {
            standstill.sigma.accel = Some(field.positive()?);
        }
        if let Some(field) = fields.get("attitude_sigma_arcsec") {
            standstill.sigma.gyro = Some(field.positive()? * ARCSEC);
        }
        if let Some(field) = fields.get("turning_deg_per_sqrt_s") {
            standstill.turning = field.not_negative()? * DEGREE;
        }
        if let Some(field) = fields.get("position_sigma_m") {
            standstill.position_sigma = field.positive()?;
        }
    }
    Ok(standstill)
}
