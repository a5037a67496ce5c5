//! Numbers that are checked where they are read, so that the error names their line.

use nalgebra::Vector3;
use serde::Deserialize;

macro_rules! checked {
    ($(#[$meta:meta])* $name:ident, $says:literal, $holds:expr) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
        #[serde(try_from = "f64")]
        pub(crate) struct $name(pub f64);

        impl TryFrom<f64> for $name {
            type Error = String;

            fn try_from(value: f64) -> Result<Self, String> {
                let holds: fn(f64) -> bool = $holds;
                if holds(value) {
                    Ok(Self(value))
                } else {
                    Err(format!(concat!("found {}, expected ", $says), value))
                }
            }
        }
    };
}

checked!(
    #[derive(Default)]
    /// Any number but infinity and NaN.
    Finite,
    "a finite number",
    f64::is_finite
);
checked!(
    /// Above zero.
    Positive,
    "a number above zero",
    |v| v.is_finite() && v > 0.0
);
checked!(
    #[derive(Default)]
    /// Zero or above.
    NonNegative,
    "zero or a number above",
    |v| v.is_finite() && v >= 0.0
);

/// Three values, or one for all three axes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged, expecting = "expected one number or three")]
pub(crate) enum OneOrThree {
    One(Finite),
    Three([Finite; 3]),
}

impl OneOrThree {
    pub(crate) fn vector(self) -> Vector3<f64> {
        match self {
            Self::One(value) => Vector3::repeat(value.0),
            Self::Three(values) => Vector3::from(values.map(|value| value.0)),
        }
    }
}
