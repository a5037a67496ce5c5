//! A calibration as a file: `calibration.json` and `truth.json`.
//!
//! Values are in the file's quantity (see [`crate::imu::Nominal`]): `N = scale ⊙ (installation · u)
//! + bias`, with `u` in rad/s or m/s² along right-front-up.

mod check;

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::error::{Place, RunError};
use super::whole::write_whole;
use crate::imu::{InstallationForm, PerSensor};

/// The version of the format.
pub const FORMAT: &str = "turncal-calibration/1";

/// The equation of a record.
pub const EQUATION: &str = "N = scale * (installation * u) + bias; u = correction * (N - bias)";

/// The equation of a record with further terms of the instrument.
pub const EQUATION_WITH_TERMS: &str = "N = scale * (installation * (u + t)) + bias; u = correction * (N - bias) - t; t: what terms add \
     to u, zero in test_vectors";

/// A calibration with its accuracy and how it was reached, or a known truth.
///
/// Only the two triads are always there. Unknown fields are ignored when reading.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationRecord {
    /// Always [`FORMAT`].
    pub format: String,
    /// How it was found; none for a truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<Method>,
    /// How angles make the installation matrix.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub installation_form: Option<InstallationForm>,
    /// What the filter observed; none for a method without filter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aiding: Option<Aiding>,
    /// What fixes the body axes.
    #[serde(default)]
    pub body_frame: BodyFrame,
    /// The gyros.
    pub gyro: TriadRecord,
    /// The accelerometers.
    pub accel: TriadRecord,
    /// The file's quantity, such as `count`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<PerSensor<String>>,
    /// 1σ of every value, zero where fixed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma: Option<PerSensor<TriadRecord>>,
    /// Names of the estimated parameters, such as `gyro.installation.xy`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parameters: Vec<String>,
    /// Covariance of the estimated parameters, in their units.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub covariance: Vec<Vec<f64>>,
    /// Parameters of further terms, such as `accel.second_order.x`, in SI, and errors of the table,
    /// such as `table.base.up`, in rad, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub terms: BTreeMap<String, TermRecord>,
    /// Number of passes over the record.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub passes: Option<usize>,
    /// Whether the last pass moved nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub converged: Option<bool>,
    /// Whether the innovations agree with their covariance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub consistency: Option<ConsistencyRecord>,
    /// What it leaves of gravity and turns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quality: Option<QualityRecord>,
    /// What blocks of states beside the triads' parameters did, or would do.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<BlockRecord>,
    /// Independent directions of the parameters, the least observed first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub observability: Vec<DirectionRecord>,
    /// What must be known before using the values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Names of parameters that were not estimated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fixed: Vec<String>,
    /// The model in words, [`EQUATION`] or [`EQUATION_WITH_TERMS`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub equation: Option<String>,
    /// The matrix of `u = correction (N − bias)`, ready to use.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correction: Option<PerSensor<[[f64; 3]; 3]>>,
    /// Raw outputs with what they are calibrated, to check a user's own code.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub test_vectors: Vec<TestVector>,
    /// `[meta]` of the run.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub meta: BTreeMap<String, String>,
}

/// A constant beside the parameters of the triads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TermRecord {
    /// Its value, in SI.
    pub value: f64,
    /// 1σ; none for a truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
}

/// How a calibration was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Extended Kalman filter.
    Ekf,
    /// Closed form from static positions.
    SixPosition,
}

/// What the filter observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Aiding {
    /// Standstill and the table's attitude.
    Table,
    /// Standstill only.
    Velocity,
}

/// What fixes the body axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BodyFrame {
    /// The mounting face, of the table or of labelled positions.
    #[default]
    Table,
    /// Accelerometer x along body x, accelerometer y in the xy plane.
    Accelerometer,
}

impl BodyFrame {
    /// In a few words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Table => "mounting face",
            Self::Accelerometer => {
                "x along accelerometer x, y in the plane of accelerometers x and y"
            }
        }
    }
}

/// Values of one triad.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TriadRecord {
    /// The file's quantity per second for one rad/s or m/s².
    pub scale: [f64; 3],
    /// Row by row, pure numbers.
    pub installation: [[f64; 3]; 3],
    /// The file's quantity per second.
    pub bias: [f64; 3],
}

/// Normalised innovation squared of all observations, and of each kind apart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ConsistencyRecord {
    /// Of all observations.
    #[serde(flatten)]
    pub all: NisRecord,
    /// Of zero velocity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<NisRecord>,
    /// Of the table's attitude.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<NisRecord>,
}

/// Mean of normalised innovations squared with its 95 % interval; one if σ are true.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NisRecord {
    /// Mean per scalar observation.
    pub nis: f64,
    /// 95 % interval (χ²).
    pub nis_interval: [f64; 2],
}

