//! Start of the iterations: closed form, coarse start and axis order.
//!
//! One set of equations ([`equations`]) has four kinds of rows: from a table, labels, gravity and Earth rate.

mod both_triads;
pub mod closed_form;
pub mod coarse;
mod earth_rate;
mod elimination;
pub mod equations;
mod gravity;
pub mod gravity_alone;
mod labels;
mod least_squares;
pub mod mounting;
pub mod positions;
mod table;
