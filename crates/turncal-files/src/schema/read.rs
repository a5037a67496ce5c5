//! Reads `run.toml` and the files given in it as one [`Run`].

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;
use toml::de::DeTable;

use super::instrument::{Fields, InstrumentFields};
use super::{FORMAT, META, RunFile, StandstillFile};
use crate::draft::turned_angle;
use crate::imu_log::ImuLog;
use crate::inputs::segments;
use turncal::earth::Site;
use turncal::imu::{Instrument, NoiseKeys, Output, PerSensor, Sensor};
use turncal::noise;
use turncal::recording::{ImuSamples, Recording, faults, nanoseconds};
use turncal::run::{Run, SET_BY_HAND, Standstill};
use turncal::units::{ARCSEC, DEGREE, MICRO_G_PER_SQRT_HZ, MILLIGAL, PPM};
use turncal_input::{Document, FileError, small_file, stated_gravity_sigma};
use turncal_logs::DataFile;

/// White noise of means of positions, averaged for unknown times: that of a MEMS sensor in a second, (m/s)/√s.
const NOISE_OF_MEANS: f64 = 300.0 * MICRO_G_PER_SQRT_HZ;

/// Reads `run.toml` and the files given in it, relative to itself.
///
/// Checks everything: that fields are known, numbers are finite and possible, times are uniform and files overlap. The
/// samples, nominal scales and priors are along the right, front and up axes, whatever `body_axes` is. If the site,
/// noise, period or prior is not stated, it gets a wide default, with a note.
pub fn read_run(path: &Path) -> Result<Run, FileError> {
    run_of_text(path, &text_of(path)?, Some(path), &[])
}

/// Reads the text of a `run.toml` that is located (or assumed to be) next to this file and was read from `source`; the
/// files that it names may be in memory.
pub fn run_of_text(
    path: &Path,
    text: &str,
    source: Option<&Path>,
    in_memory: &[DataFile],
) -> Result<Run, FileError> {
    let document = Document::of(path, text);
    let file = run_file(document)?;
    let mut fields = Fields::new(document, &file, in_memory);
    let site = fields.site()?;
    let instrument = fields.instrument()?;
    let table_log = fields.table_log()?;
    let gyro = (&instrument.log.source, instrument.log.clock);
    let magnetometer = fields.magnetometer(&site, gyro)?;
    let segments_file = file.segments.as_ref().map(|of| fields.file(&of.file));
    let mut notes = fields.notes;

    // The small files' fields are checked before the large files are read.
    let log = &instrument.log.source.file;
    let files = [
        source.map(Path::to_owned),
        (log.table().is_none()).then(|| log.to_path_buf()),
        other_file(&instrument.log),
        table_log.as_ref().map(|log| log.source.file.to_path_buf()),
        segments_file.as_deref().map(Path::to_owned),
        magnetometer.as_ref().and_then(|of| of.own_file(log)),
    ];
    let imu = instrument.samples(&mut notes)?;
    let magnetometer = magnetometer
        .map(|of| of.read(&imu, &mut notes))
        .transpose()?;
    let known = instrument.with_noise(&imu, &mut notes);
    let table = (table_log.as_ref()).map(|log| log.read(&imu, &mut notes));
    let table = table.transpose()?;
    let log = &instrument.log;
    let segments = segments_file
        .map(|file| segments::read(&file, &imu, log.stamp.lag(), log.axes, &mut notes));
    let segments = segments.transpose()?.unwrap_or_default();
    let position_sigma = (file.segments.as_ref()).and_then(|of| of.position_sigma_deg);
    let mut run = Run {
        recording: Recording {
            name: name(path),
            meta: file.meta.clone(),
            imu,
            magnetometer,
            table,
            segments,
            files: files.into_iter().flatten().collect(),
            notes,
            doubts: Vec::new(),
        },
        instrument: known,
        site,
        table: table_log.map_or_else(Default::default, |log| log.accuracy),
        standstill: standstill(&file.standstill),
        segment_sigma: position_sigma.map_or(SET_BY_HAND, |sigma| sigma.0 * DEGREE),
    };
    let aligned = run.align_table();
    run.recording.notes.extend(aligned);
    run.recording.doubts = run.doubts();
    Ok(run)
}

/// The IMU file given in a `run.toml`; it need not exist.
///
/// # Errors
/// Returns [`FileError`] if the `run.toml` is invalid.
pub fn imu_file_of(path: &Path) -> Result<PathBuf, FileError> {
    let text = text_of(path)?;
    let file = run_file(Document::of(path, &text))?.imu.file;
    Ok(path.parent().unwrap_or(Path::new("")).join(file))
}

/// Reads only `[meta]` of a `run.toml`, for a run with unreadable logs.
///
/// # Errors
/// Returns [`FileError`] if the file cannot be read.
pub fn read_meta(path: &Path) -> Result<BTreeMap<String, String>, FileError> {
    let text = text_of(path)?;
    let document = Document::of(path, &text);
    #[derive(Deserialize)]
    struct Meta {
        #[serde(default)]
        meta: BTreeMap<String, String>,
    }
    let Meta { meta } = fill(document, document.parse()?)?;
    Ok(meta)
}

