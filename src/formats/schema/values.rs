//! Values checked while reading, so that errors name their line.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::earth::{GRAVITIES, HEIGHTS};

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
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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
