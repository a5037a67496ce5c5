//! A simulation scenario, read from a TOML file.

use nalgebra::{SVector, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::magnetometer::MagnetometerFile;
use super::{Chamber, Integrator, MagnetometerModel};
use crate::calibration::ErrorTerm;
use crate::calibration::model::{USUAL_LEVEL, USUAL_NORTH, usual_axis_error, usual_variation};
use crate::earth::Site;
use crate::imu::BodyFrame;
use crate::imu::{ANGLES, InstallationForm, Output, PerSensor, Sensor, TermVector, Triad};
use crate::models::{self, InstallationModel, Instrument, ModelError, Place, Room};
use crate::turntable::{Imperfection, Motion, Path, Table, TableError};
use crate::units::{ARCSEC, DEG_PER_H, DEGREE, MICRO_G, PPM};
use turncal_input::{Finite, Latitude, NonNegative, OneOrThree, Positive};

/// Temperature at which instruments match their model, °C.
const ROOM_TEMPERATURE: f64 = 25.0;
/// Steps of the true motion per IMU sample.
const STEPS: u32 = 4;
/// The longest simulated recording, which takes several gigabytes of memory.
const MOST_SAMPLES: f64 = 2e7;

/// Complete definition of a simulated run, except its random numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scenario {
    /// A short name for titles and file names.
    pub name: String,
    /// Site of the table.
    pub site: Site,
    /// The grade of instrument.
    pub instrument: Instrument,
    /// Misalignment form, with the distribution of its angles.
    pub installation: InstallationModel,
    /// The true body frame: in the accelerometer frame, the misalignment angles that this frame fixes are not drawn.
    pub body_frame: BodyFrame,
    /// True values that are stated instead of being drawn at random.
    pub given: PerSensor<Given>,
    /// The table.
    pub table: Table,
    /// The table's name.
    pub table_name: String,
    /// Path of the table.
    pub path: Path,
    /// The path's name.
    pub path_name: String,
    /// Quantity of a sample.
    pub output: Output,
    /// Sample period, lever arm and integration step of the truth.
    pub integrator: Integrator,
    /// Readings of the table per second.
    pub reading_rate: f64,
    /// The climatic chamber in which the instrument is; `None` for a constant temperature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chamber: Option<Chamber>,
    /// The magnetometer of the instrument, and the field at the site; `None` without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub magnetometer: Option<MagnetometerModel>,
    /// Default seed.
    pub seed: u64,
}

/// True values of a triad that a scenario states; other values are drawn at random. The prior is still the prior for
/// the grade.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Given {
    /// Scale factors − 1.
    pub scale: Option<Vector3<f64>>,
    /// Misalignment angles, rad.
    pub angles: Option<SVector<f64, ANGLES>>,
    /// Biases, rad/s or m/s².
    pub bias: Option<Vector3<f64>>,
}

impl Scenario {
    /// Finds and reads a scenario, by embedded name or path, and the models that it refers to.
    ///
    /// # Errors
    /// Returns an error if one of the files does not exist or is malformed, or the files are not consistent.
    pub fn load(name_or_path: &str) -> Result<Self, ModelError> {
        let text = models::text(Room::Scenario, name_or_path, &Place::CommandLine)?;
        let file: ScenarioFile = text.parse()?;
        let site = file.site.in_si();
        let installation = InstallationModel::load(&file.imu.installation, &text.place)?;
        let (table, table_name) = models::turntable(&file.turntable.model, &text.place)?;
        let (path, path_name) = models::path(&file.turntable.path, &text.place, &site)?;
        let scenario = Self {
            name: text.name(),
            site,
            instrument: Instrument::load(&file.imu.model, &text.place)?,
            installation,
            body_frame: BodyFrame::Table,
            given: file
                .truth
                .in_si(installation.form)
                .map_err(|message| text.inconsistent(message))?,
            table,
            table_name,
            path,
            path_name,
            output: file.imu.output,
            integrator: Integrator {
                period: 1.0 / file.imu.sample_rate_hz.0,
                lever_arm: Vector3::from(file.imu.lever_arm_m.map(|component| component.0)),
                steps: STEPS,
            },
            reading_rate: file.turntable.reading_rate_hz.0,
            chamber: file
                .chamber
                .map(ChamberFile::in_si)
                .transpose()
                .map_err(|message| text.inconsistent(message))?,
            magnetometer: file
                .magnetometer
                .map(|magnetometer| magnetometer.in_si(&site))
                .transpose()
                .map_err(|message| text.inconsistent(message))?,
            seed: file.seed,
        };
        scenario
            .check()
            .map_err(|message| text.inconsistent(message))?;
        Ok(scenario)
    }

    /// A copy with a different path, given by embedded name or file.
    ///
    /// # Errors
    /// Returns an error if the path does not exist, is malformed, or does not fit the table.
    pub fn with_path(self, name_or_path: &str) -> Result<Self, ModelError> {
        let (path, name) = models::path(name_or_path, &Place::CommandLine, &self.site)?;
        let along = self.along(path, &name);
        along.map_err(|message| models::inconsistent(name_or_path, message))
    }

