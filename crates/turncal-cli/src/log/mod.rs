//! Commands that analyse a log.

pub mod allan;
pub mod check;
pub mod convert;
pub mod init;
pub mod noise;
