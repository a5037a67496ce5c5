//! Commands that use or show a calibration.

pub mod apply;
pub mod certificate;
pub mod compare;
pub mod explain;
pub mod export;
pub mod navigate;
pub mod show;
