//! Noise learnt from a record: what `run.toml` states, unless the data contradict it.
//!
//! A few sources of noise, each with one σ, are found by maximum likelihood around what is stated. The
//! filter integrates parameters, attitudes and table errors out, so this is the restricted likelihood
//! (Patterson and Thompson 1971, Biometrika 58(3)): no degree of freedom is lost to them. What is learnt
//! is in the [`super::Model`], so that every later pass has it.

mod by_hand;
mod factors;
mod fit;
mod learn;
mod likelihood_ratio;
mod policy;
mod report;
mod run_toml;
mod source;

pub use by_hand::{BY_HAND, ByHand, Parts};
pub use fit::LOG_SIGMA;
pub use learn::learn;
pub use policy::NoisePolicy;
pub use report::{NoiseReport, NoiseTest, SourceFigures};
pub use source::Source;

#[cfg(test)]
mod tests;
