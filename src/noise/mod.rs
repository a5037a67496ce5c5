//! Noise of an instrument at rest: Allan variance, the processes that cause it, and the conventions for noise figures.
//!
//! Variances are two-sample (Allan) variances of the rate at a cluster time τ, in (rad/s)² or (m/s²)²,
//! from the integrals of the output over each sample. Two-sided conventions: white noise of strength N has the
//! two-sided power spectral density N², and its integral over t has the variance `N² t`.

mod allan;
mod analysis;
mod at_rest;
mod clusters;
pub mod conventions;
mod fit;
mod identify;
mod process;
mod quiet;
mod search;
#[cfg(test)]
mod tests;
mod triad;

pub use allan::Curve;
pub use analysis::{NoiseAnalysis, Stretch, StretchError};
pub use at_rest::{RestNoise, curves_at_rest};
pub use clusters::Clusters;
pub use conventions::normalised;
pub use identify::{Found, Hidden, Identified, of_kind};
pub use process::Process;
pub use quiet::white_noise;
pub use triad::{AxisNoise, NoiseFigures, TriadNoise};
