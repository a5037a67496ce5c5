//! Temperature dependence of the instruments of a grade.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::imu::{ParameterKind, Sensor, Triad, TriadVector};
use crate::units::{ARCSEC, DEG_PER_H, MICRO_G, PPM};
use turncal_input::{Document, FileError, NonNegative};

/// 1σ, over the instruments of a grade, of the temperature dependence of each parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ThermalVariation {
    /// Linear change per kelvin, by kind of parameter.
    first: [f64; 3],
    /// Quadratic change per kelvin squared.
    second: [f64; 3],
    /// Change of a bias per K/s.
    rate: f64,
}

impl ThermalVariation {
    /// A variation for tests.
    #[cfg(test)]
    pub fn for_test() -> Self {
        Self {
            first: [1e-5, 1e-6, 1e-7],
            second: [1e-7, 0.0, 1e-9],
            rate: 1e-5,
        }
    }

    /// 1σ of the coefficients of T, T² and dT/dt of each parameter, per K, K² and K/s.
    pub fn sigma(&self) -> [TriadVector; 3] {
        let of = |by: [f64; 3]| {
            TriadVector::from_fn(|parameter, _| match Triad::kind(parameter) {
                ParameterKind::Scale => by[0],
                ParameterKind::Installation => by[1],
                ParameterKind::Bias => by[2],
            })
        };
        [of(self.first), of(self.second), of([0.0, 0.0, self.rate])]
    }
}

/// Seconds per minute, because rates are stated per K/min.
const MINUTE: f64 = 60.0;

/// `[gyro.temperature]` or `[accel.temperature]` in an instrument file: the 1σ of each coefficient, zero if not stated.
pub type ThermalFile = BTreeMap<String, NonNegative>;

/// Scale factor for 1 K and 1 K² in ppm, misalignment for 1 K in arc seconds, and bias for 1 K, 1 K² and 1 K/min in °/h
/// or µg.
pub fn thermal_variation(
    document: Document,
    sensor: Sensor,
    stated: &ThermalFile,
) -> Result<ThermalVariation, FileError> {
    let (bias, unit) = sensor.pick(("bias_deg_per_h", DEG_PER_H), ("bias_ug", MICRO_G));
    let keys = [
        ("scale_ppm_per_k".to_owned(), PPM),
        ("scale_ppm_per_k2".to_owned(), PPM),
        ("installation_arcsec_per_k".to_owned(), ARCSEC),
        (format!("{bias}_per_k"), unit),
        (format!("{bias}_per_k2"), unit),
        (format!("{bias}_per_k_per_min"), unit),
    ];
    let known = keys.each_ref().map(|(key, _)| key.as_str());
    let table = format!("{}.temperature", sensor.name());
    document.only(&table, stated.keys(), &known)?;
    let value = |(key, unit): &(String, f64)| stated.get(key).map_or(0.0, |of| of.0 * unit);
    let [scale, scale2, installation, bias, bias2, rate] = keys.each_ref().map(value);
    Ok(ThermalVariation {
        first: [scale, installation, bias],
        second: [scale2, 0.0, bias2],
        rate: rate * MINUTE,
    })
}
