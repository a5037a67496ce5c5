//! Sources of noise: stated sizes, and sizes estimated from a recording.

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