/// Refuses a `run.toml` that [`crate::read_run`] would refuse whatever the named files contain.
pub fn check(document: Document) -> Result<(), FileError> {
    let run = run_file(document)?;
    let mut fields = Fields::new(document, &run, &[]);
    let site = fields.site()?;
    let instrument = fields.instrument()?;
    let gyro = (&instrument.log.source, instrument.log.clock);
    fields.magnetometer(&site, gyro)?;
    fields.table_log().map(drop)
}

/// The fields of a `run.toml`.
fn run_file(document: Document) -> Result<RunFile, FileError> {
    fill(document, document.of_format(FORMAT)?)
}

/// The document with numbers and dates of `[meta]` as written.
fn fill<'a, T: Deserialize<'a>>(
    document: Document<'a>,
    mut table: Spanned<DeTable<'a>>,
) -> Result<T, FileError> {
    if let Some(meta) = table.get_mut().get_mut("meta") {
        document.as_written(meta);
        let names = meta.get_ref().as_table().into_iter();
        let names = names.flat_map(|of| of.keys().map(|name| &**name.get_ref()));
        document.only("meta", names, &META)?;
    }
    document.fill(table)
}

/// The accelerometer file, if different from the gyro file.
fn other_file(log: &ImuLog) -> Option<PathBuf> {
    let (source, _) = log.accel_from.as_ref()?;
    (source.file != log.source.file).then(|| source.file.to_path_buf())
}

fn text_of(path: &Path) -> Result<String, FileError> {
    small_file::text(path, "the run", "Give the path of a run.toml.")
}

impl InstrumentFields<'_> {
    /// The samples of the log, checked against the statements.
    fn samples(&self, notes: &mut Vec<String>) -> Result<ImuSamples, FileError> {
        let mut imu = self.log.read(notes)?;
        if self.without_period {
            imu = self.with_found_period(imu, notes)?;
        } else {
            imu.period_sigma = self.period_sigma;
        }
        notes.extend(faults::notes(&imu));
        notes.extend(self.clock_note(&imu));
        Ok(imu)
    }

    /// The instrument, with unstated white noise estimated from the log.
    fn with_noise(&self, imu: &ImuSamples, notes: &mut Vec<String>) -> Instrument {
        let mut known = self.known.clone();
        let mut found = Vec::new();
        for sensor in Sensor::ALL {
            if !known.noise_is_stated.get(sensor) && imu.has(sensor) {
                let random_walk = if imu.is_of_means() {
                    NOISE_OF_MEANS
                } else {
                    noise::white_noise(imu, sensor)
                };
                known.noise.get_mut(sensor).random_walk = random_walk;
                let (key, unit) = NoiseKeys::of(sensor).random_walk;
                found.push(format!("{key} = {:.3}", random_walk / unit));
            }
        }
        if imu.is_of_means() {
            notes.push(format!(
                "The rows are the means of {} positions, whose noise is unknown. turncal assumed {}, the noise of a \
                 MEMS sensor averaged over one second. If you know the noise, state \
                 velocity_random_walk_ug_per_sqrt_hz for rows of one second.",
                imu.len(),
                found.join(", ")
            ));
        } else if !found.is_empty() {
            notes.push(format!(
                "run.toml states no white noise. turncal starts with the noise of the quieter part of the recording \
                 ({}) and improves this estimate. If you know the values of the data sheet, state them in \
                 [imu.noise].",
                found.join(", ")
            ));
        }
        known
    }

    /// Rates without a known period, with the period for which their rotation matches that of gravity.
    fn with_found_period(
        &self,
        imu: ImuSamples,
        notes: &mut Vec<String>,
    ) -> Result<ImuSamples, FileError> {
        let rates = |sensor| imu.of(sensor).iter().map(|row| row / imu.period).collect();
        let angle = turned_angle(PerSensor::from_fn(rates), imu.period);
        let Some(period) = angle.filter(|&period| period > 0.0) else {
            return Err(FileError::of(
                &self.log.source.file,
                "rows without time stamps, and no turns with which to estimate the sample period",
                "a time column or sample_period_s in run.toml",
                "State sample_period_s (--rate).",
            ));
        };
        // The scale factors of the gyros are taken to be right on average.
        let sigma = self.known.prior.gyro.scale_sigma.norm() / 3.0;
        let percent = 100.0 * sigma;
        notes.push(format!(
            "The log has no time column, and its rate is not stated. turncal estimated a sample period of {period:.4} \
             s ± {percent:.1} % from the turns; this uncertainty is included in the σ of the gyro scale factors. State \
             sample_period_s (--rate)."
        ));
        Ok(imu.with_period(period, sigma))
    }

    /// Effect of using stamps instead of `sample_period_s`.
    ///
    /// Rates are integrated over the period to angles, and velocity increments are divided by it, so a scale factor
    /// changes in proportion to the period.
    fn clock_note(&self, imu: &ImuSamples) -> Option<String> {
        let off = imu.log.as_ref()?.off_stated_period?;
        let (sensor, triad) = match self.log.output {
            Output::Rate => (Sensor::Gyro, "gyros"),
            Output::Pulse | Output::Increment => (Sensor::Accel, "accelerometers"),
        };
        let prior = self.known.prior.get(sensor).scale_sigma.min();
        let (ppm, sigma) = (off.abs() / PPM, prior / PPM);
        let period = nanoseconds(imu.period);
        let way = if off > 0.0 { "more" } else { "less" };
        let (judged, advice) = if off.abs() <= prior {
            ("within", "")
        } else {
            (
                "beyond",
                " If the clock of the instrument is right and the time stamps are wrong, omit the time column.",
            )
        };
        Some(format!(
            "The time stamps are {period} s apart, which is {ppm:.2} ppm {way} than sample_period_s. turncal used the \
             time stamps; this changes the scale factor of the {triad} by the same amount, {judged} its prior σ of \
             {sigma:.2} ppm.{advice}"
        ))
    }
}

