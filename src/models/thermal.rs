//! Temperature dependence of the instruments of a grade.

use serde::{Deserialize, Serialize};

use crate::formats::NonNegative;
use crate::imu::{ParameterKind, Triad, TriadVector};
use crate::units::{ARCSEC, DEG_PER_H, MICRO_G, PPM};

/// 1σ over the instruments of a grade of each parameter's change with temperature.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ThermalVariation {
    /// For one kelvin, by kind of parameter.
    first: [f64; 3],
    /// For one kelvin squared.
    second: [f64; 3],
    /// Of a bias for one K/s.
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

    /// 1σ of each parameter's coefficients: of T, of T², of dT/dt; per K, K² and K/s.
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

/// `[gyro.temperature]` of an instrument's file: 1σ of each.
#[derive(Clone, Copy, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub struct GyroThermalFile {
    scale_ppm_per_k: NonNegative,
    scale_ppm_per_k2: NonNegative,
    installation_arcsec_per_k: NonNegative,
    bias_deg_per_h_per_k: NonNegative,
    bias_deg_per_h_per_k2: NonNegative,
    bias_deg_per_h_per_k_per_min: NonNegative,
}

/// `[accel.temperature]`.
#[derive(Clone, Copy, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub struct AccelThermalFile {
    scale_ppm_per_k: NonNegative,
    scale_ppm_per_k2: NonNegative,
    installation_arcsec_per_k: NonNegative,
    bias_ug_per_k: NonNegative,
    bias_ug_per_k2: NonNegative,
    bias_ug_per_k_per_min: NonNegative,
}

/// Seconds in a minute: rates are stated per K/min.
const MINUTE: f64 = 60.0;

/// Scale for 1 K and 1 K² in ppm, installation for 1 K in arc seconds, and bias for 1 K, 1 K² and 1 K/min in this
/// unit.
fn in_si(
    [scale, scale2, installation]: [NonNegative; 3],
    bias: [NonNegative; 3],
    unit: f64,
) -> ThermalVariation {
    let [bias, bias2, rate] = bias.map(|bias| bias.0 * unit);
    ThermalVariation {
        first: [scale.0 * PPM, installation.0 * ARCSEC, bias],
        second: [scale2.0 * PPM, 0.0, bias2],
        rate: rate * MINUTE,
    }
}

impl GyroThermalFile {
    pub fn in_si(self) -> ThermalVariation {
        in_si(
            [
                self.scale_ppm_per_k,
                self.scale_ppm_per_k2,
                self.installation_arcsec_per_k,
            ],
            [
                self.bias_deg_per_h_per_k,
                self.bias_deg_per_h_per_k2,
                self.bias_deg_per_h_per_k_per_min,
            ],
            DEG_PER_H,
        )
    }
}

impl AccelThermalFile {
    pub fn in_si(self) -> ThermalVariation {
        in_si(
            [
                self.scale_ppm_per_k,
                self.scale_ppm_per_k2,
                self.installation_arcsec_per_k,
            ],
            [
                self.bias_ug_per_k,
                self.bias_ug_per_k2,
                self.bias_ug_per_k_per_min,
            ],
            MICRO_G,
        )
    }
}
