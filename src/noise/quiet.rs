//! Estimation of the white noise of a recording for which no noise is stated.

use crate::imu::Sensor;
use crate::recording::ImuSamples;

/// Lengths of the compared sums, s. The first is used unless pulses dominate.
const SUMS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// A third of normal deviates are below this, in σ. If three quarters of a recording are at rest, the first quartile of
/// all sums is the first third of those at rest; if half or all of it is at rest, the estimate is 1.6 or 0.74 times the
/// true noise.
const FIRST_THIRD: f64 = 0.430_727;

/// Random walk of a triad, rad/√s or (m/s)/√s, from the quieter part of a recording: from second differences of sums,
/// which are independent of bias and drift. The sums are made longer until the differences reach the size of a pulse.
/// Rows that are all rounded to one value have at least the noise of this rounding.
pub fn white_noise(imu: &ImuSamples, sensor: Sensor) -> f64 {
    let pulse = *imu.pulse.get(sensor);
    let mut found = 0.0;
    for seconds in SUMS {
        let length = ((seconds / imu.period).round() as usize).max(1);
        let Some(quiet) = quieter_part(imu, sensor, length) else {
            break;
        };
        found = quiet.max(pulse) / FIRST_THIRD / (6.0 * length as f64 * imu.period).sqrt();
        if quiet >= pulse {
            break;
        }
    }
    let rounding = imu.resolution(sensor).max() * (imu.period / 12.0).sqrt();
    found.max(rounding)
}

/// The lower quartile of the second differences of sums over `length` samples; `None` for a recording without any.
fn quieter_part(imu: &ImuSamples, sensor: Sensor, length: usize) -> Option<f64> {
    let mut differences = Vec::new();
    for stretch in &imu.stretches {
        let sums = imu.of(sensor).sums(stretch.samples.clone(), length);
        let sums: Vec<_> = sums.collect();
        for three in sums.windows(3) {
            let second = three[0] - three[1] * 2.0 + three[2];
            differences.extend(second.iter().map(|component| component.abs()));
        }
    }
    let quarter = differences.len() / 4;
    let (_, at_rest, _) =
        (quarter > 0).then(|| differences.select_nth_unstable_by(quarter, f64::total_cmp))?;
    Some(*at_rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::Scenario;

    #[test]
    fn the_white_noise_of_a_simulated_record_is_found_within_a_factor_of_two() {
        // The pulses of the demo are larger than the noise of its sums.
        for scenario in ["mems", "demo"] {
            let run = Scenario::load(scenario).unwrap();
            let run = run.simulate(1, 0).unwrap().run;
            for sensor in Sensor::ALL {
                let stated = run.instrument.noise.get(sensor).random_walk;
                let found = white_noise(&run.recording.imu, sensor);
                assert!(
                    (found / stated).ln().abs() < 0.5,
                    "{scenario} {sensor:?}: {found} {stated}"
                );
            }
        }
    }
}