/// What a calibration leaves of what is known without a truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct QualityRecord {
    /// Over the whole record.
    pub all: MeasuresRecord,
    /// In dwells whose observations a calibration did without, and over the turns that end in them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out: Option<MeasuresRecord>,
}

/// Departures from gravity and from known turns.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MeasuresRecord {
    /// Size of specific force at rest less gravity.
    pub gravity_m_s2: SpreadRecord,
    /// Angle between up as gyros carry it over a turn and as accelerometers see it after.
    pub direction_rad: SpreadRecord,
    /// Angle between a turn as gyros see it and as table or label say.
    pub turns_rad: SpreadRecord,
}

/// Several departures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SpreadRecord {
    /// How many; the rest is zero if none.
    pub count: usize,
    /// Root mean square.
    pub rms: f64,
    /// The largest.
    pub largest: f64,
}

/// A block of states against the same run without it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BlockRecord {
    /// Its name, such as `accel-second-order`.
    pub block: String,
    /// Whether it was on; if not, it was tried with its usual σ.
    pub on: bool,
    /// σ with the block over σ without it, of gyro K, E, D and accel K, E, D; none where there is
    /// no σ.
    pub sigma_factors: [Option<f64>; 6],
    /// By how much the merit, −2 ln of likelihood and prior, falls with the block.
    pub merit_gain: f64,
    /// What that stays below in 9999 runs of 10000 where the block's errors are not there.
    pub merit_gain_limit: f64,
    /// Whether it is more, so that the data ask for the block.
    pub asked_for: bool,
    /// NIS of all observations without it …
    pub nis_without: f64,
    /// … and with it.
    pub nis_with: f64,
}

/// A combination of parameters, each in units of its prior σ, and how well a run observed it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DirectionRecord {
    /// Posterior over prior σ.
    pub remaining: f64,
    /// In words, such as `gyro scale z with gyro bias z`.
    pub words: String,
    /// Name and component of the parameters that make up most of it; squares of all sum to one.
    pub parts: BTreeMap<String, f64>,
}

/// A raw output of both triads and what it becomes, gyro first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TestVector {
    /// `N`, in the file's quantity per second.
    pub raw: [f64; 6],
    /// `u`, in rad/s and m/s².
    pub calibrated: [f64; 6],
}

impl CalibrationRecord {
    /// A record of the two triads and nothing else, as a truth is.
    pub fn new(gyro: TriadRecord, accel: TriadRecord) -> Self {
        Self {
            format: FORMAT.to_owned(),
            method: None,
            installation_form: None,
            aiding: None,
            body_frame: BodyFrame::default(),
            gyro,
            accel,
            unit: None,
            sigma: None,
            parameters: Vec::new(),
            covariance: Vec::new(),
            terms: BTreeMap::new(),
            passes: None,
            converged: None,
            consistency: None,
            quality: None,
            blocks: Vec::new(),
            observability: Vec::new(),
            warnings: Vec::new(),
            fixed: Vec::new(),
            equation: None,
            correction: None,
            test_vectors: Vec::new(),
            meta: BTreeMap::new(),
        }
    }

    /// Reads and checks a record.
    pub fn read(path: &Path) -> Result<Self, RunError> {
        let bytes = std::fs::read(path).map_err(|error| {
            RunError::io(
                path,
                "read the calibration",
                &error,
                "Give the path of a calibration.json or truth.json.",
            )
        })?;
        let record: Self = serde_json::from_slice(&bytes).map_err(|error| {
            let place = Place::Character {
                line: error.line() as u64,
                column: error.column() as u64,
            };
            let at = format!(" at line {} column {}", error.line(), error.column());
            let what = error.to_string().replace(&at, "");
            RunError {
                file: path.to_owned(),
                place,
                message: format!(
                    "not a calibration in the format {FORMAT}: {what}. Correct the file or write it \
                     again."
                ),
            }
        })?;
        record.check(path)?;
        Ok(record)
    }

    /// The record as the bytes of its file, `path` being named in errors.
    pub fn to_json(&self, path: &Path) -> Result<Vec<u8>, RunError> {
        self.check(path)?;
        let mut bytes = serde_json::to_vec_pretty(self).map_err(|error| {
            RunError::new(
                path,
                Place::File,
                error,
                "values that JSON can hold",
                "Nothing was written.",
            )
        })?;
        bytes.push(b'\n');
        Ok(bytes)
    }

    /// Writes the record whole or not at all; an existing file only with `force`.
    pub fn write(&self, path: &Path, force: bool) -> Result<(), RunError> {
        write_whole(path, &self.to_json(path)?, force)
    }
}
