//! Fields whose values are words.

use serde::{Deserialize, Serialize};

use super::Positive;
use crate::formats::clock::TimeUnit;
use crate::imu::AxisOrder;

/// Axes of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum BodyAxes {
    Rfu,
    Frd,
    Flu,
}

impl BodyAxes {
    /// From these axes to right, front, up.
    pub fn order(self) -> AxisOrder {
        match self {
            Self::Rfu => AxisOrder::IDENTITY,
            Self::Frd => AxisOrder::FRONT_RIGHT_DOWN,
            Self::Flu => AxisOrder::FRONT_LEFT_UP,
        }
    }
}

/// A unit of time by name, or the duration of a clock tick, s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "`s`, `ms`, `us`, `ns`, `count`, or the duration of a tick in s"
)]
pub enum TimeUnitField {
    Named(TimeUnitName),
    Tick(Positive),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum TimeUnitName {
    S,
    Ms,
    Us,
    Ns,
    Count,
}

impl From<TimeUnitField> for TimeUnit {
    fn from(field: TimeUnitField) -> Self {
        let name = match field {
            TimeUnitField::Tick(tick) => return Self::PerSecond(tick.0.recip()),
            TimeUnitField::Named(name) => name,
        };
        match name {
            TimeUnitName::S => Self::PerSecond(1.0),
            TimeUnitName::Ms => Self::PerSecond(1e3),
            TimeUnitName::Us => Self::PerSecond(1e6),
            TimeUnitName::Ns => Self::PerSecond(1e9),
            TimeUnitName::Count => Self::Count,
        }
    }
}

/// This number of column names.
#[derive(Debug, Clone, PartialEq, Deserialize)]
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn axes_are_right_handed_and_in_the_order_of_their_letters() {
        for axes in [BodyAxes::Rfu, BodyAxes::Frd, BodyAxes::Flu] {
            let word = toml::Value::try_from(axes).unwrap();
            assert!(axes.order().is_rotation(), "{word}");
            for (letter, axis) in word.as_str().unwrap().chars().zip(0..) {
                let expected = match letter {
                    'r' => Vector3::x(),
                    'f' => Vector3::y(),
                    'u' => Vector3::z(),
                    'l' => -Vector3::x(),
                    _ => -Vector3::z(),
                };
                let along = axes.order().apply(&Vector3::ith(axis, 1.0));
                assert_eq!(along, expected, "{word}: {letter}");
            }
        }
    }
}
