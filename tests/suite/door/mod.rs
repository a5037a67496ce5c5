//! Runs come in through the door as they are, go out so that they come in again, and nothing wrong
//! gets in.

mod bombs;
mod doubts;
pub mod made;
mod reading;
mod round_trip;
mod unexplained;
mod wrong_input;
