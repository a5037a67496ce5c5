//! Files: runs in, calibrations in and out, what other programs read.
//!
//! A [`crate::run::Run`] read here is in SI, on right-front-up body axes and in normalised outputs (see
//! [`crate::imu::Nominal`]); the files' units and axes end at this door.

mod axes;
mod calibration_file;
mod campaign;
mod clock;
mod course;
mod csv_file;
mod digest;
mod door;
pub mod draft;
pub(crate) mod error;
pub mod export;
mod imu_log;
mod instrument;
mod job;
mod joined;
#[cfg(feature = "certificate")]
mod laboratory;
mod lot_directory;
mod names;
mod parts;
mod quantity;
mod read;
mod rows;
mod schema;
mod segments;
mod sheet;
mod small_file;
mod source;
mod specification;
mod streams;
mod table_log;
mod temperature;
mod uniform;
mod whole;
mod write;

pub use crate::imu::NoiseKeys;
pub use campaign::{Campaign, campaign_text};
pub use digest::{digest_of_bytes, input_digests};
pub use door::Opened;
pub use error::{FileError, Place};
pub use job::{JOB_FILE, Job, JobKind, Part};
pub use lot_directory::{LotDirectory, read_part_unit, unit_key};
pub use parts::{Parts, part_is_there, write_part};
pub(crate) use quantity::unit_scale;
pub(crate) use schema::{
    Document, Finite, Latitude, NonNegative, OneOrThree, Positive, TermFile, day_to_day, term_sigma,
};
pub(crate) use sheet::Sheet;
pub(crate) use whole::write_whole_with;
pub use whole::{WholeDirectory, abandon_unfinished, write_whole};
pub(crate) use write::write_rows;
pub use write::write_run;
