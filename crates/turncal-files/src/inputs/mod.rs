//! The files named in a `run.toml`: their sources and contents.

pub mod course;
pub mod joined;
pub mod magnetometer;
pub mod segments;
pub mod source;
pub mod table_log;
pub mod temperature;
