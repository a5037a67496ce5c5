//! Residual motion of the IMU while the table is at rest.

use nalgebra::Vector3;

use super::schedule::step_length;
use crate::imu::{PerSensor, Sensor};
use crate::run::{Dwell, Run};

/// Floor of the noise of attitude, rad, and velocity, m/s, at standstill. The floor is small compared with the random
/// walk of the best instruments over a tenth of a second; it ensures that innovations are not smaller than their stated
/// σ.
pub const FLOOR: PerSensor<f64> = PerSensor {
    gyro: 1e-9,
    accel: 1e-7,
};
/// Smallest significant excess, in standard errors.
const SIGNIFICANT: f64 = 3.0;

/// White 1σ, at standstill, of the integral of each triad's output, in excess of random walk and pulses: attitude in
/// rad, velocity in m/s. These values are stated in the run or, if they are not stated, estimated from the dwells.
pub fn standstill_sigma(run: &Run, dwells: &[Dwell]) -> PerSensor<f64> {
    PerSensor::from_fn(|sensor| {
        let floor = *FLOOR.get(sensor);
        let given = run.standstill.sigma.get(sensor);
        given.map_or_else(|| shown(run, dwells, sensor), |given| given.max(floor))
    })
}

/// Estimate from dwells. Neighbouring increments share the attitude or velocity at their common border, so the variance
/// of this quantity is minus their covariance; random walk has no such covariance.
fn shown(run: &Run, dwells: &[Dwell], sensor: Sensor) -> f64 {
    let imu = &run.recording.imu;
    let (samples, floor) = (imu.of(sensor), *FLOOR.get(sensor));
    let stretch = step_length(imu.period);
    let (mut covariance, mut variance, mut pairs) = (0.0, 0.0, 0usize);
    for dwell in dwells {
        let sums: Vec<_> = samples.sums(dwell.samples.clone(), stretch).collect();
        if sums.len() < 3 {
            continue;
        }
        let mean = sums.iter().sum::<Vector3<f64>>() / sums.len() as f64;
        for pair in sums.windows(2) {
            let square = (pair[0] - mean).norm_squared();
            // Subtracting the mean of the same sums reduces each product by this amount.
            let by_mean = square / sums.len() as f64;
            covariance += (pair[0] - mean).dot(&(pair[1] - mean)) + by_mean;
            variance += square;
            pairs += 3;
        }
    }
    if pairs == 0 {
        return floor;
    }
    let (covariance, variance) = (covariance / pairs as f64, variance / pairs as f64);
    let pulse = imu.pulse.get(sensor).powi(2) / 12.0;
    let excess = -covariance - pulse;
    // At a constant rate, the remaining fractions may alternate; their effect is then four times that of random
    // fractions.
    let chance = SIGNIFICANT * variance / (pairs as f64).sqrt() + 3.0 * pulse;
    if excess > chance {
        excess.sqrt().max(floor)
    } else {
        floor
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imu::Output;
    use crate::simulation::Scenario;

    #[test]
    fn random_walk_and_pulses_alone_are_no_unrest() {
        let mut scenario = Scenario::load("demo").unwrap();
        for output in [Output::Pulse, Output::Increment] {
            scenario.output = output;
            let run = scenario.simulate(1, 0).unwrap().run;
            assert_eq!(standstill_sigma(&run, &run.dwells(run.aiding())), FLOOR);
        }
    }

    #[test]
    fn many_short_dwells_are_as_still_as_few_long_ones() {
        let mut scenario = Scenario::load("demo").unwrap();
        scenario.output = Output::Increment;
        for number in 0..8 {
            let run = scenario.simulate(1, number).unwrap().run;
            let mut dwells = run.dwells(run.aiding());
            for dwell in &mut dwells {
                dwell.samples.end = dwell.samples.start + 100;
            }
            assert_eq!(standstill_sigma(&run, &dwells), FLOOR, "{number}");
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
            run.recording.imu.accel.to_mut()[k] += velocity(k + 1) - velocity(k);
        }
        let found = standstill_sigma(&run, &run.dwells(run.aiding())).accel;
        assert!((found / sigma - 1.0).abs() < 0.1, "{found}");
    }
}
