//! The names and units of noise figures in `[imu.noise]`: one table for reader, writer, drafts and the
//! Allan command.

use super::Sensor;
use crate::units::{DEG_PER_H, DEG_PER_SQRT_H, MICRO_G, MICRO_G_PER_SQRT_HZ};

/// Names and units of a triad's noise figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseKeys {
    /// Random walk, and its unit in rad/√s or (m/s)/√s.
    pub random_walk: (&'static str, f64),
    /// 1σ of a Gauss–Markov bias, and its unit in rad/s or m/s².
    pub gauss_markov: (&'static str, f64),
    /// Its correlation time in s.
    pub correlation_time: &'static str,
    /// What its 1σ was called when data sheets' floor of the Allan deviation goes by that name.
    pub former: &'static str,
}

impl NoiseKeys {
    /// Those of a triad.
    pub const fn of(sensor: Sensor) -> Self {
        match sensor {
            Sensor::Gyro => Self {
                random_walk: ("angle_random_walk_deg_per_sqrt_h", DEG_PER_SQRT_H),
                gauss_markov: ("gyro_gauss_markov_sigma_deg_per_h", DEG_PER_H),
                correlation_time: "gyro_correlation_time_s",
                former: "gyro_instability_deg_per_h",
            },
            Sensor::Accel => Self {
                random_walk: ("velocity_random_walk_ug_per_sqrt_hz", MICRO_G_PER_SQRT_HZ),
                gauss_markov: ("accel_gauss_markov_sigma_ug", MICRO_G),
                correlation_time: "accel_correlation_time_s",
                former: "accel_instability_ug",
            },
        }
    }
}