/// The directory name if the file is a `run.toml`; if not, the file name without extensions.
pub fn name(path: &Path) -> String {
    let mut full = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    if full.extension().is_some_and(|of| of == "gz") {
        full.set_extension("");
    }
    let named = match full.file_name() {
        Some(file) if file == "run.toml" => full.parent().and_then(Path::file_name),
        _ => full.file_stem(),
    };
    let named = named.unwrap_or("run".as_ref());
    named.to_string_lossy().into_owned()
}

impl Fields<'_> {
    fn site(&mut self) -> Result<Site, FileError> {
        let file = &self.run.site;
        if file.latitude_deg.is_none() && self.run.turntable.is_some() {
            let meaning = "the latitude (north positive), because Earth rate must be known for a run with a [turntable]";
            return Err(self.document.missing("site.latitude_deg", meaning));
        }
        let longitude = file.longitude_deg.map_or(0.0, |degrees| degrees.0 * DEGREE);
        let height = file.height_m.map(|height| height.0);
        let latitude = file.latitude_deg.map(|degrees| degrees.0 * DEGREE);
        let mut site = Site::of_knowledge(latitude, longitude, height);
        if let Some(gravity) = &file.gravity_m_s2 {
            let written = self.document.written_at("site.gravity_m_s2");
            site = site.with_gravity(gravity.0, stated_gravity_sigma(written));
        }
        if let Some(sigma) = file.gravity_sigma_mgal {
            site.gravity_sigma = sigma.0 * MILLIGAL;
        }
        let note = place_note(&site, file.gravity_m_s2.is_some(), height.is_some());
        self.notes
            .extend(note.filter(|_| !self.run.imu.is_of_magnetometer()));
        Ok(site)
    }
}

/// Effect of unstated latitude, height or gravity.
fn place_note(site: &Site, has_gravity: bool, has_height: bool) -> Option<String> {
    let has_gravity = has_gravity || (site.is_known && has_height);
    let (missing, fields) = match (site.is_known, has_height) {
        (false, false) => (
            "latitude and no height",
            "latitude_deg and height_m (--latitude, --height)",
        ),
        (false, true) => ("latitude", "latitude_deg (--latitude)"),
        (true, false) => ("height", "height_m (--height)"),
        (true, true) => return None,
    };
    let of_rate = "estimated Earth rate as an unknown vector (larger σ of the gyro biases)";
    let of_gravity = format!(
        "assumed a gravity of {:.4} ± {:.4} m/s² (larger σ of the accelerometer scale factors)",
        site.gravity, site.gravity_sigma
    );
    let costs = match (site.is_known, has_gravity) {
        (true, true) => return None,
        (true, false) => of_gravity,
        (false, true) => of_rate.to_owned(),
        (false, false) => format!("{of_rate}; it {of_gravity}"),
    };
    let or_gravity = if has_gravity {
        ""
    } else {
        ", or gravity_m_s2 (--gravity)"
    };
    Some(format!(
        "You stated no {missing}. turncal {costs}. Set {fields} in [site]{or_gravity}."
    ))
}

fn standstill(file: &StandstillFile) -> Standstill {
    let usual = Standstill::default();
    let (turning, position) = (file.turning_deg_per_sqrt_s, file.position_sigma_m);
    Standstill {
        sigma: PerSensor {
            gyro: file.attitude_sigma_arcsec.map(|sigma| sigma.0 * ARCSEC),
            accel: file.velocity_sigma_m_s.map(|sigma| sigma.0),
        },
        turning: turning.map_or(usual.turning, |of| of.0 * DEGREE),
        position_sigma: position.map_or(usual.position_sigma, |of| of.0),
    }
}
