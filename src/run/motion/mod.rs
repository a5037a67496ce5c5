//! Motion of the instrument in a recording, from nominal scales and prior biases: dwells, turns, and their agreement
//! with labels. The checks of a recording and the estimators share this module.

mod label;
mod rest;
mod turn;

pub use label::{LabelCheck, Verdict, checks};
pub use rest::{Rest, Up, rests};
pub use turn::{Turn, turns};
