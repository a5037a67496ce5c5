//! The fields of `run.toml`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize, Serializer};

use super::words::{BodyAxes, Names, TemperatureUnit, TimeStamp, TimeUnitField};
use turncal::imu::{AxisOrder, Output, Sensor};
use turncal::models::TermFile;
use turncal::turntable::AxisError;
use turncal_input::{
    Angle, Finite, Gravity, Height, Latitude, Longitude, Milligals, NonNegative, OneOrThree,
    Positive,
};

/// The version of the file format.
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

/// A recording of an instrument on a turntable or turned by hand
#[derive(Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunFile {
    /// Place of the recording
    #[serde(default)]
    pub site: SiteFile,
    /// Strings, numbers or dates that are copied into the result: instrument, serial, operator, date, temperature_degc,
    /// laboratory, table, notes
    #[serde(default)]
    pub meta: BTreeMap<String, String>,
    /// Log of the IMU, its units, noise and prior
    pub imu: ImuFile,
    /// 1σ of the motion in dwells
    #[serde(default)]
    pub standstill: StandstillFile,
    /// Log of the turntable
    pub turntable: Option<TurntableFile>,
    /// Labelled sections of the recording
    pub segments: Option<SegmentsFile>,
}

#[derive(Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SiteFile {
    /// Latitude, degrees, north positive; required with a turntable. Default: Earth rate is estimated
    pub latitude_deg: Option<Latitude>,
    /// Longitude, degrees; default 0
    pub longitude_deg: Option<Longitude>,
    /// Height above the ellipsoid, m; default 0 ± 500
    pub height_m: Option<Height>,
    /// Measured gravity, m/s²; if gravity_sigma_mgal is omitted, its σ follows from the last digit. Default: normal
    /// gravity
    pub gravity_m_s2: Option<Gravity>,
    /// 1σ of gravity, mGal
    pub gravity_sigma_mgal: Option<Milligals>,
}

#[derive(Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImuFile {
    /// Log of the IMU; the path is relative to this file
    pub file: String,
    /// Stream that contains the gyros, in a file with several streams
    pub stream: Option<String>,
    /// Accelerometers that are not in the rows of the gyros
    pub accel_from: Option<AccelFromFile>,
    /// Magnetometer that is not in the rows of the gyros
    pub mag_from: Option<AccelFromFile>,
    /// Use a damaged log up to the damaged part; default: false
    pub salvage: Option<bool>,
    /// Quantity in a row: number of whole counts in the sample (pulse), integral over the sample (increment) or mean
    /// over the sample (rate)
    pub output: Output,
    /// Unit of the gyros: count; for increments rad, deg, arcsec; for rates rad/s, deg/s, mdps, deg/h
    pub gyro_unit: Option<String>,
    /// Unit of the accelerometers: count; for increments m/s, g*s; for rates m/s^2, g, mg
    pub accel_unit: Option<String>,
    /// Unit of the magnetometer: uT, nT, mT, T, G, mG or count
    pub mag_unit: Option<String>,
    /// End of the range of the gyros, in the unit of a row; samples with this value are saturated
    pub gyro_full_scale: Option<Positive>,
    /// End of the range of the accelerometers, in the unit of a row; samples with this value are saturated
    pub accel_full_scale: Option<Positive>,
    /// Unit of the time column: s (default), ms, us, ns, the duration of a tick in s, or count for a sample counter
    pub time_unit: Option<TimeUnitField>,
    /// Time from row to row, s; default: from the time stamps
    pub sample_period_s: Option<Positive>,
    /// 1σ of the sample period, ppm; default: 10000 for rates with neither a time column nor a [turntable], 0 in all
    /// other cases
    pub sample_period_sigma_ppm: Option<NonNegative>,
    /// Whether a stamp marks the end, the start or the middle of its sample
    pub time_stamp: TimeStamp,
    /// False if the file contains concatenated sections; default: true
    pub continuous: Option<bool>,
    /// Unit of the temperature columns: degC (default), K or degF
    pub temperature_unit: Option<TemperatureUnit>,
    /// Axes of the log: rfu right-front-up (default), frd or flu
    pub body_axes: Option<BodyAxes>,
    /// Use only the rows of one of several instruments
    pub instance: Option<InstanceFile>,
    /// Names or numbers of the columns; a minus sign before a name reverses the sign of the column
    pub columns: ImuColumns,
    /// Noise figures by name, such as angle_random_walk_deg_per_sqrt_h
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, NonNegative>")]
    pub noise: BTreeMap<String, Option<NonNegative>>,
    /// Prior knowledge of the triads, before the calibration
    #[serde(default)]
    pub prior: PriorsFile,
    /// Error terms to estimate, by name, such as time-offset; sigma = 0 states that the instrument does not have the
    /// term
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
    /// Axis order from the axes of the log to right, front, up.
    pub fn axes(&self) -> AxisOrder {
        self.body_axes.map_or(AxisOrder::IDENTITY, BodyAxes::order)
    }

    /// Whether the log has a magnetometer, but neither gyros nor accelerometers.
    pub fn is_of_magnetometer(&self) -> bool {
        let ImuColumns {
            gyro, accel, mag, ..
        } = &self.columns;
        mag.is_some() && gyro.is_none() && accel.is_none()
    }

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
#[derive(Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AccelFromFile {
    /// Log of the sensor; default: that of the gyros
    pub file: Option<String>,
    /// Stream that contains the sensor
    pub stream: Option<String>,
    /// Use a damaged log up to the damaged part
    pub salvage: Option<bool>,
    /// Time column of the sensor
    pub time: Option<TimeColumn>,
    /// Unit of the time column of the sensor
    pub time_unit: Option<TimeUnitField>,
    /// Time from row to row, s
    pub sample_period_s: Option<Positive>,
}

