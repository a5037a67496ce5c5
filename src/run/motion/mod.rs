//! What the instrument does in a record, by nominal scales and prior biases: where it rests, how it turns,
//! and whether that is what labels say. Shared by what looks at a record and what estimates from it.

mod label;
mod rest;
mod turn;

pub use label::{LabelCheck, Verdict, checks};
pub use rest::{Rest, Up, rests};
pub use turn::{Turn, turns};
