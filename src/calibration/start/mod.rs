//! Where the iterations begin: closed form, coarse start and the mounting of the instrument.
//!
//! One set of equations ([`equations`]) with four kinds of rows: by a table, by labels, by gravity, by Earth rate.

pub mod attempt;
mod both_triads;
pub mod closed_form;
pub mod coarse;
mod earth_rate;
pub mod equations;
mod gravity;
mod judged;
mod labels;
pub mod mounting;
pub mod positions;
mod table;
