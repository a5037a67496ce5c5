//! A calibration as a file: `calibration.json` and `truth.json`.
//!
//! Values are in the file's quantity per second (see [`crate::imu::Nominal`]): `N = scale ⊙ (installation · u) + bias`,
//! with `u` in rad/s or m/s² along the right, front and up axes.

pub(super) mod at_temperature;
pub(super) mod correction;
pub mod frame;
pub(super) mod magnetic;
pub mod nees;
pub(super) mod record;
pub(super) mod thermal_record;

use std::collections::BTreeMap;
use std::ops::Index;

use nalgebra::{Matrix3, Vector3};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize};

use super::budget::BudgetRecord;
use super::noise::NoiseReport;
use crate::calibration::result::thermal_record::{RecordingRecord, ThermalRecord};
use crate::calibration::{Direction, Finding, Quality, Verdict, Word};
use crate::imu::{AXES, BodyFrame, InstallationForm, Nominal, Output, PerSensor, Sensor, Triad};
use crate::run::Aiding;
pub use magnetic::{EllipsoidRecord, FieldRecord, MagRecord, MagSigma};

/// The version of the file format.
pub const FORMAT: &str = "turncal-calibration/1";
/// The version of the file format with temperature dependence.
pub const FORMAT_WITH_TEMPERATURE: &str = "turncal-calibration/2";

/// The equation of a record.
pub const EQUATION: &str = "N = scale * (installation * u) + bias; u = correction * (N - bias)";

/// The equation of a record with error terms of the instrument.
pub const EQUATION_WITH_TERMS: &str = "N = scale * (installation * (u + t)) + bias; u = correction * (N - bias) - t; \
                                       t: contribution of the error terms to u, zero in test_vectors";

/// A calibration with its accuracy and origin, or a known truth.
///
/// Only the two triads are required. Unknown fields are ignored when reading.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// [`FORMAT`], or [`FORMAT_WITH_TEMPERATURE`].
    pub format: String,
    /// The method of estimation; `None` for a truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<Method>,
    /// Form of the misalignment matrix.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub installation_form: Option<InstallationForm>,
    /// Observations that the filter used; `None` for a method without a filter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aiding: Option<Aiding>,
    /// The body frame.
    #[serde(default)]
    pub body_frame: BodyFrame,
    /// The gyros.
    pub gyro: TriadRecord,
    /// The accelerometers.
    pub accel: TriadRecord,
    /// The magnetometer, if it was calibrated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mag: Option<MagRecord>,
    /// Unit of the file's quantity, such as `count`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<PerSensor<String>>,
    /// Quantity in a row of the file. For rates, N is the row; for increments and pulses, N is the row divided by the
    /// sample period.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub output: Option<Output>,
    /// Columns of the log along x, y and z of each triad, with a minus sign if the sign is reversed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns: Option<PerSensor<[String; 3]>>,
    /// 1σ of every value; zero if the value is fixed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma: Option<PerSensor<TriadRecord>>,
    /// Names of the estimated parameters, such as `gyro.installation.xy`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parameters: Vec<String>,
    /// Covariance of the estimated parameters, in the units of the parameters.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub covariance: Vec<Vec<f64>>,
    /// Uncertainty budget of the parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<BudgetRecord>,
    /// Parameters of error terms (such as `accel.second_order.x`, in SI units) and errors of the table (such as
    /// `table.base.up`, in rad), by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub terms: BTreeMap<String, TermRecord>,
    /// Temperature dependence; the values apply at the reference temperature. `None` if the parameters do not depend on
    /// temperature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<ThermalRecord>,
    /// Results of each recording, if there are several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub recordings: Vec<RecordingRecord>,
    /// Gravity at the site.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity: Option<GravityRecord>,
    /// Number of passes over the recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub passes: Option<usize>,
    /// Whether the filter converged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub converged: Option<bool>,
    /// Whether the innovations agree with their covariance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub consistency: Option<ConsistencyRecord>,
    /// Residuals of gravity and turns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quality: Option<Quality>,
    /// Effects of the error terms, whether enabled or not.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<BlockRecord>,
    /// Independent directions of the parameters, the least observed first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub observability: Vec<Direction>,
    /// The noise that was used; `None` if the file states noise in another form, as some truth files do.
    #[serde(
        default,
        deserialize_with = "if_known",
        skip_serializing_if = "Option::is_none"
    )]
    pub noise: Option<NoiseRecord>,
    /// Whether the values may be used; `None` for values that were not estimated, such as a truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// Cautions for the use of the values.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// The warnings in structured form: kind, text and figures.
    #[serde(default)]
    pub findings: Vec<Finding>,
    /// Names of the parameters that were not estimated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fixed: Vec<String>,
    /// The model in words, [`EQUATION`] or [`EQUATION_WITH_TERMS`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub equation: Option<String>,
    /// The matrix in `u = correction (N − bias)`, ready to use.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correction: Option<PerSensor<[[f64; 3]; 3]>>,
    /// Raw outputs with their calibrated values, with which users can test their own code.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub test_vectors: Vec<TestVector>,
    /// Origin of the calibration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub provenance: Option<Provenance>,
    /// `[meta]` of the run.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub meta: BTreeMap<String, String>,
}

