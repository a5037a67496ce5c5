//! Fields whose values are words.

use serde::{Deserialize, Serialize};

use turncal::imu::AxisOrder;
use turncal_input::Positive;
use turncal_logs::clock::TimeUnit;

/// Axes of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BodyAxes {
    Rfu,
    Frd,
    Flu,
}

impl BodyAxes {
    /// Axis order from these axes to right, front, up.
    pub fn order(self) -> AxisOrder {
        match self {
            Self::Rfu => AxisOrder::IDENTITY,
            Self::Frd => AxisOrder::FRONT_RIGHT_DOWN,
            Self::Flu => AxisOrder::FRONT_LEFT_UP,
        }
    }
}

/// The part of a sample that its time stamp marks.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum TimeStamp {
    #[default]
    End,
    Start,
    Middle,
}

impl TimeStamp {
    /// Time from the start of a sample to its stamp, in samples.
    pub fn lag(self) -> f64 {
        match self {
            Self::Start => 0.0,
            Self::Middle => 0.5,
            Self::End => 1.0,
        }
    }
}

/// Unit of a temperature column.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema,
)]
pub enum TemperatureUnit {
    #[default]
    #[serde(rename = "degC")]
    Celsius,
    #[serde(rename = "K")]
    Kelvin,
    #[serde(rename = "degF")]
    Fahrenheit,
}

impl TemperatureUnit {
    /// A temperature in °C.
    pub fn celsius(self, value: f64) -> f64 {
        match self {
            Self::Celsius => value,
            Self::Kelvin => value - 273.15,
            Self::Fahrenheit => (value - 32.0) * (5.0 / 9.0),
        }
    }
}

/// A unit of time by name, or the duration of a clock tick, s.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(untagged, expecting = "a unit of time, or the duration of a tick in s")]
pub enum TimeUnitField {
    Tick(Positive),
    Named(String),
}

impl TimeUnitField {
    /// Parses the name of a unit of time in a file.
    pub fn of_text(text: &str) -> Self {
        match text.parse() {
            Ok(tick) => Self::Tick(Positive(tick)),
            Err(_) => Self::Named(text.to_owned()),
        }
    }

    /// The unit.
    ///
    /// # Errors The name, if it is not one of [`TimeUnit::WORDS`].
    pub fn unit(&self) -> Result<TimeUnit, &str> {
        let name = match self {
            Self::Tick(tick) => return Ok(TimeUnit::PerSecond(tick.0.recip())),
            Self::Named(name) => name,
        };
        let known = TimeUnit::WORDS.iter().find(|(word, _)| word == name);
        known.map(|&(_, unit)| unit).ok_or(name)
    }
}

/// A fixed number of column names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(try_from = "Vec<String>", into = "Vec<String>")]
#[schemars(with = "Vec<String>")]
pub struct Names<const N: usize>(pub [String; N]);

impl<const N: usize> From<Names<N>> for Vec<String> {
    fn from(names: Names<N>) -> Self {
        names.0.into()
    }
}

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
