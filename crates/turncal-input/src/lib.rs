//! Functions that all readers share: errors with file, line and field; TOML documents; checked numbers; units.
//!
//! If a reader finds something other than it expects, a [`FileError`] gives what was found, what was expected, what to
//! do, and where. [`Document`] gives these errors for TOML files, [`small_file`] reads a whole file up to a maximum
//! size, and the checked numbers ([`Positive`], [`Latitude`] …) refuse values that cannot be right.

mod checked;
mod document;
mod error;
pub mod names;
mod sensor;
pub mod small_file;
pub mod units;

pub use checked::{
    Angle, Celsius, Finite, GRAVITIES, Gravity, HEIGHTS, Height, Latitude, Longitude, Milligals,
    NonNegative, OneOrThree, Positive, stated_gravity_sigma,
};
pub use document::Document;
pub use error::{FileError, Place, choice, counted, excerpt, list, nearest, suggestion};
pub use names::FileColumn;
pub use sensor::{PerSensor, Sensor};
