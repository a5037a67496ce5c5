//! Faults in the rows of a log, and their repair.

mod chance;
mod fault;
mod impossible;
mod interpolation;
mod line;
mod notes;
mod pinned;
mod repair;
mod rows;
mod search;
mod slower;
mod spikes;

pub use fault::{Bridge, Fault, FaultKind};
pub use notes::notes;
pub use repair::Repaired;
pub use rows::{Rows, ranges};
pub use slower::Slower;
