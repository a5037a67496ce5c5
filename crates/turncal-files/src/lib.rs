//! Files: input of runs, input and output of calibrations, exports for other programs.
//!
//! A [`turncal::run::Run`] read here is in SI units, along right-front-up body axes and with normalised outputs (see
//! [`turncal::imu::Nominal`]); file units and axes are converted here.

pub mod directories;
mod door;
pub mod draft;
pub mod export;
mod imu_log;
mod inputs;
mod quantity;
mod schema;
mod sheet;

pub(crate) use directories::write_whole_with;
pub use directories::{
    JOB_FILE, Job, JobKind, LotDirectory, Part, Parts, Unfinished, WholeDirectory, digest_of_bytes,
    input_digests, part_is_there, read_part_unit, record_inputs, unit_key, write_part, write_whole,
};
pub use door::{Opened, is_toml};
// Row readers use these names.
use inputs::{course, joined, temperature};
pub(crate) use quantity::unit_scale;
use schema::instrument;
pub use schema::json_schema as run_schema;
pub(crate) use schema::write_rows;
pub use schema::{
    Campaign, LABORATORY_DRAFT, calibration_json, campaign_text, imu_file_of, read_calibration,
    read_laboratory, read_meta, read_run, run_of_text, write_calibration, write_run,
};
pub(crate) use sheet::Sheet;
