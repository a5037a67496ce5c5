//! The fields of `run.toml`.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

use super::values::{
    Angle, Finite, Gravity, Height, Latitude, Longitude, Milligals, Names, NonNegative, OneOrThree,
    Positive,
};
use crate::formats::clock::TimeUnit;
use crate::formats::imu_log::TimeStamp;
use crate::formats::inputs::temperature::TemperatureUnit;
use crate::imu::{AxisOrder, Output, Sensor};

/// The version of the format.
pub const FORMAT: &str = "turncal-run/1";

/// Fields of `[meta]`.
pub const META: [&str; 8] = [
    "instrument",
    "serial",
    "operator",
    "date",
    "temperature_degc",
    "laboratory",
    "table",
    "notes",
];

/// A run: log of an instrument, prior knowledge, and motion
#[derive(Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct RunFile {
    #[serde(default)]
    pub site: SiteFile,
    #[serde(default)]
    pub meta: BTreeMap<String, String>,
    pub imu: ImuFile,
    #[serde(default)]
    pub standstill: StandstillFile,
    pub turntable: Option<TurntableFile>,
    pub segments: Option<SegmentsFile>,
}

#[derive(Default, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SiteFile {
    pub latitude_deg: Option<Latitude>,
    pub longitude_deg: Option<Longitude>,
    pub height_m: Option<Height>,
    /// Its digits define its accuracy if none is stated.
    #[cfg_attr(feature = "cli", schemars(with = "Option<Gravity>"))]
    pub gravity_m_s2: Option<Spanned<Gravity>>,
    pub gravity_sigma_mgal: Option<Milligals>,
}

#[derive(Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ImuFile {
    pub file: String,
    pub stream: Option<String>,
    pub salvage: Option<bool>,
    pub accel_from: Option<AccelFromFile>,
    pub output: Output,
    pub gyro_unit: Option<String>,
    pub accel_unit: Option<String>,
    pub gyro_full_scale: Option<Positive>,
    pub accel_full_scale: Option<Positive>,
    pub time_unit: Option<TimeUnit>,
    pub sample_period_s: Option<Positive>,
    pub time_stamp: TimeStamp,
    pub continuous: Option<bool>,
    pub instance: Option<InstanceFile>,
    pub temperature_unit: Option<TemperatureUnit>,
    pub body_axes: Option<AxisOrder>,
    pub columns: ImuColumns,
    /// By the names of [`crate::imu::NoiseKeys`].
    #[serde(default)]
    pub noise: BTreeMap<String, NonNegative>,
    #[serde(default)]
    pub prior: PriorsFile,
    /// By the names of error terms.
    #[serde(default)]
    pub terms: BTreeMap<String, TermFile>,
}

/// Settings of a triad in `[imu]`.
pub struct TriadFields<'a> {
    pub columns: Option<&'a Names<3>>,
    pub unit: Option<&'a str>,
    pub full_scale: Option<f64>,
    pub prior: &'a PriorFile,
}

impl ImuFile {
    pub fn of(&self, sensor: Sensor) -> TriadFields<'_> {
        let (columns, prior) = (&self.columns, &self.prior);
        let full_scale = sensor.pick(self.gyro_full_scale, self.accel_full_scale);
        TriadFields {
            columns: sensor.pick(&columns.gyro, &columns.accel).as_ref(),
            unit: sensor.pick(&self.gyro_unit, &self.accel_unit).as_deref(),
            full_scale: full_scale.map(|of| of.0),
            prior: sensor.pick(&prior.gyro, &prior.accel),
        }
    }
}

/// Defaults are those of `[imu]`.
#[derive(Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct AccelFromFile {
    pub file: Option<String>,
    pub stream: Option<String>,
    pub salvage: Option<bool>,
    pub time: Option<TimeColumn>,
    pub time_unit: Option<TimeUnit>,
    pub sample_period_s: Option<Positive>,
}

