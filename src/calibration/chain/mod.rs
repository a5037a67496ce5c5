//! The chain of dwells: information from the parts of dwells, and the moves between them.
//!
//! Within a part of a dwell the noise at rest alone acts; [`links`] reduces each part once to rows of what it begins
//! with and of the constants. Between parts the states go on through moves, table positions, and biases that vary: a
//! chain of links, which [`forward`] filters with the constants as columns (Friedland 1969, "Treatment of bias in
//! recursive filtering", IEEE Trans. Automatic Control 14(4)) and [`backward`] smooths. Another size of an effect
//! touches no sample.

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
pub use forward::Filtered;
pub use links::Chain;

#[cfg(test)]
mod tests;
