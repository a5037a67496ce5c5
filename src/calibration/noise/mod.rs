//! Sources of noise, what is stated of them and what a recording shows.

mod by_hand;
mod likelihood_ratio;
mod policy;
mod report;
mod source;
pub mod variances;

pub use by_hand::{BY_HAND, ByHand, Parts};
pub use likelihood_ratio::INTERVAL;
pub use policy::NoisePolicy;
pub use report::{NAMED, NoiseReport, NoiseTest, SourceFigures};
pub use source::Source;
