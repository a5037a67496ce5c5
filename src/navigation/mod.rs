//! Strapdown navigation and its error model, twice.
//!
//! [`Navigator`] serves calibration: its frame is fixed to the Earth at the site (East-North-Up
//! there). A turntable stays where it is, so gravity and Earth rate are those of the site, not of
//! the computed position, and no transport rate arises: the equations are exact for the truth
//! (`V = 0` at rest) and linear in velocity and position.
//!
//! [`Strapdown`] goes over the ellipsoid, nonlinear; [`NonlinearError`] is how far it departs from the truth
//! and shows what a calibration is worth; [`ErrorModel`] is its linear error model, [`NavigationError`] what is reported. [`Trajectory`] is
//! where a body that moves truly is.
//!
//! Source: Savage, *Strapdown Analytics*, 2nd ed., ch. 4 and 7; Zhao, Jiang, Li 2016, Eq. 13.

mod block;
pub mod error_model;
mod increments;
mod moments;
mod navigation_error;
mod nonlinear_error;
mod passage;
mod process_noise;
mod sensitivity;
mod site_fixed;
mod state;
mod strapdown;
mod stride;
mod sums;
mod trajectory;
mod transition;
mod vectors;

pub use block::{Block, BlockMatrix, NAVIGATION, ParameterBlock, TermColumn};
pub use error_model::{
    ErrorMatrix, ErrorModel, ErrorVector, InputMatrix, Sensitivity, Transition, sensed_errors,
};
pub use increments::{Increments, Motion};
pub use navigation_error::NavigationError;
pub use nonlinear_error::{Forcing, InputError, NonlinearError};
pub use process_noise::{NoiseInput, NoiseInputs, ProcessNoise};
pub use sensitivity::{Linearisation, SensedErrors};
pub(crate) use site_fixed::samples_of;
pub use site_fixed::{Navigator, TermValues};
pub use state::State;
pub(crate) use strapdown::within_reach;
pub use strapdown::{Height, LARGEST_LATITUDE, NearPole, Solution, Strapdown};
pub use stride::{Instant, Stride};
pub use sums::Sums;
pub use trajectory::{Change, Segment, Start, Strides, Trajectory, TrajectoryError, Travel};
