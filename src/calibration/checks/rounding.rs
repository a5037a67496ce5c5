//! Uncertainty due to the rounding of rates to steps larger than their noise.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};
use serde_json::json;

use super::finding::{triad_name, widened_by};
use crate::calibration::estimate::largest_growth;
use crate::calibration::start::equations::{Common, Equations, Rows, of, of_parameters};
use crate::calibration::{Finding, FindingKind as Kind, ParameterMatrix, Problem, parameter};
use crate::imu::{PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad, rounding_error};
use crate::number::three_digits;
use crate::run::{Aiding, Run};
use crate::units::DEGREE;

/// A variance of means, in (rad/s)² or (m/s²)², that no sensor shows: its square must not vanish in rounding.
const NOTHING: f64 = f64::EPSILON * f64::EPSILON;
/// Smallest growth of σ that is reported.
const SAID: f64 = 1.05;

/// Covariance due to rounding: the rounding errors of the mean outputs in dwells, propagated through least squares with
/// the prior. Dwells whose means are within the same step have the same rounding error. Without a table, accelerometers
/// at rest observe only the magnitude of gravity.
pub fn by_rounding(problem: &Problem, triads: &PerSensor<Triad>) -> ParameterMatrix {
    let of = |&sensor: &Sensor| of_triad(problem, sensor, triads);
    Sensor::ALL.iter().filter_map(of).sum()
}

/// Findings on triads for which rounding matters; `covariance` is the covariance of the estimate, including rounding.
pub fn rounded(
    problem: &Problem,
    by_rounding: &ParameterMatrix,
    covariance: &ParameterMatrix,
) -> Vec<Finding> {
    let of = |sensor: Sensor| {
        let first = parameter(sensor, 0);
        let of_triad = first..first + PER_TRIAD;
        let [with, part] = [covariance, by_rounding].map(|m| m.diagonal());
        let without = with - part;
        let [without, with] = [&without, &with].map(|m| &m.as_slice()[of_triad.clone()]);
        let growth = largest_growth(without, with);
        let steps = problem
            .runs()
            .map(|run| run.recording.imu.resolution(sensor).max());
        let (value, unit) = match sensor {
            Sensor::Gyro => (DEGREE, "°/s"),
            Sensor::Accel => (1.0, "m/s²"),
        };
        let step = steps.fold(0.0, f64::max) / value;
        let text = format!(
            "{} values are rounded to {} {unit}, which is coarser than their noise, so averaging cannot recover the \
             mean within a step. turncal widened the σ {}. Log more digits.",
            triad_name(sensor),
            three_digits(step),
            widened_by(growth)
        );
        let of = sensor.name();
        let figures = json!({ "of": of, "step": step, "unit": unit, "growth": growth });
        let finding = || Finding::new(Kind::Rounded, text, figures).of_growth(growth);
        (growth >= SAID).then(finding)
    };
    Sensor::ALL.into_iter().filter_map(of).collect()
}

/// Rounding errors of one triad; `None` if rows are not rounded.
fn of_triad(
    problem: &Problem,
    sensor: Sensor,
    triads: &PerSensor<Triad>,
) -> Option<ParameterMatrix> {
    let triad = triads.get(sensor);
    let correction = triad.correction()?;
    let recordings = problem.runs().enumerate();
    let means: Vec<Mean> = recordings
        .flat_map(|(recording, run)| of_recording(problem, recording, run, sensor))
        .collect();
    let variance = means.iter().map(|mean| mean.variance.mean()).sum::<f64>();
    let variance = variance / means.len() as f64;
    let variance = Some(variance).filter(|variance| *variance > NOTHING)?;
    let along_gravity = sensor == Sensor::Accel && problem.model.aiding == Aiding::Velocity;
    let mut equations = Equations::of_triads(&problem.model, triads, &[sensor]);
    let mut numbers = BTreeMap::new();
    for mean in &means {
        let input = match sensor {
            Sensor::Gyro => Vector3::zeros(),
            Sensor::Accel => correction * (mean.output - triad.bias),
        };
        let seen = if along_gravity {
            input * input.transpose() / input.norm_squared().max(f64::MIN_POSITIVE)
        } else {
            Matrix3::identity()
        };
        let common = [0, 1, 2].map(|axis| {
            let next = numbers.len();
            let number = *numbers.entry((axis, mean.step[axis])).or_insert(next);
            let mut error = Matrix3::zeros();
            error[(axis, 0)] = mean.variance[axis].sqrt();
            (Common::Unit(number), error)
        });
        let partials = of(sensor, &(seen * of_parameters(triad, &input)));
        equations.add(&Rows {
            common: common.to_vec(),
            own: Vector3::zeros(),
            ..Rows::new(partials, Vector3::zeros(), variance)
        });
    }
    equations.by_errors()
}

