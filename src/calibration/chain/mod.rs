//! The chain of dwells, which combines the information from the parts of dwells with the moves between them.
//!
//! Within a part of a dwell, noise at rest is the only disturbance; [`links`] reduces each part once to rows in its
//! initial states and the constants. Between parts, moves, table positions and varying biases change the states. The
//! parts form a chain of links, which [`forward`] filters with the constants as sensitivity columns (Friedland 1969,
//! "Treatment of bias in recursive filtering", IEEE Trans. Automatic Control 14(4)) and [`backward`] smooths. If the
//! size of an effect changes, the samples need not be processed again.

mod backward;
mod dynamics;
pub mod effects;
mod forward;
mod innovations;
mod links;
pub mod part;
mod short_rows;
pub mod states;
mod without;

pub use backward::{Moments, Smoothed};
pub use effects::{Dispersion, Effect, Sizes, Slip};
pub use forward::{Filtered, Forward};
pub use links::{Chain, Link, Rows, Transition};
pub use states::States;

#[cfg(test)]
mod tests;
