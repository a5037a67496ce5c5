//! What the data say of the model, noise and record: one file a check, its words beside it.

pub mod drift;
pub mod dwell_scatter;
pub mod error_term_test;
pub mod finding;
pub mod form;
pub mod innovation;
pub mod observability;
pub mod prior_cause;
pub mod prior_distance;
pub mod quality;
pub mod residuals;
pub mod rest_scatter;
pub mod rounding;
pub mod unexplained;
