//! Studies: what many simulated runs say.

pub mod accuracy;
pub mod experiment;
pub mod navigation;
mod ratio;

pub use accuracy::{Accuracy, AccuracyStudy, GroupAccuracy};
pub use experiment::{Experiment, ExperimentStudy};
pub use ratio::Ratio;