    /// A copy along a path of this name.
    ///
    /// # Errors
    /// A message if the path does not fit the table or needs too many samples.
    pub fn along(self, path: Path, path_name: &str) -> Result<Self, String> {
        let scenario = Self {
            path,
            path_name: path_name.to_owned(),
            ..self
        };
        scenario.check()?;
        Ok(scenario)
    }

    /// A copy with an error term, which has the typical magnitude unless the models state one.
    pub fn with_error_term(mut self, block: ErrorTerm) -> Self {
        match block {
            ErrorTerm::GaussMarkovBias => {
                let noise = &mut self.instrument.noise;
                for noise in [&mut noise.gyro, &mut noise.accel] {
                    noise.gauss_markov.get_or_insert(usual_variation(noise));
                }
            }
            ErrorTerm::TableBase => {
                let errors = &mut self.table.errors;
                if errors.level == 0.0 && errors.north == 0.0 {
                    (errors.level, errors.north) = (USUAL_LEVEL, USUAL_NORTH);
                }
            }
            ErrorTerm::TableAxes(kind) => {
                let errors = &mut self.table.errors;
                if errors.of_axes(kind) == 0.0 {
                    *errors.of_axes_mut(kind) = usual_axis_error(kind, errors.position);
                }
            }
            ErrorTerm::Instrument(term) => {
                self.instrument.absent_terms.retain(|&of| of != term);
                for parameter in term.parameters() {
                    let sigma = &mut self.instrument.term_sigma[parameter];
                    if *sigma == 0.0 {
                        *sigma = term.usual_sigma();
                    }
                }
            }
        }
        self
    }

    /// Whether the runs of the scenario include an error term.
    pub fn has(&self, block: ErrorTerm) -> bool {
        let sees_table = self.body_frame == BodyFrame::Table;
        let errors = &self.table.errors;
        match block {
            ErrorTerm::GaussMarkovBias => {
                let varies = |sensor| self.instrument.noise.get(sensor).gauss_markov.is_some();
                Sensor::ALL.into_iter().any(varies)
            }
            ErrorTerm::TableBase => sees_table && errors.level.max(errors.north) > 0.0,
            ErrorTerm::TableAxes(kind) => sees_table && errors.of_axes(kind) > 0.0,
            ErrorTerm::Instrument(term) => {
                let sigma = &self.instrument.term_sigma;
                term.parameters().any(|k| sigma[k] > 0.0)
            }
        }
    }

    /// Reference temperature, at which the instrument has its drawn parameters, °C.
    pub fn reference_temperature(&self) -> f64 {
        ROOM_TEMPERATURE
    }

    /// Motion of a perfect table along the path.
    ///
    /// # Errors
    /// Returns an error if the table cannot follow the path.
    pub fn motion(&self) -> Result<Motion, TableError> {
        Motion::new(&self.table, &self.path, &Imperfection::none(&self.table))
    }

    /// Duration of a run, s.
    ///
    /// # Errors
    /// Returns an error if the table cannot follow the path.
    pub fn duration(&self) -> Result<f64, TableError> {
        Ok(self.motion()?.duration())
    }

    /// Total time of the dwells in a run, s.
    ///
    /// # Errors
    /// Returns an error if the table cannot follow the path.
    pub fn standing_time(&self) -> Result<f64, TableError> {
        let motion = self.motion()?;
        Ok(motion.dwells().map(|(start, end)| end - start).sum())
    }

    /// Makes checks that would otherwise fail only during simulation.
    fn check(&self) -> Result<(), String> {
        // The check uses the errors of a real table, so that a path that does not support them is found here.
        let real = Imperfection::draw(&self.table, || 1.0);
        let motion = Motion::new(&self.table, &self.path, &real)
            .map_err(|error| format!("path {}: {error}", self.path_name))?;
        let duration = motion.duration();
        for (what, rate) in [
            ("samples", 1.0 / self.integrator.period),
            ("readings", self.reading_rate),
        ] {
            let number = duration * rate;
            if !(2.0..=MOST_SAMPLES).contains(&number) {
                return Err(format!(
                    "{duration:.1} s of path {} at {rate} Hz require {number:.3e} {what}, expected 2 to \
                     {MOST_SAMPLES:.0e}",
                    self.path_name
                ));
            }
        }
        Ok(())
    }

    /// The true parameters of error terms.
    pub(super) fn draw_terms(&self, rng: &mut ChaCha8Rng) -> TermVector {
        self.instrument.term_sigma.map(|sigma| {
            let unit: f64 = StandardNormal.sample(rng);
            sigma * unit
        })
    }

