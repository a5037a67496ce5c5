//! One of the calibrations in a comparison.

use std::collections::BTreeMap;

use super::limits::{Check, Verdict};
use super::quantity::{Quantity, Sample, axes};
use crate::calibration::result::Calibration;
use crate::calibration::result::frame::{Canonical, MagneticValues};
use crate::calibration::{Nees, auxiliary_name};
use crate::imu::{Nominal, PerSensor};
use crate::noise::RestNoise;

/// A unit with its calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// Name, unique among the units.
    pub name: String,
    /// `[meta]` of the unit's run, if it could be read.
    pub meta: BTreeMap<String, String>,
    /// Calibration, or the reason for failure.
    pub calibrated: Result<Calibrated, String>,
}

impl Unit {
    /// A calibration or a truth, with the noise of its run at rest if a recording shows it.
    pub fn of_record(
        name: impl Into<String>,
        calibration: Calibration,
        noise: Option<RestNoise>,
    ) -> Self {
        Self {
            name: name.into(),
            meta: calibration.meta.clone(),
            calibrated: Ok(Calibrated { calibration, noise }),
        }
    }
}

/// A unit's calibration, with the noise of its run.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibrated {
    /// The calibration.
    pub calibration: Calibration,
    /// Noise of each axis at rest; `None` if no dwell is long enough or there is no recording.
    pub noise: Option<RestNoise>,
}

impl Calibrated {
    /// Nominal scales of the unit's run, in the file's quantity, if they are stated.
    pub fn nominal(&self) -> Option<&PerSensor<[f64; 3]>> {
        Some(&self.calibration.provenance.as_ref()?.nominal)
    }

    /// The noise at rest, normalised by these scales instead of the scales of the run.
    pub fn noise_by(&self, nominal: &PerSensor<Nominal>) -> Option<RestNoise> {
        let (own, mut noise) = (self.nominal()?, self.noise?);
        for (sensor, axis) in axes() {
            let (own, common) = (own.get(sensor)[axis], nominal.get(sensor).0[axis]);
            noise.density.get_mut(sensor)[axis] *= (own / common).abs();
        }
        Some(noise)
    }
}

/// A unit compared with the others.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The unit.
    pub unit: Unit,
    /// Calibration in the common form, or the reason why it cannot be used.
    pub canonical: Result<Canonical, String>,
    /// Matrix and bias of the magnetometer in the common body frame, in the file's quantity (per µT if the field is in
    /// T), or the reason why they are not compared.
    pub magnetic: Result<MagneticValues, &'static str>,
    /// Noise at rest, normalised by the common nominal scales; `None` if it is not known.
    pub noise: Option<RestNoise>,
    /// Consistency of the difference from the truth with the covariance; `None` without a truth or without
    /// correlations.
    pub nees: Option<Nees>,
    /// Checks against the limits.
    pub checks: Vec<Check>,
    /// Combined verdict of all checks; `None` without a specification.
    pub verdict: Option<Verdict>,
}

impl Row {
    /// The check of a quantity, if there is a limit for it.
    pub fn check_of(&self, quantity: Quantity) -> Option<&Check> {
        self.checks
            .iter()
            .find(|check| check.quantity() == quantity)
    }

    /// A quantity of the unit; `None` if it was not estimated.
    pub fn sample(&self, quantity: Quantity) -> Option<Sample> {
        let canonical = self.canonical.as_ref().ok()?;
        match quantity {
            Quantity::Parameter(index) => {
                let sigma = canonical.sigma().map_or(0.0, |sigma| sigma[index]);
                let value = canonical.vector()[index];
                // A parameter without σ, among others with σ, was not estimated.
                (sigma > 0.0 || canonical.covariance.is_none()).then_some(Sample { value, sigma })
            }
            Quantity::Auxiliary(index) => {
                let of = canonical.constants.get(&auxiliary_name(index)?)?;
                Some(Sample {
                    value: of.value,
                    sigma: of.sigma.unwrap_or(0.0),
                })
            }
            Quantity::Noise(sensor, axis) => {
                let noise = self.noise.as_ref()?;
                let value = noise.density.get(sensor)[axis];
                let sigma = value * noise.relative_sigma();
                Some(Sample { value, sigma })
            }
            Quantity::Magnetic(constant) => {
                let [value, sigma] = self.magnetic.as_ref().ok()?.map(|of| of[constant]);
                Some(Sample { value, sigma })
            }
        }
    }
}
