//! Options common to several commands: inputs, estimation, output.

mod calibration;
mod choice;
mod delivery;
mod error_term;
mod estimation;
mod log;
mod sharding;
mod values;
mod with;

pub use calibration::{of_triads, usable};
pub use choice::{AIDINGS, FORMS, NOISE, REQUIRED, export_format, one_of};
pub use delivery::{Delivery, Overwrite, keep};
pub use error_term::{error_term, needs_table};
pub use estimation::Estimation;
pub use log::{OfLog, run_file, run_or_log, show_found};
pub use sharding::Sharding;
pub use values::{
    at_least_two, gravity, height, hours, latitude, number, positive, seconds, seed, shard,
};
pub use with::{With, with_value};
