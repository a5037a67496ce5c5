//! Calibration: closed form, coarse start, filter and passes.

pub mod outcome;
pub mod states;
