//! The magnetometer in the chain of dwells: prior, start, rows and estimate.

mod alone;
mod estimate;
mod homogeneous;
mod prior;
mod start;
#[cfg(test)]
mod tests;

pub use alone::{Alone, AtRest, Ellipsoid, PARTS, Up, ellipsoid};
pub use estimate::{MagneticEstimate, MagneticMatrix};
pub use prior::MagneticPrior;
pub use start::with_magnetometer;