/// The column that distinguishes the instruments, and its value for the selected instrument.
#[derive(Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InstanceFile {
    /// Column that distinguishes the instruments
    pub column: String,
    /// Number of the instrument to use
    #[serde(serialize_with = "whole")]
    pub number: Finite,
}

/// Writes a whole number without decimals.
fn whole<S: Serializer>(number: &Finite, serializer: S) -> Result<S::Ok, S::Error> {
    let whole = number.0 as i64;
    if whole as f64 == number.0 {
        serializer.serialize_i64(whole)
    } else {
        number.serialize(serializer)
    }
}

#[derive(Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImuColumns {
    /// Time column; optional if the period is known
    pub time: Option<TimeColumn>,
    /// Three gyro columns, in the order of body_axes
    pub gyro: Option<Names<3>>,
    /// Three accelerometer columns, in the order of body_axes
    pub accel: Option<Names<3>>,
    /// Three magnetometer columns, in any order
    pub mag: Option<Names<3>>,
    /// Temperature column of the instrument, or one or three for each triad
    pub temperature: Option<TemperatureColumn>,
}

#[derive(Serialize, Deserialize, schemars::JsonSchema)]
#[serde(
    untagged,
    expecting = "a column name, or the names of the seconds and nanoseconds columns"
)]
pub enum TimeColumn {
    One(String),
    SecondsAndNanoseconds([String; 2]),
}

#[derive(Serialize, Deserialize, schemars::JsonSchema)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "a column name, or `gyro` and `accel` with one or three column names each"
)]
pub enum TemperatureColumn {
    One(String),
    Triads {
        /// Temperature column of the gyros, or one for each gyro
        gyro: OneOrThree<String>,
        /// Temperature column of the accelerometers, or one for each accelerometer
        accel: OneOrThree<String>,
    },
}

#[derive(Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PriorsFile {
    /// Prior of the gyros
    pub gyro: PriorFile,
    /// Prior of the accelerometers
    pub accel: PriorFile,
}

#[derive(Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PriorFile {
    /// Nominal scale factor: output per second for 1 rad/s or 1 m/s²; optional if the unit implies it
    pub scale: Option<OneOrThree>,
    /// 1σ of the scale factor, ppm; default: 50 000
    pub scale_sigma_ppm: Option<OneOrThree>,
    /// 1σ of each misalignment, ″; default: 7200
    pub installation_sigma_arcsec: Option<OneOrThree>,
    /// Expected bias, in output per second; default: 0
    pub bias: Option<OneOrThree>,
    /// 1σ of the bias, in output per second; default: 2 °/s or 1 m/s²
    pub bias_sigma: Option<OneOrThree>,
}

#[derive(Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StandstillFile {
    /// 1σ of the velocity in a dwell (white), m/s; default: estimated from the dwells
    pub velocity_sigma_m_s: Option<Positive>,
    /// 1σ of the attitude in a dwell without a table (white), ″; default: estimated from the dwells
    pub attitude_sigma_arcsec: Option<Positive>,
    /// Random walk of the attitude in a dwell without a table, °/√s
    pub turning_deg_per_sqrt_s: Option<NonNegative>,
    /// 1σ of the distance of the IMU from the table centre, m; default: 1
    pub position_sigma_m: Option<Positive>,
}

