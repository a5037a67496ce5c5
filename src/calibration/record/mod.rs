//! What a pass meets, event by event: steps, standstill, moves and parts of dwells.

pub mod events;
pub mod schedule;
pub mod segment;
pub mod standstill;
