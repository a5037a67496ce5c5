//! The names and units of noise figures in `[imu.noise]`: one table for reader, writer, drafts and the
//! Allan command.

use super::Sensor;
use crate::units::{DEG_PER_H, DEG_PER_SQRT_H, DEGREE, MICRO_G, MICRO_G_PER_SQRT_HZ};

/// Names and units of a triad's noise figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseKeys {
    /// Random walk, and its unit in rad/√s or (m/s)/√s.
    pub random_walk: (&'static str, f64),
    /// 1σ of a Gauss–Markov bias, and its unit in rad/s or m/s².
    pub gauss_markov: (&'static str, f64),
    /// Former name, which is still accepted; data sheets use it for the floor of the Allan deviation.
    pub former: &'static str,
    /// Correlation time in s.
    pub correlation_time: &'static str,
    /// Noise of moves by their rate or acceleration, in √s.
    pub by_motion: &'static str,
    /// Noise of moves by their duration, and its unit in rad/√s or (m/s)/√s.
    pub by_duration: (&'static str, f64),
}

impl NoiseKeys {
    /// The keys of a triad.
    pub const fn of(sensor: Sensor) -> Self {
        match sensor {
            Sensor::Gyro => Self {
                random_walk: ("angle_random_walk_deg_per_sqrt_h", DEG_PER_SQRT_H),
                gauss_markov: ("gyro_gauss_markov_sigma_deg_per_h", DEG_PER_H),
                former: "gyro_instability_deg_per_h",
                correlation_time: "gyro_correlation_time_s",
                by_motion: "attitude_noise_of_moves_by_rate_sqrt_s",
                by_duration: ("attitude_noise_of_moves_deg_per_sqrt_s", DEGREE),
            },
            Sensor::Accel => Self {
                random_walk: ("velocity_random_walk_ug_per_sqrt_hz", MICRO_G_PER_SQRT_HZ),
                gauss_markov: ("accel_gauss_markov_sigma_ug", MICRO_G),
                former: "accel_instability_ug",
                correlation_time: "accel_correlation_time_s",
                by_motion: "velocity_noise_of_moves_by_acceleration_sqrt_s",
                by_duration: ("velocity_noise_of_moves_m_s_per_sqrt_s", 1.0),
            },
        }
    }
    /// All names.
    pub const fn names(self) -> [&'static str; 6] {
        [
            self.random_walk.0,
            self.gauss_markov.0,
            self.former,
            self.correlation_time,
            self.by_motion,
            self.by_duration.0,
        ]
    }
}
