//! Studies: what many simulated runs say.

pub mod accuracy;
pub mod navigation;
mod ratio;

pub use accuracy::{Accuracy, AccuracyStudy, GroupAccuracy};
pub use ratio::Ratio;
