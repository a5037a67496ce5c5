//! By how much recordings differ beyond what is stated: learnt from what each says alone.

use nalgebra::{DMatrix, DVector};

use super::super::alone::Alone;
use super::super::day_to_day::DayToDay;
use super::super::finding::{Finding, RecordingDifference};
use super::super::group::Group;
use super::super::model::Model;
use super::super::parameters::{from_vector, sensor_and_parameter};
use crate::imu::{RATE, Triad};
use crate::statistics::chi_square_limit;

/// Chance that recordings which differ as is stated are said to differ more; each group has the same share.
const FALSE_ALARM: f64 = 1e-3;
/// Fewer recordings do not tell a difference from a change with temperature.
const FEWEST: usize = 3;
/// Iterations of the method of scoring, and the part of a variance below which a step is none.
const ITERATIONS: usize = 100;
const SETTLED: f64 = 1e-4;

/// What recordings differ by where they differ by more than is stated, and the finding that says so.
///
/// Each parameter of a group is a polynomial in temperature, a difference that all of the group's parameters draw with
/// one σ, and the error of the recording alone. The variance is that of the largest marginal likelihood, where that
/// exceeds the stated one's beyond chance.
///
/// Source: Patterson and Thompson 1971, "Recovery of inter-block information when block sizes are unequal",
/// Biometrika 58(3), for the method of scoring of a variance component.
pub(super) fn learnt(model: &Model, alone: &[Alone]) -> Option<(DayToDay, Finding)> {
    let groups: Vec<Group> = Group::all().collect();
    let limit = chi_square_limit(1.0, FALSE_ALARM / groups.len() as f64);
    let mut day_to_day = model.day_to_day;
    let stated = day_to_day.covariance(&from_vector(model.form, &model.prior_mean));
    let mut differences = Vec::new();
    for group in groups {
        let all = group.parameters(model.form).into_iter();
        let all = all.filter_map(|i| Scattered::new(model, alone, i, stated[(i, i)]));
        let all: Vec<Scattered> = all.collect();
        let Some((variance, ratio)) = most_likely(&all) else {
            continue;
        };
        if ratio <= limit {
            continue;
        }
        let (key, unit) = DayToDay::key(group);
        let mut stated = 0.0;
        for index in group.parameters(model.form) {
            let sigma = &mut day_to_day.parameters[index];
            stated = *sigma / unit;
            *sigma = sigma.hypot(variance.sqrt());
        }
        differences.push(RecordingDifference {
            key,
            stated,
            found: stated.hypot(variance.sqrt() / unit),
            ratio,
            limit,
        });
    }
    (!differences.is_empty()).then_some((day_to_day, Finding::RecordingsDiffer { differences }))
}

/// What recordings alone say of one parameter.
struct Scattered {
    /// Less the mean of the prior.
    values: DVector<f64>,
    /// Their covariance without a difference that is learnt.
    covariance: DMatrix<f64>,
}

impl Scattered {
    /// Where recordings differ by this variance as is stated. `None` where it is not estimated, or too few recordings
    /// say it.
    fn new(model: &Model, alone: &[Alone], index: usize, own: f64) -> Option<Self> {
        let (sensor, of_triad) = sensor_and_parameter(index);
        let axis = Triad::axis(model.form, of_triad)?;
        let thermal = model.thermal.as_deref();
        let known = alone.iter().filter_map(|alone| {
            let estimate = alone.estimate.as_ref()?;
            let functions = match thermal {
                Some(_) => Some(alone.state.as_ref()?.get(sensor)[axis]),
                None => None,
            };
            let value = estimate.vector()[index] - model.prior_mean[index];
            Some((value, estimate.covariance[(index, index)], functions))
        });
        let known: Vec<_> = known.filter(|&(_, variance, _)| variance > 0.0).collect();
        if known.len() < FEWEST {
            return None;
        }
        let common = model.prior_sigma[index].powi(2);
        let covariance = DMatrix::from_fn(known.len(), known.len(), |a, b| {
            let ((_, variance, of_a), (_, _, of_b)) = (&known[a], &known[b]);
            let alone = if a == b { variance + own } else { 0.0 };
            let change = thermal.zip(of_a.as_ref().zip(of_b.as_ref()));
            let change = change.map_or(0.0, |(thermal, (of_a, of_b))| {
                let sigma = thermal.sigma.get(sensor).row(of_triad);
                let by = |k: usize| sigma[k].powi(2) * of_a[k] * of_b[k];
                (0..RATE).map(by).sum()
            });
            alone + common + change
        });
        let values = DVector::from_iterator(known.len(), known.iter().map(|of| of.0));
        Some(Self { values, covariance })
    }