/// Origin of a calibration: data and program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// The program with its version.
    pub program: String,
    /// Every file that was read, with its SHA-256, the run.toml first; empty if none was read.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<InputFile>,
    /// Nominal scales: the file's quantity per second for one rad/s or m/s².
    pub nominal: PerSensor<[f64; 3]>,
    /// Latitude of the site, degrees; `None` if the latitude is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latitude_deg: Option<f64>,
    /// Height of the site, m.
    pub height_m: f64,
    /// Recorded time, s.
    pub duration_s: f64,
    /// Samples per second.
    pub rate_hz: f64,
    /// Number of dwells.
    pub dwells: usize,
}

/// A file that was read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputFile {
    /// Name, as written in run.toml.
    pub name: String,
    /// SHA-256 in hexadecimal digits.
    pub sha256: String,
}

/// The noise that a calibration used.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NoiseRecord {
    /// Noise policy, test of the stated noise, and noise sources.
    #[serde(flatten)]
    pub report: NoiseReport,
    /// The estimated noise as `[imu.noise]`, to be pasted into `run.toml`; `None` if the noise was not estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub run_toml: Option<String>,
}

/// A value of this kind, if any.
fn if_known<'de, T: DeserializeOwned, D: Deserializer<'de>>(
    from: D,
) -> Result<Option<T>, D::Error> {
    let value = serde_json::Value::deserialize(from)?;
    Ok(serde_json::from_value(value).ok())
}

/// An auxiliary constant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TermRecord {
    /// Value, in SI.
    pub value: f64,
    /// 1σ; `None` for a truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
}

/// Gravity at the site of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GravityRecord {
    /// Magnitude.
    pub m_s2: f64,
    /// 1σ of gravity; the scale factors of all three accelerometers share this error.
    pub sigma_m_s2: f64,
}

/// Method of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Extended Kalman filter that uses the whole run
    Ekf,
    /// Closed form from table positions; without a table log, from labelled sections or, if there are none, from
    /// gravity
    SixPosition,
}

/// Values of one triad.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct TriadRecord {
    /// The file's quantity per second for one rad/s or m/s².
    pub scale: [f64; 3],
    /// Row by row, pure numbers.
    pub installation: [[f64; 3]; 3],
    /// The file's quantity per second.
    pub bias: [f64; 3],
}

/// Normalised innovation squared of all observations, and of each kind separately.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ConsistencyRecord {
    /// NIS of all observations.
    #[serde(flatten)]
    pub all: NisRecord,
    /// NIS of zero velocity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<NisRecord>,
    /// NIS of the table attitude.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<NisRecord>,
    /// NIS of the constant attitude at standstill, without a table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attitude: Option<NisRecord>,
}

/// Mean normalised innovation squared with its 95 % interval; the mean is one if the σ are correct.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NisRecord {
    /// Mean over the scalar observations.
    pub nis: f64,
    /// 95 % interval (χ²).
    pub nis_interval: [f64; 2],
}

