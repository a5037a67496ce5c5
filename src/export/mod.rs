//! What other programs read: calibrated samples, and calibrations in their own formats.

mod samples;

pub use samples::{HEADER, sample_rows, write_samples};
