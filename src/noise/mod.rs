pub mod allan;
mod covariance;
mod fit;
pub mod identify;
mod process;
pub use process::Process;
