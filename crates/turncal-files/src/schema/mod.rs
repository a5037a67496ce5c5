//! Files that users write or read: fields of TOML and JSON files as serde structs, whose errors give line, column and
//! field.

mod calibration_file;
mod campaign;
pub mod instrument;
mod laboratory;
pub mod page;
mod read;
mod run;
mod words;
mod write;

pub use calibration_file::{calibration_json, read_calibration, write_calibration};
pub use campaign::{Campaign, campaign_text};
pub use laboratory::{LABORATORY_DRAFT, read_laboratory};
pub use read::{imu_file_of, read_meta, read_run, run_of_text};
pub use run::*;
pub use words::{BodyAxes, Names, TemperatureUnit, TimeStamp, TimeUnitField};
pub use write::{write_rows, write_run};
