//! Result directories: of a single result (which is either complete or absent), of a lot, and of a job and its parts.

mod digest;
mod job;
mod lot_directory;
mod parts;
mod provenance;
mod whole;

pub use digest::{digest_of_bytes, input_digests};
pub use job::{JOB_FILE, Job, JobKind, Part};
pub use lot_directory::{LotDirectory, read_part_unit, unit_key};
pub use parts::{Parts, part_is_there, write_part};
pub use provenance::record_inputs;
pub use whole::{Unfinished, WholeDirectory, write_whole, write_whole_with};
