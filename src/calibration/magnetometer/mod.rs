//! The magnetometer in the chain of dwells: prior, start, rows and estimate.

mod estimate;
mod prior;
mod rows;
mod start;
#[cfg(test)]
mod tests;

pub use estimate::MagneticEstimate;
pub use prior::MagneticPrior;
pub use rows::MagneticRows;
pub use start::with_magnetometer;
