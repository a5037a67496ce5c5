//! How still the IMU is while the table stands.

use crate::run::{Dwell, Run};

/// Below this the velocity at standstill is never trusted, m/s.
const FLOOR: f64 = 1e-6;
/// Length of the sums whose scatter is looked at, s: the filter's own rate of observation.
const STRETCH: f64 = 0.1;
/// Excess below this many of its own standard errors is chance.
const SIGNIFICANT: f64 = 3.0;

/// White 1σ in m/s of the velocity at standstill, beyond random walk and pulses.
///
/// Neighbouring velocity increments share the velocity at their common border, so its variance is
/// minus their covariance; random walk has none.
pub(super) fn velocity_sigma(run: &Run, dwells: &[Dwell]) -> f64 {
    if let Some(given) = run.standstill.velocity_sigma {
        return given.max(FLOOR);
    }
    let stretch = ((STRETCH / run.imu.period).round() as usize).max(1);
    let (mut covariance, mut variance, mut pairs) = (0.0, 0.0, 0usize);
    for dwell in dwells {
        let sums: Vec<_> = run.imu.accel[dwell.samples.clone()]
            .chunks_exact(stretch)
            .map(|chunk| chunk.iter().sum::<nalgebra::Vector3<f64>>())
            .collect();
        if sums.len() < 3 {
            continue;
        }
        let mean = sums.iter().sum::<nalgebra::Vector3<f64>>() / sums.len() as f64;
        for pair in sums.windows(2) {
            covariance += (pair[0] - mean).dot(&(pair[1] - mean));
            variance += (pair[0] - mean).norm_squared();
            pairs += 3;
        }
    }
    if pairs == 0 {
        return FLOOR;
    }
    let (covariance, variance) = (covariance / pairs as f64, variance / pairs as f64);
    let excess = -covariance - run.imu.pulse.accel.powi(2) / 12.0;
    if excess > SIGNIFICANT * variance / (pairs as f64).sqrt() {
        excess.sqrt().max(FLOOR)
    } else {
        FLOOR
    }
}
