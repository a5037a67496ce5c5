//! One unit of a lot.

use std::collections::BTreeMap;

use super::limits::{Check, Verdict};
use super::quantity::{Quantity, Sample, axes};
use crate::calibration::result::Calibration;
use crate::calibration::result::frame::Canonical;
use crate::imu::{Nominal, PerSensor, Sensor};
use crate::noise::RestNoise;

/// A unit with its calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// Its name, unique in the lot.
    pub name: String,
    /// `[meta]` of its run, if that could be read.
    pub meta: BTreeMap<String, String>,
    /// Its calibration, or the reason for failure.
    pub calibrated: Result<Calibrated, String>,
}

/// A unit's calibration, with the nominal scales and the noise of its run.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibrated {
    /// The calibration.
    pub calibration: Calibration,
    /// Nominal scales of the run, in the file's quantity.
    pub nominal: PerSensor<[f64; 3]>,
    /// Noise of each axis at rest; `None` if no dwell is long enough.
    pub noise: Option<RestNoise>,
}

/// A unit's noise at rest, normalised by these scales instead of those of its run.
pub fn noise_at_rest(unit: &Unit, nominal: &PerSensor<Nominal>) -> Option<RestNoise> {
    let calibrated = unit.calibrated.as_ref().ok()?;
    let mut noise = calibrated.noise?;
    for (sensor, axis) in axes() {
        let (own, of_lot) = (calibrated.nominal.get(sensor), nominal.get(sensor).0);
        noise.density.get_mut(sensor)[axis] *= (own[axis] / of_lot[axis]).abs();
    }
    Some(noise)
}

/// A unit in the lot.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The unit.
    pub unit: Unit,
    /// Its calibration in the common form, or the reason why it cannot be used.
    pub canonical: Result<Canonical, String>,
    /// Its noise at rest, by the lot's nominal scales; `None` if no dwell is long enough.
    pub noise: Option<RestNoise>,
    /// Its checks against the limits.
    pub checks: Vec<Check>,
    /// Combined verdict of all checks; `None` without a specification.
    pub verdict: Option<Verdict>,
}

impl Row {
    /// The nominal scale of its run with the largest deviation from the lot's: triad, axis and relative deviation;
    /// `None` if they differ by rounding only.
    pub fn nominal_off(&self, lot: &PerSensor<Nominal>) -> Option<(Sensor, usize, f64)> {
        const ROUNDING: f64 = 1e-12;
        let own = &self.unit.calibrated.as_ref().ok()?.nominal;
        let off = axes().map(|(sensor, axis)| {
            let part = own.get(sensor)[axis] / lot.get(sensor).0[axis] - 1.0;
            (sensor, axis, part)
        });
        off.filter(|off| off.2.abs() > ROUNDING)
            .max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))
    }

    /// The check of a quantity, if there is a limit for it.
    pub fn check_of(&self, quantity: Quantity) -> Option<&Check> {
        self.checks
            .iter()
            .find(|check| check.quantity() == quantity)
    }

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
                let noise = self.noise.as_ref()?;
                let density = noise.density.get(sensor)[axis];
                (density > 0.0).then(|| Sample {
                    value: density.ln(),
                    sigma: noise.relative_sigma(),
                })
            }
        }
    }
}