/// Evidence for an error term.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BlockRecord {
    /// Name, such as `accel-second-order`.
    pub block: String,
    /// Whether the term was stated or requested.
    pub on: bool,
    /// Probability that the term is present.
    #[serde(default)]
    pub present: f64,
    /// Largest remaining part of the typical magnitude of the term, from 0 (known) to 1 (not shown).
    #[serde(default)]
    pub remaining: f64,
    /// σ with the term divided by σ without the term, for gyro K, E, D and accel K, E, D; `None` if there is no σ.
    pub sigma_factors: [Option<f64>; 6],
}

/// A raw output of both triads with its calibrated value, gyro first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TestVector {
    /// `N`, in the file's quantity per second.
    pub raw: [f64; 6],
    /// `u`, in rad/s and m/s².
    pub calibrated: [f64; 6],
}

impl Word {
    /// Name of a column that contains 1 in every row, such as `verdict_good`. The verdict is in the name because
    /// programs that read a table of numbers tolerate neither comments nor text.
    pub fn column(self) -> String {
        let word = self.to_string().to_lowercase();
        format!("verdict_{}", word.replace(' ', "_"))
    }
}

/// `calibration["gyro.bias.x"]`: a parameter by name, in the file's quantity, as [`Calibration::get`].
///
/// # Panics
/// Panics if there is no parameter with that name, as with a map; `get` does not panic.
impl Index<&str> for Calibration {
    type Output = f64;

    fn index(&self, name: &str) -> &f64 {
        match self.get(name) {
            Some(value) => value,
            None => panic!("no parameter `{name}` in this calibration"),
        }
    }
}

impl Calibration {
    /// Whether the values of the calibration must not be used.
    pub fn is_failed(&self) -> bool {
        let stated = self.verdict.as_ref().map(|verdict| verdict.word);
        let words = [stated, Some(Verdict::of(&self.findings).word)];
        words.contains(&Some(Word::Failed)) || self.converged == Some(false)
    }

    /// Verdict; `None` for values that were not estimated, such as a truth.
    pub fn word(&self) -> Option<Word> {
        let stated = self.verdict.as_ref().map(|verdict| verdict.word);
        let failed = self.is_failed().then_some(Word::Failed);
        failed.or(stated)
    }

    /// Names of parameters that were requested but not determined; they keep their prior values and σ.
    pub fn undetermined(&self) -> impl Iterator<Item = &String> {
        let kept = |name: &&String| self.sigma_of(name).is_some_and(|sigma| *sigma > 0.0);
        self.fixed.iter().filter(kept)
    }

    /// A record of the two triads only, such as a truth.
    pub fn new(gyro: TriadRecord, accel: TriadRecord) -> Self {
        Self {
            format: FORMAT.to_owned(),
            gyro,
            accel,
            ..Self::default()
        }
    }

    /// The values of a triad.
    pub fn triad(&self, sensor: Sensor) -> &TriadRecord {
        match sensor {
            Sensor::Gyro => &self.gyro,
            Sensor::Accel => &self.accel,
        }
    }

    /// A parameter by name: `gyro.scale.x` and `gyro.bias.x` in the file's quantity, `gyro.installation.xy` for the
    /// entry of the misalignment matrix in that row and column, and likewise for `accel`; `mag.matrix.xy` and `mag.bias.x`; also parameters of error
    /// terms such as `accel.time_offset`, in SI.
    pub fn get(&self, name: &str) -> Option<&f64> {
        let of_triads = entry(name, |sensor| self.triad(sensor));
        let of_triads = of_triads.or_else(|| self.mag.as_ref()?.get(name));
        of_triads.or_else(|| self.terms.get(name).map(|term| &term.value))
    }

    /// The names of all parameters, estimated or not.
    pub fn names(&self) -> Vec<String> {
        let of_triad = |sensor: Sensor| {
            let scale = AXES.map(|axis| format!("scale.{axis}"));
            let rows = AXES.into_iter();
            let installation = rows.flat_map(|i| AXES.map(|j| format!("installation.{i}{j}")));
            let bias = AXES.map(|axis| format!("bias.{axis}"));
            let all = scale.into_iter().chain(installation).chain(bias);
            all.map(move |name| format!("{}.{name}", sensor.name()))
        };
        let of_triads = Sensor::ALL.into_iter().flat_map(of_triad);
        of_triads.chain(self.terms.keys().cloned()).collect()
    }

