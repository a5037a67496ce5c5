//! One unit of a lot: its calibration, or why it has none.

use std::collections::BTreeMap;

use crate::calibration::result::Calibration;
use crate::imu::{Nominal, PerSensor};
use crate::noise::RestNoise;

/// A unit with what came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// Its name, no other unit's in the lot.
    pub name: String,
    /// `[meta]` of its run, as far as that could be read.
    pub meta: BTreeMap<String, String>,
    /// Its calibration, or why it could not be calibrated.
    pub calibrated: Result<Calibrated, String>,
}

/// A unit's calibration, with what its run states and shows beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibrated {
    /// The calibration.
    pub calibration: Calibration,
    /// Nominal scales of the run, in the file's quantity.
    pub nominal: PerSensor<[f64; 3]>,
    /// Noise at rest, axis by axis; none if no dwell is long enough.
    pub noise: Option<RestNoise>,
}

impl Unit {
    /// Its noise at rest, normalised by these scales in the place of its run's own.
    pub(super) fn noise(&self, nominal: &PerSensor<Nominal>) -> Option<RestNoise> {
        let calibrated = self.calibrated.as_ref().ok()?;
        let noise = calibrated.noise?;
        let density = PerSensor::from_fn(|sensor| {
            let (own, of_lot) = (calibrated.nominal.get(sensor), nominal.get(sensor).0);
            let density = noise.density.get(sensor);
            [0, 1, 2].map(|axis| density[axis] * (own[axis] / of_lot[axis]).abs())
        });
        Some(RestNoise { density, ..noise })
    }
}
