//! The files that a `run.toml` names: where their rows come from, and what is read from them.

pub mod course;
pub mod joined;
pub mod segments;
pub mod source;
pub mod table_log;
pub mod temperature;
