//! Values that are checked while they are read, so that errors can give the line.

use std::ops::RangeInclusive;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize, Serializer};

use crate::units::MILLIGAL;

/// Possible values of gravity at these heights, m/s².
pub const GRAVITIES: RangeInclusive<f64> = 9.7..=9.9;

/// Heights from the shore of the Dead Sea to above any laboratory, m.
pub const HEIGHTS: RangeInclusive<f64> = -500.0..=9000.0;

/// Squares and quotients of numbers within these limits are finite.
fn with_size(value: f64) -> Result<f64, &'static str> {
    match value {
        _ if !value.is_finite() => Err("a finite number"),
        _ if value == 0.0 || (1e-30..=1e30).contains(&value.abs()) => Ok(value),
        _ => Err("a number with a magnitude from 1e-30 to 1e30"),
    }
}

/// A number; as text if a file cannot contain it, so that reading refuses it.
fn number<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    if value.is_finite() {
        serializer.serialize_f64(*value)
    } else {
        serializer.collect_str(value)
    }
}

macro_rules! checked {
    ($($(#[$meta:meta])* $name:ident, $says:literal, $holds:expr;)+) => {$(
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
        #[derive(schemars::JsonSchema)]
        #[serde(try_from = "f64")]
        pub struct $name(#[serde(serialize_with = "number")] pub f64);

        impl TryFrom<f64> for $name {
            type Error = &'static str;

            fn try_from(value: f64) -> Result<Self, Self::Error> {
                let holds: fn(f64) -> bool = $holds;
                if holds(with_size(value)?) { Ok(Self(value)) } else { Err($says) }
            }
        }
    )+};
}

checked!(
    /// Any number.
    #[derive(Default)]
    Finite, "a finite number", |_| true;
    /// A number above zero.
    Positive, "a number above zero", |v| v > 0.0;
    /// A number of at least zero.
    #[derive(Default)]
    NonNegative, "a number of at least zero", |v| v >= 0.0;
    /// 1σ of an angle, ″, at most half a turn.
    Angle, "a number above zero and at most 648000", |v| v > 0.0 && v <= 648_000.0;
    /// Latitude, °.
    Latitude, "a latitude from -90 to 90", |v| v.abs() <= 90.0;
    /// Longitude, °.
    Longitude, "a longitude from -180 to 360", |v| (-180.0..=360.0).contains(&v);
    /// Height above the ellipsoid, m.
    Height, "a height from -500 to 9000", |v| HEIGHTS.contains(&v);
    /// Gravity, m/s².
    Gravity, "a number from 9.7 to 9.9", |v| GRAVITIES.contains(&v);
    /// 1σ of gravity, mGal.
    Milligals, "a number from 0 to 100000", |v| (0.0..=1e5).contains(&v);
    /// A plausible instrument temperature, °C.
    Celsius, "a number from -100 to 100", |v| v.abs() <= 100.0;
);

/// 1σ of a gravity that is stated without σ, m/s²: derived from its last digit, at least one milligal.
pub fn stated_gravity_sigma(written: &str) -> f64 {
    let digits = written
        .split_once('.')
        .map_or(0, |(_, digits)| digits.len());
    let last = 10f64.powi(-i32::try_from(digits).unwrap_or(i32::MAX));
    MILLIGAL.max(last / 12f64.sqrt())
}

/// One value per axis, or one for all three.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(untagged, expecting = "three numbers, or one for all axes")]
pub enum OneOrThree<T = Finite> {
    /// One value for all axes.
    One(T),
    /// Values for x, y and z.
    Three([T; 3]),
}

impl From<Vector3<f64>> for OneOrThree {
    fn from(values: Vector3<f64>) -> Self {
        match <[f64; 3]>::from(values) {
            [x, y, z] if x == y && y == z => Self::One(Finite(x)),
            values => Self::Three(values.map(Finite)),
        }
    }
}

impl OneOrThree {
    /// The values of the three axes.
    pub fn vector(self) -> Vector3<f64> {
        match self {
            Self::One(value) => Vector3::repeat(value.0),
            Self::Three(values) => Vector3::from(values.map(|value| value.0)),
        }
    }
}
