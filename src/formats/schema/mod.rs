//! Files written by users and for users: fields of TOML and JSON files as serde structs, with errors that name line,
//! column and field.

mod calibration_file;
mod campaign;
mod document;
pub mod instrument;
#[cfg(feature = "certificate")]
mod laboratory;
pub mod page;
mod read;
mod run;
mod specification;
mod values;
mod words;
mod write;

pub use campaign::{Campaign, campaign_text};
pub use document::Document;
#[cfg(feature = "certificate")]
pub use laboratory::read_laboratory;
pub use run::*;
pub use values::{
    Angle, Celsius, Finite, Gravity, Height, Latitude, NonNegative, OneOrThree, Positive,
    stated_gravity_sigma,
};
pub use words::{BodyAxes, Names, TemperatureUnit, TimeStamp, TimeUnitField};
pub use write::{write_rows, write_run};
