//! Predicted navigation errors of a calibration; the truth may be unknown.

use nalgebra::SVector;

use crate::navigation::error_model::STATES;
use crate::navigation::{ErrorMatrix, NavigationError};

/// Navigation error at one moment, if it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlook {
    /// Time since the start, s.
    pub time: f64,
    /// The actual error; `None` if the truth is not known.
    pub error: Option<NavigationError>,
    /// 1σ predicted from the calibration's covariance, in the order of
    /// [`NavigationError::to_vector`]; `None` if the calibration states no σ.
    pub sigma: Option<SVector<f64, STATES>>,
}

/// Predicted 1σ of each error.
pub fn sigma(covariance: &ErrorMatrix) -> SVector<f64, STATES> {
    covariance.diagonal().map(|v| v.max(0.0).sqrt())
}
