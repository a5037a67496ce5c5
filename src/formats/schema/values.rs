//! Values checked while reading, so that errors name their line.

use nalgebra::Vector3;
use serde::Deserialize;
use serde::de::{Deserializer, Error};

use crate::earth::{GRAVITIES, HEIGHTS};
use crate::formats::clock::TimeUnit;
use crate::formats::error::list;
use crate::formats::imu_log::TimeStamp;
use crate::formats::inputs::temperature::TemperatureUnit;
use crate::imu::AxisOrder;

/// Squares and quotients of such numbers are finite.
fn with_size(value: f64) -> Result<f64, &'static str> {
    match value {
        _ if !value.is_finite() => Err("a finite number"),
        _ if value == 0.0 || (1e-30..=1e30).contains(&value.abs()) => Ok(value),
        _ => Err("a number with a magnitude from 1e-30 to 1e30"),
    }
}

macro_rules! checked {
    ($($(#[$meta:meta])* $name:ident, $says:literal, $holds:expr;)+) => {$(
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
        #[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
        #[serde(try_from = "f64")]
        pub struct $name(pub f64);

        impl TryFrom<f64> for $name {
            type Error = &'static str;

            fn try_from(value: f64) -> Result<Self, Self::Error> {
                let holds: fn(f64) -> bool = $holds;
                match holds(with_size(value)?) {
                    true => Ok(Self(value)),
                    false => Err($says),
                }
            }
        }
    )+};
}

checked!(
    /// Any number.
    #[derive(Default)]
    Finite, "a finite number", |_| true;
    /// Above zero.
    Positive, "a number above zero", |v| v > 0.0;
    /// Zero or above.
    #[derive(Default)]
    NonNegative, "a number of at least zero", |v| v >= 0.0;
    /// 1σ of an angle, ″, at most half a turn.
    Angle, "a number above zero and at most 648000", |v| v > 0.0 && v <= 648_000.0;
    /// °
    Latitude, "a latitude from -90 to 90", |v| v.abs() <= 90.0;
    /// °
    Longitude, "a longitude from -180 to 360", |v| (-180.0..=360.0).contains(&v);
    /// m
    Height, "a height from -500 to 9000", |v| HEIGHTS.contains(&v);
    /// m/s²
    Gravity, "a number from 9.7 to 9.9", |v| GRAVITIES.contains(&v);
    /// 1σ of gravity, mGal.
    Milligals, "a number from 0 to 100000", |v| (0.0..=1e5).contains(&v);
    /// A plausible instrument temperature, °C.
    Celsius, "a number from -100 to 100", |v| v.abs() <= 100.0;
);

/// One value per axis, or one for all three.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "three numbers, or one for all axes")]
pub enum OneOrThree<T = Finite> {
    One(T),
    Three([T; 3]),
}

impl OneOrThree {
    pub fn vector(self) -> Vector3<f64> {
        match self {
            Self::One(value) => Vector3::repeat(value.0),
            Self::Three(values) => Vector3::from(values.map(|value| value.0)),
        }
    }
}

/// This number of column names.
#[derive(Clone, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(try_from = "Vec<String>")]
#[cfg_attr(feature = "cli", schemars(with = "Vec<String>"))]
pub struct Names<const N: usize>(pub [String; N]);

impl<const N: usize> TryFrom<Vec<String>> for Names<N> {
    type Error = &'static str;

    fn try_from(names: Vec<String>) -> Result<Self, Self::Error> {
        names.try_into().map(Self).map_err(|_| match N {
            4 => "four columns in the order w, x, y, z",
            _ => "three strings in quotes",
        })
    }
}

/// Types defined by a table of names.
macro_rules! by_words {
    ($($name:ident),+) => {$(
        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                by_word(&Self::WORDS, &String::deserialize(deserializer)?)
            }
        }

        #[cfg(feature = "cli")]
        impl schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
                schemars::json_schema!({ "enum": Self::WORDS.map(|(word, _)| word) })
            }
        }
    )+};
}

by_words!(AxisOrder, TemperatureUnit, TimeStamp);

/// A name, or the duration of a clock tick, s.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a unit of time, or the duration of a tick in s")]
enum TimeUnitFile {
    Tick(Positive),
    Word(String),
}

impl<'de> Deserialize<'de> for TimeUnit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let word = match TimeUnitFile::deserialize(deserializer)? {
            TimeUnitFile::Tick(tick) => return Ok(Self::PerSecond(tick.0.recip())),
            TimeUnitFile::Word(word) => word,
        };
        by_word(&Self::WORDS, &word)
    }
}

#[cfg(feature = "cli")]
impl schemars::JsonSchema for TimeUnit {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "TimeUnit".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let words = Self::WORDS.map(|(word, _)| word);
        schemars::json_schema!({ "anyOf": [{ "enum": words }, { "type": "number", "exclusiveMinimum": 0 }] })
    }
}

fn by_word<T: Copy, E: Error>(words: &[(&str, T)], said: &str) -> Result<T, E> {
    let known = words.iter().find(|(word, _)| *word == said);
    known.map(|&(_, meaning)| meaning).ok_or_else(|| {
        let words = list(words.iter().map(|&(word, _)| word));
        E::custom(format!("unknown variant `{said}`, expected one of {words}"))
    })
}