    /// One triad's true parameters.
    pub(super) fn draw_truth(&self, sensor: Sensor, rng: &mut ChaCha8Rng) -> Triad {
        let variation = self.instrument.variation.get(sensor);
        // All values are drawn, stated or not, so that stating one does not change the others.
        let scale = Vector3::from_fn(|_, _| variation.scale.draw(rng));
        let bias = Vector3::from_fn(|_, _| variation.bias.draw(rng));
        let angles = self.installation.draw(rng);
        let given = self.given.get(sensor);
        let mut triad = Triad {
            form: self.installation.form,
            scale: given.scale.unwrap_or(scale).add_scalar(1.0),
            angles: given.angles.unwrap_or(angles),
            bias: given.bias.unwrap_or(bias),
        };
        if (self.body_frame, sensor) == (BodyFrame::Accelerometer, Sensor::Accel) {
            triad = triad.along_body_axes();
        }
        triad
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScenarioFile {
    seed: u64,
    site: SiteFile,
    imu: ImuFile,
    turntable: TurntableFile,
    #[serde(default)]
    truth: TruthFile,
    chamber: Option<ChamberFile>,
    magnetometer: Option<MagnetometerFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SiteFile {
    latitude_deg: Latitude,
    #[serde(default)]
    longitude_deg: Finite,
    #[serde(default)]
    height_m: Finite,
    gravity_m_s2: Option<Positive>,
}

impl SiteFile {
    fn in_si(&self) -> Site {
        let site = Site::with_normal_gravity(
            self.latitude_deg.0 * DEGREE,
            self.longitude_deg.0 * DEGREE,
            self.height_m.0,
        );
        // The simulated properties are known.
        site.with_gravity(self.gravity_m_s2.map_or(site.gravity, |g| g.0), 0.0)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ImuFile {
    model: String,
    installation: String,
    output: Output,
    sample_rate_hz: Positive,
    #[serde(default)]
    lever_arm_m: [Finite; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TurntableFile {
    model: String,
    path: String,
    #[serde(default = "ten_hertz")]
    reading_rate_hz: Positive,
}

fn ten_hertz() -> Positive {
    Positive(10.0)
}

/// A climatic chamber.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChamberFile {
    /// Time in s and temperature in °C.
    profile: Vec<(Finite, Finite)>,
    #[serde(default)]
    time_constant_s: NonNegative,
    #[serde(default)]
    sensor_noise_k: NonNegative,
}

impl ChamberFile {
    pub fn in_si(self) -> Result<Chamber, String> {
        let profile: Vec<(f64, f64)> = self.profile.iter().map(|(t, v)| (t.0, v.0)).collect();
        if profile.is_empty() || !profile.is_sorted_by(|a, b| a.0 < b.0) {
            return Err("profile: expected at least one [time in s, temperature in °C], in increasing order of time"
                .to_owned());
        }
        if let Some((_, value)) = profile.iter().find(|(_, value)| value.abs() > 150.0) {
            return Err(format!(
                "profile: found {value} °C, expected a chamber temperature within ±150 °C"
            ));
        }
        Ok(Chamber {
            profile,
            time_constant: self.time_constant_s.0,
            sensor_noise: self.sensor_noise_k.0,
        })
    }
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct TruthFile {
    gyro: GivenFile,
    accel: GivenFile,
}

/// The unit of the biases is that of the triad.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct GivenFile {
    scale_ppm: Option<OneOrThree>,
    installation_arcsec: Option<Vec<Finite>>,
    bias_deg_per_h: Option<OneOrThree>,
    bias_ug: Option<OneOrThree>,
}

impl TruthFile {
    fn in_si(self, form: InstallationForm) -> Result<PerSensor<Given>, String> {
        if self.gyro.bias_ug.is_some() || self.accel.bias_deg_per_h.is_some() {
            return Err(
                "expected bias_deg_per_h in [truth.gyro] and bias_ug in [truth.accel]".to_owned(),
            );
        }
        PerSensor::try_from_fn(|sensor| {
            let file = sensor.pick(&self.gyro, &self.accel);
            let bias = scaled(&file.bias_deg_per_h, DEG_PER_H);
            Ok(Given {
                scale: scaled(&file.scale_ppm, PPM),
                angles: angles(file.installation_arcsec.as_deref(), form)?,
                bias: bias.or_else(|| scaled(&file.bias_ug, MICRO_G)),
            })
        })
    }
}

fn scaled(values: &Option<OneOrThree>, unit: f64) -> Option<Vector3<f64>> {
    values.as_ref().map(|values| values.vector() * unit)
}

fn angles(
    given: Option<&[Finite]>,
    form: InstallationForm,
) -> Result<Option<SVector<f64, ANGLES>>, String> {
    let Some(given) = given else { return Ok(None) };
    let expected = form.angle_names().len();
    if given.len() != expected {
        return Err(format!(
            "installation_arcsec has {} values, expected the {expected} of the {} form",
            given.len(),
            form.name()
        ));
    }
    let mut angles = SVector::<f64, ANGLES>::zeros();
    for (angle, value) in angles.iter_mut().zip(given) {
        *angle = value.0 * ARCSEC;
    }
    Ok(Some(angles))
}

#[cfg(test)]
mod tests;