/// The mean of a triad's rows over a dwell.
struct Mean {
    /// Mean along body axes, rad/s or m/s².
    output: Vector3<f64>,
    /// Number of the step in which it lies, for each axis.
    step: [i64; 3],
    /// Variance of its rounding error, (rad/s)² or (m/s²)².
    variance: Vector3<f64>,
}

/// Means of a recording's dwells; empty if rows are not rounded.
fn of_recording(problem: &Problem, recording: usize, run: &Run, sensor: Sensor) -> Vec<Mean> {
    let steps = run.recording.imu.resolution(sensor);
    if steps == Vector3::zeros() {
        return Vec::new();
    }
    let imu = &run.recording.imu;
    let mut squares = Vector3::zeros();
    let (mut means, mut count) = (Vec::new(), 0.0f64);
    let stretches = problem
        .stretches()
        .iter()
        .filter(|of| of.recording == recording);
    for dwell in stretches.flat_map(|stretch| &stretch.dwells) {
        // Pairs that have no row in common, so that they are independent.
        let mut rows = imu.of(sensor).sums(dwell.samples.clone(), 1);
        let (mut sum, mut summed) = (Vector3::zeros(), 0.0f64);
        while let (Some(before), Some(after)) = (rows.next(), rows.next()) {
            squares += (after - before).map(|change| change * change);
            sum += before + after;
            summed += 2.0;
        }
        count += summed;
        means.push(sum / (summed.max(1.0) * imu.period));
    }
    let scatter = squares / (count.max(1.0) * imu.period.powi(2));
    let stated = run.instrument.noise.get(sensor).random_walk.powi(2) / imu.period;
    let variance = Vector3::from_fn(|axis, _| left(steps[axis], scatter[axis], stated));
    let mean = |output: Vector3<f64>| Mean {
        output,
        step: std::array::from_fn(|axis| {
            if steps[axis] > 0.0 {
                (output[axis] / steps[axis]).round() as i64
            } else {
                0
            }
        }),
        variance,
    };
    means.into_iter().map(mean).collect()
}

/// Variance of the rounding error in a mean of rows with this step, with this scatter (rounding included) and this
/// stated noise variance.
fn left(step: f64, scatter: f64, stated: f64) -> f64 {
    if step == 0.0 {
        return 0.0;
    }
    let square = step * step;
    let seen = (scatter / square - 1.0 / 12.0).max(0.0);
    // The variance of two values is at most a quarter of the squared step, however little noise causes the change from
    // one to the other.
    let noise = if scatter > 0.25 * square {
        seen
    } else {
        seen.min(stated / square)
    };
    rounding_error(step, noise * square)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    use super::*;

    #[test]
    fn what_rounding_leaves_in_a_mean_is_what_values_within_a_step_have() {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        assert!((left(1.0, 0.0, 1.0) * 12.0 - 1.0).abs() < 2e-3);
        // Between two values without noise the step is as unknown.
        assert_eq!(left(1.0, 0.2, 0.0), left(1.0, 0.0, 0.0));
        for sigma in [0.25, 0.35, 0.7] {
            let noise = Normal::new(0.0, sigma).unwrap();
            let (mut errors, mut scatters) = (0.0, 0.0);
            let values = 400;
            for k in 0..values {
                let value = f64::from(k) / f64::from(values);
                let rows: Vec<f64> = (0..4000)
                    .map(|_| f64::round(value + noise.sample(&mut random)))
                    .collect();
                let mean = rows.iter().sum::<f64>() / 4000.0;
                let scatter = rows.iter().map(|row| (row - mean).powi(2)).sum::<f64>() / 4000.0;
                errors += (mean - value).powi(2) - scatter / 4000.0;
                scatters += scatter;
            }
            let (found, expected) = (errors / f64::from(values), scatters / f64::from(values));
            let expected = left(1.0, expected, sigma * sigma);
            // A mean of 4,000 rows knows its error to a hundredth of its scatter.
            assert!(
                (found - expected).abs() < 0.25 * expected + 2e-5,
                "{found} {expected}"
            );
        }
    }
}