    /// −2 ln of the likelihood with a difference of this variance; its first derivative, and the expected second.
    fn deviance(&self, variance: f64) -> Option<[f64; 3]> {
        let n = self.values.len();
        let with = &self.covariance + DMatrix::identity(n, n) * variance;
        let factor = with.cholesky()?;
        let (inverse, whitened) = (factor.inverse(), factor.solve(&self.values));
        let log_determinant = 2.0 * factor.l_dirty().diagonal().map(f64::ln).sum();
        Some([
            log_determinant + self.values.dot(&whitened),
            inverse.trace() - whitened.norm_squared(),
            (&inverse * &inverse).trace(),
        ])
    }
}

/// The variance of the largest likelihood, and by how much −2 ln of it falls from that of none.
fn most_likely(all: &[Scattered]) -> Option<(f64, f64)> {
    let at = |variance: f64| {
        all.iter().try_fold([0.0; 3], |sum, of| {
            let of = of.deviance(variance)?;
            Some([0, 1, 2].map(|k| sum[k] + of[k]))
        })
    };
    let [without, ..] = at(0.0).filter(|_| !all.is_empty())?;
    let mut variance = 0.0;
    for _ in 0..ITERATIONS {
        let [_, slope, curvature] = at(variance)?;
        let next = (variance - slope / curvature).max(0.0);
        let step: f64 = next - variance;
        variance = next;
        if step.abs() <= SETTLED * variance {
            break;
        }
    }
    let [with, ..] = at(variance)?;
    Some((variance, without - with))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// Ten parameters in eight recordings with a linear change, each alone known to 1, that differ by `sigma`.
    fn drawn(sigma: f64, seed: u64) -> Vec<Scattered> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut unit = || -> f64 { StandardNormal.sample(&mut rng) };
        let by = |a: usize| a as f64 / 4.0 - 1.0;
        (0..10)
            .map(|_| {
                let (constant, slope) = (100.0 * unit(), 100.0 * unit());
                Scattered {
                    values: DVector::from_fn(8, |a, _| {
                        constant + slope * by(a) + unit() * sigma.hypot(1.0)
                    }),
                    covariance: DMatrix::from_fn(8, 8, |a, b| {
                        f64::from(u8::from(a == b)) + 1e4 * (1.0 + by(a) * by(b))
                    }),
                }
            })
            .collect()
    }

    #[test]
    fn a_difference_is_found_within_its_own_error_and_none_where_there_is_none() {
        // Six of eight degrees of freedom are left of each parameter: 60, so σ² is known to √(2/60) of itself.
        let runs = 200;
        let mut sum = 0.0;
        for seed in 0..runs {
            let (variance, ratio) = most_likely(&drawn(2.0, seed)).unwrap();
            assert!(
                ratio > chi_square_limit(1.0, FALSE_ALARM),
                "{seed}: {ratio}"
            );
            sum += variance / f64::from(runs as u32);
        }
        let expected = 5.0 * (2.0f64 / 60.0).sqrt() / f64::from(runs as u32).sqrt();
        assert!((sum - 4.0).abs() < 4.0 * expected, "{sum} ± {expected}");
        let beyond = (0..runs).filter(|&seed| {
            let (_, ratio) = most_likely(&drawn(0.0, seed)).unwrap();
            ratio > chi_square_limit(1.0, 0.05)
        });
        // One in twenty by a test of two sides, of which only one counts: five of 200, and 13 in one of a thousand.
        let beyond = beyond.count();
        assert!(beyond <= 13, "{beyond}");
    }
}