/// The column that distinguishes instruments, and its value for the selected one.
#[derive(Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct InstanceFile {
    pub column: String,
    pub number: Finite,
}

#[derive(Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ImuColumns {
    pub time: Option<TimeColumn>,
    pub gyro: Option<Names<3>>,
    pub accel: Option<Names<3>>,
    pub temperature: Option<TemperatureColumn>,
}

#[derive(Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "a column name, or the names of the seconds and nanoseconds columns"
)]
pub enum TimeColumn {
    One(String),
    SecondsAndNanoseconds([String; 2]),
}

#[derive(Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "a column name, or `gyro` and `accel` with one or three column names each"
)]
pub enum TemperatureColumn {
    One(String),
    Triads {
        gyro: OneOrThree<String>,
        accel: OneOrThree<String>,
    },
}

#[derive(Default, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct PriorsFile {
    pub gyro: PriorFile,
    pub accel: PriorFile,
}

#[derive(Default, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PriorFile {
    pub scale: Option<OneOrThree>,
    pub scale_sigma_ppm: Option<OneOrThree>,
    pub installation_sigma_arcsec: Option<OneOrThree>,
    pub bias: Option<OneOrThree>,
    pub bias_sigma: Option<OneOrThree>,
}

/// 1σ of each parameter of an error term, around zero.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TermFile {
    pub sigma: Positive,
}

#[derive(Default, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct StandstillFile {
    pub velocity_sigma_m_s: Option<Positive>,
    pub attitude_sigma_arcsec: Option<Positive>,
    pub turning_deg_per_sqrt_s: Option<NonNegative>,
    pub position_sigma_m: Option<Positive>,
}

#[derive(Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TurntableFile {
    pub file: String,
    pub stream: Option<String>,
    pub salvage: Option<bool>,
    pub time_unit: Option<TimeUnit>,
    pub sample_period_s: Option<Positive>,
    pub columns: TableColumns,
    pub axes: Option<Vec<String>>,
    pub position_sigma_arcsec: Angle,
    pub reading_sigma_arcsec: Angle,
    pub level_sigma_arcsec: Option<Angle>,
    pub north_sigma_arcsec: Option<Angle>,
    pub nonorthogonality_sigma_arcsec: Option<Angle>,
    pub wobble_sigma_arcsec: Option<Angle>,
    pub encoder_sigma_arcsec: Option<Angle>,
    pub time_sigma_ms: Option<Positive>,
}

/// Keys of axis errors, in the order of [`crate::turntable::AxisError::ALL`].
pub const AXIS_ERRORS: [&str; 3] = [
    "nonorthogonality_sigma_arcsec",
    "wobble_sigma_arcsec",
    "encoder_sigma_arcsec",
];

impl TurntableFile {
    /// 1σ of axis errors, in the same order.
    pub fn axis_errors(&self) -> [Option<Angle>; 3] {
        [
            self.nonorthogonality_sigma_arcsec,
            self.wobble_sigma_arcsec,
            self.encoder_sigma_arcsec,
        ]
    }
}

/// A quaternion `[w, x, y, z]`, or angles about axes, outermost first, or both.
#[derive(Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TableColumns {
    pub time: TimeColumn,
    pub quaternion: Option<Names<4>>,
    pub angles: Option<Vec<String>>,
    pub axes: Option<Vec<String>>,
}

#[derive(Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SegmentsFile {
    pub file: String,
    pub position_sigma_deg: Option<Positive>,
}

/// The JSON schema of `run.toml`, for completion and checks in editors.
#[cfg(feature = "cli")]
pub fn json_schema() -> serde_json::Value {
    let mut schema = schemars::schema_for!(RunFile);
    let format = serde_json::json!({ "const": FORMAT });
    if let Some(fields) = schema
        .get_mut("properties")
        .and_then(|of| of.as_object_mut())
    {
        fields.insert("format".to_owned(), format);
    }
    schema.to_value()
}
