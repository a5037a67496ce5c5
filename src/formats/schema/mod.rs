//! What users write: TOML files as serde structs, and errors that name line, column and field.

mod document;
mod run;
mod values;

pub(crate) use super::campaign::day_to_day;
pub(crate) use super::instrument::term_sigma;
pub use document::Document;
pub use run::*;
pub use values::{
    Angle, Celsius, Finite, Gravity, Height, Latitude, Longitude, NonNegative, OneOrThree, Positive,
};
