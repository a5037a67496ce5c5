//! How still the IMU is while the table stands.

use super::schedule::step_length;
use crate::run::{Dwell, Run};

/// Below this the velocity at standstill is never trusted, m/s. Small beside what random walk makes of
/// a tenth of a second in the best of instruments, lest the innovations be smaller than they claim.
pub(super) const FLOOR: f64 = 1e-7;
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
    let stretch = step_length(run.recording.imu.period);
    let (mut covariance, mut variance, mut pairs) = (0.0, 0.0, 0usize);
    for dwell in dwells {
        let sums: Vec<_> = run.recording.imu.accel[dwell.samples.clone()]
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
    let excess = -covariance - run.recording.imu.pulse.accel.powi(2) / 12.0;
    if excess > SIGNIFICANT * variance / (pairs as f64).sqrt() {
        excess.sqrt().max(FLOOR)
    } else {
        FLOOR
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imu::Output;
    use crate::simulation::Scenario;
    use nalgebra::Vector3;

    #[test]
    fn random_walk_and_pulses_alone_are_no_unrest() {
        let mut scenario = Scenario::load("demo").unwrap();
        for output in [Output::Pulse, Output::Increment] {
            scenario.output = output;
            let run = scenario.simulate(1, 0).unwrap().run;
            assert_eq!(velocity_sigma(&run, &run.dwells(run.aiding())), FLOOR);
        }
    }

    #[test]
    fn white_velocity_at_standstill_is_found_within_a_tenth() {
        let mut scenario = Scenario::load("demo").unwrap();
        scenario.output = Output::Increment;
        let mut run = scenario.simulate(1, 0).unwrap().run;
        // A velocity that alternates by ±σ is white at the spacing of the sums, 10 samples.
        let sigma = 5e-5;
        let velocity = |k: usize| {
            let hash = (k / 10).wrapping_mul(0x9E37_79B9).rotate_left(7) as u32;
            Vector3::repeat(if hash.count_ones().is_multiple_of(2) {
                sigma
            } else {
                -sigma
            })
        };
        for k in 0..run.recording.imu.accel.len() {
            run.recording.imu.accel[k] += velocity(k + 1) - velocity(k);
        }
        let found = velocity_sigma(&run, &run.dwells(run.aiding()));
        assert!((found / sigma - 1.0).abs() < 0.1, "{found}");
    }
}
