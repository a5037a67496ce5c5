//! Noise of a standing instrument: Allan variance, the processes behind it, and the conventions in which
//! noise figures are stated.
//!
//! Variances are two-sample (Allan) variances of the rate at a cluster time τ, in (rad/s)² or (m/s²)²,
//! from the integrals of the output over each sample. Two-sided conventions: white noise of strength N
//! has the two-sided power spectral density N², and its integral over t the variance `N² t`.

pub mod allan;
mod analysis;
mod at_rest;
pub mod conventions;
mod covariance;
mod fit;
mod identify;
mod process;
mod standing;

pub use analysis::{AxisNoise, NoiseAnalysis, NoiseFigures, TriadNoise};
pub use at_rest::RestNoise;
pub use identify::{Clusters, Found, Hidden, Identified, of_kind};
pub use process::Process;
pub use standing::{Stretch, StretchError};
