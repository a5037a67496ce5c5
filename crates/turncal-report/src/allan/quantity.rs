//! Names and units of the processes.

use turncal::imu::Sensor;
use turncal::noise::Process;
use turncal::units::{
    ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, HOUR, MICRO_G, MICRO_G_PER_SQRT_HZ, MILLISECOND,
};

const SQRT_HOUR: f64 = 60.0;

/// Presentation of the strength of a process.
pub struct Quantity {
    /// Name, such as `angle random walk N`.
    pub name: &'static str,
    /// Symbol of the unit.
    pub unit: &'static str,
    /// The unit in SI.
    pub value: f64,
    /// Key in documents.
    pub key: &'static str,
}

impl Quantity {
    /// Letter in the standards.
    pub fn letter(&self) -> &'static str {
        self.name.rsplit(' ').next().unwrap_or_default()
    }
}

/// Quantity of a process in one triad.
#[rustfmt::skip]
pub fn quantity(process: Process, sensor: Sensor) -> Quantity {
    use Process::*;
    let (name, unit, value, key) = match (process, sensor) {
        (Quantisation, Sensor::Gyro) => ("quantisation Q", "″", ARCSEC, "quantisation_arcsec"),
        (Quantisation, Sensor::Accel) => ("quantisation Q", "mm/s", MILLISECOND, "quantisation_mm_per_s"),
        (RandomWalk, Sensor::Gyro) => ("angle random walk N", "°/√h", DEG_PER_SQRT_H, "angle_random_walk_deg_per_sqrt_h"),
        (RandomWalk, Sensor::Accel) => ("velocity random walk N", "µg/√Hz", MICRO_G_PER_SQRT_HZ, "velocity_random_walk_ug_per_sqrt_hz"),
        (BiasInstability, Sensor::Gyro) => ("bias instability B", "°/h", DEG_PER_H, "bias_instability_deg_per_h"),
        (BiasInstability, Sensor::Accel) => ("bias instability B", "µg", MICRO_G, "bias_instability_ug"),
        (RateRandomWalk, Sensor::Gyro) => ("rate random walk K", "°/h/√h", DEG_PER_H / SQRT_HOUR, "rate_random_walk_deg_per_h_per_sqrt_h"),
        (RateRandomWalk, Sensor::Accel) => ("acceleration random walk K", "µg/√h", MICRO_G / SQRT_HOUR, "acceleration_random_walk_ug_per_sqrt_h"),
        (RateRamp, Sensor::Gyro) => ("rate ramp R", "°/h/h", DEG_PER_H / HOUR, "rate_ramp_deg_per_h_per_h"),
        (RateRamp, Sensor::Accel) => ("acceleration ramp R", "µg/h", MICRO_G / HOUR, "acceleration_ramp_ug_per_h"),
        (GaussMarkov { .. }, Sensor::Gyro) => ("Gauss–Markov σ", "°/h", DEG_PER_H, "gauss_markov_deg_per_h"),
        (GaussMarkov { .. }, Sensor::Accel) => ("Gauss–Markov σ", "µg", MICRO_G, "gauss_markov_ug"),
    };
    Quantity { name, unit, value, key }
}

/// Unit of the Allan deviation: symbol, the unit in SI, the unit in ASCII.
pub fn deviation_unit(sensor: Sensor) -> (&'static str, f64, &'static str) {
    match sensor {
        Sensor::Gyro => ("°/h", DEG_PER_H, "deg/h"),
        Sensor::Accel => ("µg", MICRO_G, "ug"),
    }
}
