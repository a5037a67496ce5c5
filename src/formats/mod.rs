//! Files: input of runs, input and output of calibrations, exports for other programs.
//!
//! A [`crate::run::Run`] read here is in SI, on right-front-up body axes and in normalised outputs (see
//! [`crate::imu::Nominal`]); file units and axes are converted here.

mod clock;
mod csv_file;
mod data_file;
mod directories;
mod door;
pub mod draft;
pub(crate) mod error;
pub mod export;
mod imu_log;
mod inputs;
mod names;
mod quantity;
mod rows;
mod schema;
mod sheet;
mod small_file;
mod source;
mod streams;
mod table;

pub use crate::imu::NoiseKeys;
pub use data_file::DataFile;
pub(crate) use directories::write_whole_with;
pub use directories::{
    JOB_FILE, Job, JobKind, LotDirectory, Part, Parts, Unfinished, WholeDirectory, digest_of_bytes,
    input_digests, part_is_there, read_part_unit, record_inputs, unit_key, write_part, write_whole,
};
pub use door::{Opened, is_toml};
pub use error::{FileError, Place};
// By these names the readers of rows know them.
use inputs::{course, joined, temperature};
pub(crate) use quantity::unit_scale;
pub use rows::FileColumn;
use schema::instrument;
#[cfg(feature = "cli")]
pub use schema::json_schema as run_schema;
#[cfg(feature = "certificate")]
pub use schema::read_laboratory;
pub use schema::{Campaign, campaign_text, write_run};
pub(crate) use schema::{
    Document, Finite, Latitude, NonNegative, OneOrThree, Positive, write_rows,
};
pub(crate) use sheet::Sheet;
pub use table::Table;