#[derive(Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TurntableFile {
    /// Log of the turntable; the path is relative to this file
    pub file: String,
    /// Stream that contains the attitude, in a file with several streams
    pub stream: Option<String>,
    /// Use a damaged log up to the damaged part; default: false
    pub salvage: Option<bool>,
    /// Unit of the time column
    pub time_unit: Option<TimeUnitField>,
    /// Time from row to row, s
    pub sample_period_s: Option<Positive>,
    /// Columns of time and attitude
    pub columns: TableColumns,
    /// Axis of each angle when all angles are zero, such as z, x, y
    pub axes: Option<Vec<String>>,
    /// 1σ per axis of the position error, ″: constant in a dwell, independent between positions
    pub position_sigma_arcsec: Angle,
    /// 1σ per axis of the white error of each reading, ″
    pub reading_sigma_arcsec: Angle,
    /// 1σ per axis of the error of a reading just after a stop, ″; the error fades within a second
    pub settling_sigma_arcsec: Option<Angle>,
    /// 1σ of the tilt of the table base, ″; if it is stated, the tilt is estimated
    pub level_sigma_arcsec: Option<Angle>,
    /// 1σ of the azimuth of the table base, ″; if it is stated, the azimuth is estimated
    pub north_sigma_arcsec: Option<Angle>,
    /// 1σ of the tilt of each inner axis, ″; needs angles
    pub nonorthogonality_sigma_arcsec: Option<Angle>,
    /// 1σ of the wobble of each axis, once and twice per turn, ″; needs angles
    pub wobble_sigma_arcsec: Option<Angle>,
    /// 1σ of the error of each encoder, once and twice per turn, ″; needs angles
    pub encoder_sigma_arcsec: Option<Angle>,
    /// No effect, because readings taken while the table turns are not used
    pub time_sigma_ms: Option<Positive>,
}

impl TurntableFile {
    /// Errors of the table axes, with the keys and the 1σ of each.
    pub fn axis_errors(&self) -> [(AxisError, &'static str, Option<Angle>); 3] {
        let nonorthogonality = self.nonorthogonality_sigma_arcsec;
        let (wobble, encoder) = (self.wobble_sigma_arcsec, self.encoder_sigma_arcsec);
        [
            (
                AxisError::Tilt,
                "nonorthogonality_sigma_arcsec",
                nonorthogonality,
            ),
            (AxisError::Wobble, "wobble_sigma_arcsec", wobble),
            (AxisError::Encoder, "encoder_sigma_arcsec", encoder),
        ]
    }
}

/// A quaternion `[w, x, y, z]`, or the angles about the table axes, outermost axis first, or both.
#[derive(Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TableColumns {
    /// Time column
    pub time: TimeColumn,
    /// Quaternion w, x, y, z, from body to East-North-Up
    pub quaternion: Option<Names<4>>,
    /// Axis angles, degrees, outermost first
    pub angles: Option<Vec<String>>,
    /// Axis of each angle, as in the field axes of the turntable
    pub axes: Option<Vec<String>>,
}

#[derive(Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SegmentsFile {
    /// CSV file with the start, end and label of each section; the path is relative to this file
    pub file: String,
    /// 1σ per axis of a position set by hand, degrees; default: 1
    pub position_sigma_deg: Option<Positive>,
}

/// The JSON schema of `run.toml`, for completion and checks in editors.
pub fn json_schema() -> serde_json::Value {
    let mut schema = schemars::schema_for!(RunFile);
    let format =
        serde_json::json!({ "const": FORMAT, "description": "Name and version of the format" });
    if let Some(fields) = schema
        .get_mut("properties")
        .and_then(|of| of.as_object_mut())
    {
        fields.insert("format".to_owned(), format);
    }
    schema.to_value()
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    /// Names of the fields without a description.
    fn undescribed(schema: &Value) -> Vec<String> {
        let fields = schema["properties"].as_object().into_iter().flatten();
        let bare = fields.filter(|(_, of)| of["description"].is_null());
        let mut names: Vec<String> = bare.map(|(name, _)| name.clone()).collect();
        let parts: Vec<&Value> = match schema {
            Value::Object(of) => of.values().collect(),
            Value::Array(of) => of.iter().collect(),
            _ => Vec::new(),
        };
        names.extend(parts.into_iter().flat_map(undescribed));
        names
    }

    #[test]
    fn the_schema_describes_every_field() {
        assert_eq!(undescribed(&super::json_schema()), Vec::<String>::new());
    }
}