    /// 1σ of a parameter by name, zero if it was not estimated; `None` if no σ is stated.
    pub fn sigma_of(&self, name: &str) -> Option<&f64> {
        let sigma = self.sigma.as_ref()?;
        let of_triads = entry(name, |sensor| sigma.get(sensor));
        let of_triads = of_triads.or_else(|| self.mag.as_ref()?.sigma_of(name));
        of_triads.or_else(|| self.terms.get(name)?.sigma.as_ref())
    }
}

/// The entry of that name, such as `gyro.scale.x`, of these triads.
fn entry<'a>(name: &str, triad: impl Fn(Sensor) -> &'a TriadRecord) -> Option<&'a f64> {
    let mut parts = name.splitn(3, '.');
    let (of, kind, axes) = (parts.next()?, parts.next()?, parts.next()?);
    let triad = triad(Sensor::ALL.into_iter().find(|sensor| sensor.name() == of)?);
    let place = |axis: char| AXES.iter().position(|&a| a == axis);
    let axes: Option<Vec<usize>> = axes.chars().map(place).collect();
    match (kind, &axes?[..]) {
        ("scale", &[axis]) => Some(&triad.scale[axis]),
        ("bias", &[axis]) => Some(&triad.bias[axis]),
        ("installation", &[row, column]) => Some(&triad.installation[row][column]),
        _ => None,
    }
}

impl TriadRecord {
    /// A triad in the file's quantity, by nominal scales.
    pub(in crate::calibration) fn new(triad: &Triad, nominal: &Nominal) -> Self {
        Self {
            scale: triad.scale.component_mul(&nominal.0).into(),
            installation: rows(&triad.installation()),
            bias: triad.bias.component_mul(&nominal.0).into(),
        }
    }

    /// `K C`: the file's quantity per second for one rad/s or m/s² along each body axis.
    pub fn sensitivity(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| self.scale[i] * self.installation[i][j])
    }

    /// The triad, normalised by nominal scales and split into the parameters of a form. A calibration may contain any
    /// misalignment matrix, so the split uses `K C`, which is the same in all forms.
    pub fn triad(&self, nominal: &Nominal, form: InstallationForm) -> Triad {
        let sensitivity = self.normalised(nominal);
        let bias = Vector3::from(self.bias).component_div(&nominal.0);
        Triad::from_sensitivity(form, &sensitivity, bias)
    }

    /// `K C` over nominal scales.
    fn normalised(&self, nominal: &Nominal) -> Matrix3<f64> {
        let sensitivity = self.sensitivity();
        Matrix3::from_fn(|i, j| sensitivity[(i, j)] / nominal.0[i])
    }
}

/// A matrix row by row.
pub fn rows(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    m.transpose().data.0
}

/// Both triads of a record, normalised by these nominal scales and split in a form.
pub fn triads_of(
    record: &Calibration,
    nominal: &PerSensor<Nominal>,
    form: InstallationForm,
) -> PerSensor<Triad> {
    PerSensor::from_fn(|sensor| record.triad(sensor).triad(nominal.get(sensor), form))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_have_names() {
        let triad = |k: f64| TriadRecord {
            scale: [k, k + 1.0, k + 2.0],
            installation: [[1.0, k * 1e-3, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            bias: [0.0, 0.0, -k],
        };
        let calibration = Calibration::new(triad(5.0), triad(7.0));
        assert_eq!(calibration["gyro.scale.y"], 6.0);
        assert_eq!(calibration["accel.bias.z"], -7.0);
        assert_eq!(calibration["gyro.installation.xy"], 5e-3);
        for other in [
            "gyro",
            "gyro.scale",
            "gyro.scale.w",
            "gyro.scale.xy",
            "gyro.bias.",
            "x.y.z",
            "",
        ] {
            assert_eq!(calibration.get(other), None, "{other}");
        }
        assert_eq!(calibration.sigma_of("gyro.scale.y"), None);
    }
}
