//! A unit as the lot sees it.

use super::limits::{Check, Verdict};
use super::quantity::{Quantity, Sample};
use super::unit::Unit;
use crate::calibration::frame::Canonical;

/// A unit in the lot.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The unit.
    pub unit: Unit,
    /// Its calibration as the lot's are compared, or why there is none to be used.
    pub canonical: Result<Canonical, String>,
    /// Each limit that concerns it.
    pub checks: Vec<Check>,
    /// What all checks come to; none without a specification.
    pub verdict: Option<Verdict>,
}

impl Row {
    /// A quantity of the unit.
    pub fn sample(&self, quantity: Quantity) -> Option<Sample> {
        let canonical = self.canonical.as_ref().ok()?;
        match quantity {
            Quantity::Parameter(index) => {
                let sigma = canonical.sigma().map_or(0.0, |sigma| sigma[index]);
                let value = canonical.vector()[index];
                // A parameter without σ beside others that have one was not estimated.
                (sigma > 0.0 || canonical.covariance.is_none()).then_some(Sample { value, sigma })
            }
            Quantity::Noise(sensor, axis) => {
                let noise = self.unit.calibrated.as_ref().ok()?.noise.as_ref()?;
                let density = noise.density.get(sensor)[axis];
                (density > 0.0).then(|| Sample {
                    value: density.ln(),
                    sigma: noise.relative_sigma(),
                })
            }
        }
    }
}
