//! White noise of a record without stated noise.

use crate::imu::Sensor;
use crate::recording::ImuSamples;

/// Length of the sums that are compared, s: long enough that the rounding of pulses is negligible.
const SUM: f64 = 0.25;
/// A third of normal deviates lie below this, σ. If three quarters of a record are at rest, the lowest quarter of all
/// deviates is the lowest third of those at rest. If half of it or all of it is, the estimate is 1.6 or 0.74 times the
/// noise.
const FIRST_THIRD: f64 = 0.430_727;

/// Random walk of a triad, rad/√s or (m/s)/√s, estimated from the quieter part of a record: from second differences of
/// sums, which neither a bias nor its drift affects.
pub fn white_noise(imu: &ImuSamples, sensor: Sensor) -> f64 {
    let length = ((SUM / imu.period).round() as usize).max(1);
    let mut differences = Vec::new();
    for stretch in &imu.stretches {
        let sums: Vec<_> = imu
            .of(sensor)
            .sums(stretch.samples.clone(), length)
            .collect();
        for three in sums.windows(3) {
            let second = three[0] - three[1] * 2.0 + three[2];
            differences.extend(second.iter().map(|component| component.abs()));
        }
    }
    let quarter = differences.len() / 4;
    if quarter == 0 {
        return 0.0;
    }
    let (_, at_rest, _) = differences.select_nth_unstable_by(quarter, f64::total_cmp);
    *at_rest / FIRST_THIRD / (6.0 * length as f64 * imu.period).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::Scenario;

    #[test]
    fn the_white_noise_of_a_simulated_record_is_found_within_a_factor_of_two() {
        let run = Scenario::load("mems").unwrap().simulate(1, 0).unwrap().run;
        for sensor in Sensor::ALL {
            let stated = run.instrument.noise.get(sensor).random_walk;
            let found = white_noise(&run.recording.imu, sensor);
            assert!(
                (found / stated).ln().abs() < 0.5,
                "{sensor:?}: {found} {stated}"
            );
        }
    }
}
