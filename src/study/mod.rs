//! Studies: statistics over many simulated runs.

pub mod accuracy;
pub mod campaign;
pub mod experiment;
pub mod navigation;
pub mod path;
mod ratio;
mod shard;
pub mod table1;

pub use accuracy::{Accuracy, AccuracyStudy, Figures, GroupAccuracy, NavigationAccuracy};
pub use campaign::{CampaignAccuracy, CampaignStudy};
pub use experiment::{Experiment, ExperimentStudy};
pub use ratio::Ratio;
pub use shard::{Shard, ShardError};
pub use table1::{Table1, Table1Study};
