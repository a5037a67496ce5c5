//! The chain of dwells: what the parts of dwells say, what moves do between them, and the sizes of all effects.
//!
//! Within a part of a dwell the noise at rest alone acts; [`links`] reduces each part once to rows of what it begins
//! with and of the constants. Between parts the states go on through moves, table positions, and biases that vary: a
//! chain of links, which [`forward`] filters with the constants as columns (Friedland 1969, "Treatment of bias in
//! recursive filtering", IEEE Trans. Automatic Control 14(4)) and [`backward`] smooths. A trial of the sizes of effects
//! touches no sample.

mod at_rest;
mod averages;
mod backward;
mod descent;
mod dynamics;
mod effects;
mod estimate;
mod forward;
mod links;
mod part;
mod sizes;
mod states;
mod usual;

use effects::{Effect, Sizes, Slip};
use links::Chain;

#[cfg(test)]
mod tests;
