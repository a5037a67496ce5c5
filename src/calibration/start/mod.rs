//! Where the iterations begin: closed form, coarse start and the mounting of the instrument.

pub mod attempt;
pub mod closed_form;
pub mod coarse;
pub mod mounting;
