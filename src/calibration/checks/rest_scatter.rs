//! How much the rows scatter at rest, beside what the stated noise makes of them.

use nalgebra::Matrix3;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::finding::Finding;
use crate::calibration::problem::Problem;
use crate::calibration::record::schedule::step_length;
use crate::imu::{AXES, NoiseKeys, PerSensor, Sensor, Triad};
use crate::run::{Dwell, Run};

/// Chance that a triad of right noise rings, on either side.
const FALSE_ALARM: f64 = 1e-3 / 4.0;
/// Increments of two neighbouring steps differ by a second difference of what pulses leave over, each half a
/// pulse at most.
const PULSES: f64 = 2.0;

/// Triads that scatter at rest by more or less than their noise says, as findings; of inputs as calibrated, for a prior
/// scale that is off is no noise.
///
/// A step lasts a tenth of a second, as the filter's: what is faster averages out, and slower than that
/// only random walk, bias and a mount that shakes are seen. Nothing is changed by it, for it does not tell
/// them apart.
pub fn scatter_at_rest(problem: &Problem, calibrated: &PerSensor<Triad>) -> Vec<Finding> {
    let runs = problem.runs().enumerate();
    let each = runs.flat_map(|(recording, run)| Sensor::ALL.map(|sensor| (recording, run, sensor)));
    let found = each.filter_map(|(recording, run, sensor)| {
        let stretches = problem.stretches().iter();
        let of_run = stretches.filter(|stretch| stretch.recording == recording);
        let correction = calibrated.get(sensor).correction()?;
        let dwells = of_run.flat_map(|stretch| &stretch.dwells);
        of_triad(run, sensor, &correction, dwells)
    });
    found.collect()
}

fn of_triad<'a>(
    run: &Run,
    sensor: Sensor,
    correction: &Matrix3<f64>,
    dwells: impl Iterator<Item = &'a Dwell>,
) -> Option<Finding> {
    let imu = &run.recording.imu;
    let length = step_length(imu.period);
    let step = length as f64 * imu.period;
    let (mut squares, mut count) = (0.0, 0usize);
    for dwell in dwells {
        // Pairs that have no step in common, so that each is new.
        let mut sums = imu.of(sensor).sums(dwell.samples.clone(), length);
        while let (Some(before), Some(after)) = (sums.next(), sums.next()) {
            squares += (correction * (after - before)).norm_squared();
            count += 3;
        }
    }
    let noise = run.instrument.noise.get(sensor);
    let spans = [[0.0, step], [step, 2.0 * step]];
    let by_noise = 2.0
        * step.powi(2)
        * (noise.covariance_of_means(spans[0], spans[0])
            - noise.covariance_of_means(spans[0], spans[1]));
    let stillness = run.standstill.sigma.get(sensor).unwrap_or(0.0);
    let least = by_noise + 6.0 * stillness.powi(2);
    let pulses = (PULSES * imu.pulse.get(sensor)).powi(2);
    let most = least + pulses * correction.norm_squared() / AXES.len() as f64;
    let limit = |chance: f64| {
        let chi2 = ChiSquared::new(count as f64).ok()?;
        Some(chi2.inverse_cdf(chance) / count as f64)
    };
    let (low, high) = (limit(FALSE_ALARM)?, limit(1.0 - FALSE_ALARM)?);
    let variance = squares / count as f64;
    let walk = |variance: f64| (variance / (2.0 * step)).sqrt();
    let unit = NoiseKeys::of(sensor).random_walk;
    (variance > high * most || variance < low * least).then(|| Finding::ScatterAtRest {
        of: sensor.name(),
        figure: unit.0,
        found: walk(variance) / unit.1,
        stated: walk(if variance > most { most } else { least }) / unit.1,
        limits: (low.sqrt(), high.sqrt()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Options;
    use crate::imu::InstallationForm;
    use crate::simulation::Scenario;

    /// The factors by which triads scatter more than stated, noise being stated at this part of it.
    fn factors(scenario: &str, part: f64, runs: u64) -> Vec<f64> {
        let scenario = Scenario::load(scenario).unwrap();
        let of_run = |number| {
            let mut run = scenario.simulate(1, number).unwrap().run;
            run.instrument.noise.gyro.random_walk *= part;
            run.instrument.noise.accel.random_walk *= part;
            let problem = Problem::new(&run, &Options::default());
            let prior = PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General));
            scatter_at_rest(&problem, &prior)
        };
        let findings = (0..runs).flat_map(of_run);
        findings
            .map(|finding| match finding {
                Finding::ScatterAtRest { found, stated, .. } => found / stated,
                other => panic!("{other:?}"),
            })
            .collect()
    }

    #[test]
    fn noise_as_stated_is_not_named_and_noise_that_is_not_is_by_its_factor() {
        assert!(factors("mems", 1.0, 4).is_empty());
        assert!(factors("demo", 1.0, 4).is_empty());
        for (part, factor) in [(1.0 / 3.0, 3.0), (2.0, 0.5)] {
            let found = factors("mems", part, 1);
            assert_eq!(found.len(), 2);
            assert!(
                found.iter().all(|f| (f / factor - 1.0).abs() < 0.05),
                "{found:?}"
            );
        }
    }
}
