//! Noise estimated from a recording, for figures of `run.toml` that the data contradict.
//!
//! A few sources of noise, each with one σ, are estimated by maximum likelihood with the stated values as prior. The
//! filter integrates out parameters, attitudes and table errors, so this is the restricted likelihood
//! (Patterson and Thompson 1971, Biometrika 58(3)): no degree of freedom is lost to them. The estimated noise
//! is stored in the [`super::Model`], so that every later pass uses it.

mod by_hand;
mod factors;
mod fit;
mod learn;
mod likelihood_ratio;
mod policy;
mod report;
mod source;
pub mod variances;

pub use by_hand::{BY_HAND, ByHand, Parts};
pub use fit::LOG_SIGMA;
pub use learn::learn;
pub use policy::NoisePolicy;
pub use report::{NoiseReport, NoiseTest, SourceFigures};
pub use source::Source;

#[cfg(test)]
mod tests;
