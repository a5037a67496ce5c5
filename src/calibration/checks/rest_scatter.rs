//! Scatter of the rows at rest, compared with the stated noise.

use nalgebra::Matrix3;
use serde_json::json;

use super::finding::triad_name;
use crate::calibration::record::schedule::step_length;
use crate::calibration::{
    Finding, FindingKind as Kind, NoisePolicy, Problem, mean_square_interval,
};
use crate::imu::{AXES, NoiseKeys, PerSensor, Sensor, Triad};
use crate::number::three_digits;
use crate::run::{Dwell, Run};
use crate::statistics::FALSE_ALARM;

/// Largest error that pulses cause in the difference of two neighbouring increments: a second difference of remainders,
/// each half a pulse at most.
const PULSES: f64 = 2.0;
/// A scatter smaller than this part of the stated noise is shown as zero.
const NO_NOISE: f64 = 1e-3;

/// Findings on triads whose scatter at rest disagrees with the noise that the user requested (`NoisePolicy::Stated`).
/// Calibrated inputs are used, because a wrong prior scale factor is not noise.
///
/// A step lasts a tenth of a second, as in the filter: errors that change faster average out, and only random walk,
/// bias and vibration of the mount remain. The result does not change the calibration, because this test does not
/// distinguish between these three causes.
pub fn scatter_at_rest(problem: &Problem, calibrated: &PerSensor<Triad>) -> Vec<Finding> {
    let runs = problem.runs().enumerate();
    let each = runs.flat_map(|(recording, run)| Sensor::ALL.map(|sensor| (recording, run, sensor)));
    let insists = problem.options.noise == NoisePolicy::Stated;
    let stated =
        each.filter(|(_, run, sensor)| insists && *run.instrument.noise_is_stated.get(*sensor));
    let found = stated.filter_map(|(recording, run, sensor)| {
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
        // Pairs that have no step in common, so that they are independent.
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
    let standstill_sigma = run.standstill.sigma.get(sensor).unwrap_or(0.0);
    let least = by_noise + 6.0 * standstill_sigma.powi(2);
    let pulses = (PULSES * imu.pulse.get(sensor)).powi(2);
    let most = least + pulses * correction.norm_squared() / AXES.len() as f64;
    let (low, high) = mean_square_interval(count, FALSE_ALARM / Sensor::ALL.len() as f64);
    let variance = squares / count as f64;
    let expected = if variance > most { most } else { least };
    let (figure, unit) = NoiseKeys::of(sensor).random_walk;
    let [found, stated] = [variance, expected].map(|of| (of / (2.0 * step)).sqrt() / unit);
    let ratio = found / stated;
    let (compared, shown) = compared(found, ratio);
    let beyond = variance > high * most || variance < low * least;
    let [low, high] = [low.sqrt(), high.sqrt()];
    let symbol = match sensor {
        Sensor::Gyro => "°/√h",
        Sensor::Accel => "µg/√Hz",
    };
    let text = format!(
        "The {} noise at rest is {compared} the stated value: {} instead of {} {symbol} (tolerance −{:.1} % to +{:.1} \
         %). \
         The noise is estimated from 0.1 s averages, so vibration of the mount increases the result. Run turncal allan on a \
         long static recording to separate noise from vibration, and correct {figure}.",
        triad_name(sensor),
        shown,
        three_digits(stated),
        100.0 * (1.0 - low),
        100.0 * (high - 1.0)
    );
    let figures = json!({
        "of": sensor.name(), "figure": figure, "found": found, "stated": stated, "limits": [low, high]
    });
    beyond.then(|| Finding::new(Kind::ScatterAtRest, text, figures).of_growth(ratio))
}

/// The estimated figure relative to the stated one, in words, and as a number.
fn compared(found: f64, ratio: f64) -> (String, String) {
    let shown = three_digits(found);
    match ratio {
        ..NO_NOISE => ("far below".to_owned(), "practically 0".to_owned()),
        ..1.0 => (format!("{:.1} % below", 100.0 * (1.0 - ratio)), shown),
        1.0..2.0 => (format!("{:.1} % above", 100.0 * (ratio - 1.0)), shown),
        _ => (format!("{ratio:.1} times"), shown),
    }
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
            let options = Options {
                noise: NoisePolicy::Stated,
                ..Options::default()
            };
            let problem = Problem::new(&run, &options);
            let prior = PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General));
            scatter_at_rest(&problem, &prior)
        };
        let findings = (0..runs).flat_map(of_run);
        findings
            .map(|finding| {
                assert_eq!(finding.kind, "scatter-at-rest");
                let figure = |name: &str| finding.figures[name].as_f64().unwrap();
                figure("found") / figure("stated")
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
