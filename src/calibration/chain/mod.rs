//! The chain of dwells: information from the parts of dwells, and the moves between them.
//!
//! Within a part of a dwell, only the noise at rest acts; [`links`] reduces each part once to rows in its initial
//! states and the constants. Between parts, the states change through moves, table positions and varying biases: a
//! chain of links, which [`forward`] filters with the constants as sensitivity columns (Friedland 1969, "Treatment of
//! bias in recursive filtering", IEEE Trans. Automatic Control 14(4)) and [`backward`] smooths. Changing the size of an
//! effect needs no new pass over the samples.

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
