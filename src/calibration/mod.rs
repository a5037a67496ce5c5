//! Calibration: closed form, coarse start, filter and passes.
//!
//! Each takes a [`crate::run::Run`] and gives an [`Estimate`]; none prints, reads files or draws.

mod batch;
mod block_effect;
mod bound;
mod closed_form;
mod coarse;
mod comparison;
mod consistency;
mod correction;
mod curvature;
mod error;
mod estimator;
mod filter;
mod form;
pub(crate) mod frame;
pub mod further;
mod group;
mod linearisation;
mod nees;
mod observability;
pub mod outcome;
mod pass;
mod problem;
mod quality;
mod record;
mod scatter;
mod schedule;
mod standstill;
pub mod states;

pub use batch::batch_estimate;
pub use block_effect::{BlockEffect, block_effects};
pub use bound::{Bound, bound};
pub use closed_form::{
    ClosedForm, Position, Reference, six_position, six_position_of, six_position_triad,
};
pub use coarse::{AttitudePrior, CoarseStart, coarse_start};
pub use comparison::{Comparison, Named, Side, compare};
pub use consistency::mean_square_interval;
pub use correction::{Calibrated, Correction, CorrectionError};
pub use error::{CalibrationError, ComparisonError};
pub use estimator::{Progress, estimate};
pub use form::FormTest;
pub use frame::{Canonical, in_body_frame, in_general_form};
pub use group::Group;
pub use linearisation::Linearisation;
pub use nees::{Nees, nees};
pub use observability::{AttitudePart, Direction, Observability, Part};
pub use outcome::{Estimate, Outcome};
pub use quality::{Measures, Quality, Spread};
pub use record::{triads_of, truth_record};
pub use scatter::{ChiSquare, ParameterScatter, Scatter};
