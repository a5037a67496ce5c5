//! Strapdown navigation and its error model.
//!
//! Mechanisation and errors refer to a frame that is fixed to the Earth at the site (East-North-Up
//! there). A turntable stays where it is, so gravity and Earth rate are those of the site, not of
//! the computed position, and no transport rate arises: the equations are exact for the truth
//! (`V = 0` at rest) and linear in velocity and position.
//!
//! Source: Savage, *Strapdown Analytics*, 2nd ed., ch. 4 and 7; Zhao, Jiang, Li 2016, Eq. 13 at a
//! standing site.

mod block;
mod increments;
mod site_fixed;
mod state;

pub use block::{Block, BlockMatrix, NAVIGATION, ParameterBlock};
pub use increments::{Increments, Motion};
pub use site_fixed::Navigator;
pub use state::State;
