//! Strapdown navigation and its error model; there are two forms of each.
//!
//! [`Navigator`] serves calibration. The frame of the first form is fixed to the Earth and is East-North-Up at the
//! site. A turntable does not travel, so gravity and Earth rate are those of the site, not of the computed position,
//! and there is no transport rate: the equations are exact for the truth (`V = 0` at rest) and linear in velocity and
//! position.
//!
//! [`Strapdown`] is nonlinear navigation on the ellipsoid; [`NonlinearError`] is its deviation from the truth, which
//! measures the quality of a calibration; [`ErrorModel`] is its linear error model; [`NavigationError`] is the reported
//! error. [`Trajectory`] is the true motion of a moving body.
//!
//! Source: Savage, *Strapdown Analytics*, 2nd ed., ch. 4 and 7; Zhao, Jiang, Li 2016, Eq. 13.

mod block;
pub mod error_model;
mod errors;
mod increments;
mod instrument;
mod navigation_error;
mod nonlinear_error;
mod passage;
mod process_noise;
mod runge_kutta;
mod site_fixed;
mod strapdown;
mod trajectory;

pub use block::{Block, ParameterBlock, State, TermColumn};
pub use error_model::{
    ErrorMatrix, ErrorModel, ErrorVector, InputMatrix, Linearisation, SensedErrors, Sensitivity,
    Transition,
};
pub use increments::{Increments, Motion, Sums};
pub use navigation_error::NavigationError;
pub use nonlinear_error::{Forcing, InputError, NonlinearError};
pub use process_noise::{NoiseInput, NoiseInputs, ProcessNoise};
pub use site_fixed::Navigator;
pub use site_fixed::samples_of;
pub use strapdown::within_reach;
pub use strapdown::{Height, Instant, LARGEST_LATITUDE, NearPole, Solution, Strapdown};
pub use trajectory::{Change, Segment, Start, Stride, Strides, Trajectory, TrajectoryError};
