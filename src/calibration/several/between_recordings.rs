//! Differences between recordings beyond the stated ones, estimated from each recording calibrated alone.

use nalgebra::{DMatrix, DVector};

use super::day_to_day::DayToDay;
use crate::calibration::checks::recordings::recordings_differ;
use crate::calibration::noise::variances::{Component, Slope, likeliest};
use crate::calibration::{
    Estimate, Finding, Group, Model, RecordingDifference, SeparateEstimate, from_vector,
    sensor_and_parameter,
};
use crate::imu::{RATE, ThermalState, Triad};
use crate::statistics::{FALSE_ALARM, chi_square_limit};

/// Fewest recordings that distinguish a difference from a temperature dependence.
const FEWEST: usize = 3;
/// Minimum remaining fraction of the prior variance of a direction; below it, rounding dominates.
const LEAST_LEFT: f64 = 1e-12;
/// The estimated σ of differences between recordings, if they differ by more than stated, and the finding on it.
///
/// Each parameter is a polynomial in temperature plus a difference for each recording, with one σ for all parameters of
/// a group. The variances maximise the marginal likelihood. The most significant group is added first, then the
/// next, as long as the likelihood ratio is significant.
///
/// Source: Patterson and Thompson 1971, "Recovery of inter-block information when block sizes are unequal",
/// Biometrika 58(3), for the likelihood; Henderson 1975, "Best linear unbiased estimation and prediction under a
/// selection model", Biometrics 31(2), for its normal equations.
pub fn learnt(model: &Model, alone: &[SeparateEstimate]) -> Option<(DayToDay, Finding)> {
    let evidence = RecordingsEvidence::new(model, alone)?;
    let limit = chi_square_limit(1.0, FALSE_ALARM / evidence.groups.len() as f64);
    let found = evidence.found(limit)?;
    let mut day_to_day = model.day_to_day;
    let mut differences = Vec::new();
    for (group, variance, ratio) in found {
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
    Some((day_to_day, recordings_differ(&differences)))
}

/// Information of one recording beyond its prior, along the directions that it observes.
struct RecordingEvidence {
    /// Values, each with an error of 1σ …
    values: DVector<f64>,
    /// … coefficients of the recording's parameters, in prior σ: one row per value …
    by_own: DMatrix<f64>,
    /// … and of the common parameters.
    by_common: DMatrix<f64>,
}

/// Information of all recordings on the estimated parameters.
struct RecordingsEvidence {
    recordings: Vec<RecordingEvidence>,
    /// Group index and prior variance of each parameter.
    parameters: Vec<(usize, f64)>,
    groups: Vec<Group>,
    /// Stated covariance of the deviation of a recording, in prior σ.
    stated: DMatrix<f64>,
    /// Inverse of the prior variance of the common parameters.
    prior: DVector<f64>,
}

impl RecordingEvidence {
    /// `common` maps the common quantities to the parameters at the temperature of the recording. `None` if the
    /// recording adds no information to its prior.
    fn new(
        (off, covariance): (&DVector<f64>, DMatrix<f64>),
        common: &DMatrix<f64>,
    ) -> Option<Self> {
        // The recording left so much of the prior variance along each direction.
        let left = covariance.symmetric_eigen();
        let seen: Vec<usize> = (0..off.len())
            .filter(|&k| left.eigenvalues[k] < 0.5)
            .collect();
        let weight = |k: usize| 1.0 / left.eigenvalues[k].max(LEAST_LEFT) - 1.0;
        let by_own = DMatrix::from_fn(seen.len(), off.len(), |row, i| {
            weight(seen[row]).sqrt() * left.eigenvectors[(i, seen[row])]
        });
        // Its prior drew the estimate towards the mean by the part that is left.
        let drawn = DVector::from_fn(seen.len(), |row, _| {
            let weight = weight(seen[row]);
            (1.0 + weight) / weight
        });
        (!seen.is_empty()).then(|| Self {
            values: (&by_own * off).component_mul(&drawn),
            by_common: &by_own * common,
            by_own,
        })
    }
}

/// Matrix from the common quantities of all recordings to the parameters of one, both in prior σ. The common quantities
/// are the parameters and, for each, coefficients of the first `functions` functions of temperature.
fn common(
    model: &Model,
    indices: &[usize],
    state: Option<&ThermalState>,
    functions: usize,
) -> DMatrix<f64> {
    let n = indices.len();
    let mut common = DMatrix::zeros(n, n * (1 + functions));
    for (i, &index) in indices.iter().enumerate() {
        common[(i, i)] = 1.0;
        let (sensor, of_triad) = sensor_and_parameter(index);
        let axis = Triad::axis(model.form, of_triad);
        let Some((state, axis)) = state.zip(axis) else {
            continue;
        };
        for function in 0..functions {
            let thermal = model.thermal.as_deref();
            let coefficient = thermal.map_or(0.0, |t| t.sigma.get(sensor)[(of_triad, function)]);
            let by = state.get(sensor)[axis][function];
            common[(i, (1 + function) * n + i)] = by * coefficient / model.prior_sigma[index];
        }
    }
    common
}

impl RecordingsEvidence {
    /// `None` if too few recordings give information.
    fn new(model: &Model, alone: &[SeparateEstimate]) -> Option<Self> {
        let groups: Vec<Group> = Group::all().collect();
        let indices = groups.iter().flat_map(|group| group.parameters(model.form));
        let indices: Vec<usize> = indices
            .filter(|&index| model.prior_sigma[index] > 0.0)
            .collect();
        let n = indices.len();
        let prior = |i: usize| model.prior_sigma[indices[i]];
        let functions = model.thermal.as_ref().map_or(0, |_| RATE);
        let mut widest = DVector::from_element(n, 1.0f64);
        let mut recordings = Vec::new();
        for alone in alone {
            let Some(estimate) = &alone.estimate else {
                continue;
            };
            let state = match &alone.state {
                None if functions > 0 => continue,
                state => state.as_ref(),
            };
            let common = common(model, &indices, state, functions);
            let (off, covariance) = in_prior_sigma(estimate, model, &indices);
            widest.zip_apply(&off, |widest, off| *widest = widest.max(off.abs()));
            recordings.extend(RecordingEvidence::new((&off, covariance), &common));
        }
        let own = model
            .day_to_day
            .covariance(&from_vector(model.form, &model.prior_mean));
        let parameter = |&index: &usize| {
            let place = groups.iter().position(|&of| of == Group::of(index));
            (place.unwrap_or_default(), model.prior_sigma[index].powi(2))
        };
        let parameters = indices.iter().map(parameter).collect();
        (recordings.len() >= FEWEST).then(|| Self {
            recordings,
            parameters,
            groups,
            stated: DMatrix::from_fn(n, n, |i, j| {
                own[(indices[i], indices[j])] / (prior(i) * prior(j))
            }),
            // A mean that is far from what all recordings say is no difference between them.
            prior: DVector::from_fn(n * (1 + functions), |k, _| {
                if k < n { widest[k].powi(-2) } else { 1.0 }
            }),
        })
    }

    /// The likelihood with variances of some groups in excess of the stated ones, and its slope with respect to that of
    /// one; the information excludes the common quantities. `None` if rounding makes a matrix singular.
    fn slope(&self, found: &[Component], group: usize) -> Option<Slope> {
        let mut own = self.stated.clone();
        for (i, &(group, prior)) in self.parameters.iter().enumerate() {
            let of_group = found.iter().filter(|one| one.place == group);
            own[(i, i)] += of_group.map(|one| one.variance / prior).sum::<f64>();
        }
        let parameters = self.parameters.iter().enumerate();
        let of_group = parameters.filter(|(_, of)| of.0 == group);
        let (columns, sigma): (Vec<usize>, Vec<f64>) =
            of_group.map(|(i, of)| (i, of.1.sqrt().recip())).unzip();
        let scale = DMatrix::from_diagonal(&sigma.into());
        let mut information = DMatrix::from_diagonal(&self.prior);
        let mut right = DVector::zeros(self.prior.len());
        let mut deviance = 0.0;
        let mut whitened = Vec::with_capacity(self.recordings.len());
        for evidence in &self.recordings {
            let m = evidence.values.len();
            let covariance =
                DMatrix::identity(m, m) + &evidence.by_own * &own * evidence.by_own.transpose();
            let root = covariance.cholesky()?.unpack();
            let by_group = evidence.by_own.select_columns(&columns) * &scale;
            let by_group = root.solve_lower_triangular(&by_group)?;
            let by_common = root.solve_lower_triangular(&evidence.by_common)?;
            let values = root.solve_lower_triangular(&evidence.values)?;
            deviance += 2.0 * root.diagonal().map(f64::ln).sum() + values.norm_squared();
            information += by_common.tr_mul(&by_common);
            right += by_common.tr_mul(&values);
            whitened.push((by_group, by_common, values));
        }
        let root = information.cholesky()?;
        let common = root.solve(&right);
        let root = root.unpack();
        deviance += 2.0 * root.diagonal().map(f64::ln).sum() - right.dot(&common);
        let (mut score, mut information) = (0.0, 0.0);
        for (by_group, by_common, values) in &whitened {
            let unexplained = by_group.tr_mul(&(values - by_common * &common));
            let told = root.solve_lower_triangular(&by_common.tr_mul(by_group))?;
            let expected = by_group.tr_mul(by_group) - told.tr_mul(&told);
            score += 0.5 * (unexplained.norm_squared() - expected.trace());
            information += 0.5 * expected.norm_squared();
        }
        Some(Slope {
            deviance,
            score,
            information,
        })
    }

    /// The groups with a likelihood ratio beyond this limit, with variance and ratio; `None` if there are none.
    fn found(&self, limit: f64) -> Option<Vec<(Group, f64, f64)>> {
        let (found, _) = likeliest(self.groups.len(), limit, |found, group| {
            self.slope(found, group)
        })?;
        let deviance = |found: &[Component]| Some(self.slope(found, 0)?.deviance);
        // What −2 ln of the likelihood loses by a group, the others' variances held.
        let of_group = |one: &Component| {
            let others = found.iter().filter(|other| other.place != one.place);
            let without: Vec<Component> = others.copied().collect();
            let ratio = deviance(&without)? - deviance(&found)?;
            Some((self.groups[one.place], one.variance, ratio))
        };
        // One that came in first may be explained by those after it.
        let each = found.iter().filter_map(of_group);
        let found: Vec<_> = each.filter(|&(.., ratio)| ratio > limit).collect();
        (!found.is_empty()).then_some(found)
    }
}

/// Deviation of an estimate from the prior mean, and its covariance, in prior σ.
fn in_prior_sigma(
    estimate: &Estimate,
    model: &Model,
    indices: &[usize],
) -> (DVector<f64>, DMatrix<f64>) {
    let n = indices.len();
    let off = estimate.vector() - model.prior_mean;
    let sigma = |i: usize| model.prior_sigma[indices[i]];
    (
        DVector::from_fn(n, |i, _| off[indices[i]] / sigma(i)),
        DMatrix::from_fn(n, n, |i, j| {
            estimate.covariance[(indices[i], indices[j])] / (sigma(i) * sigma(j))
        }),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// Of the prior, where each recording alone knows a parameter to 1.
    const PRIOR: f64 = 100.0;

    /// Ten parameters of one group in eight recordings with a linear change, each alone known to 1 or, of the first
    /// recording, only the sum of each two; that differ by `sigma`.
    fn drawn(sigma: f64, seed: u64) -> RecordingsEvidence {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut unit = || -> f64 { StandardNormal.sample(&mut rng) };
        let (n, by) = (10, |a: usize| a as f64 / 4.0 - 1.0);
        let mut normal = |scale: f64| DVector::from_fn(n, |_, _| scale * unit());
        let (constant, slope) = (normal(PRIOR), normal(PRIOR));
        let recordings = (0..8)
            .map(|a| {
                let own = (&constant + &slope * by(a) + normal(sigma)) / PRIOR;
                let by_own = match a {
                    0 => DMatrix::from_fn(n / 2, n, |row, i| {
                        PRIOR * f64::from(u8::from(i / 2 == row))
                    }),
                    _ => DMatrix::identity(n, n) * PRIOR,
                };
                let mut common = DMatrix::identity(n, 2 * n);
                common.view_mut((0, n), (n, n)).fill_diagonal(by(a));
                RecordingEvidence {
                    values: &by_own * own + normal(1.0).rows(0, by_own.nrows()),
                    by_common: &by_own * common,
                    by_own,
                }
            })
            .collect();
        RecordingsEvidence {
            recordings,
            parameters: vec![(0, PRIOR.powi(2)); n],
            groups: Group::all().take(1).collect(),
            stated: DMatrix::zeros(n, n),
            prior: DVector::from_element(2 * n, 1.0),
        }
    }

    #[test]
    fn the_slope_of_the_likelihood_is_its_derivative() {
        let evidence = drawn(2.0, 1);
        let at = |variance: f64| {
            let (place, spread) = (0, 0.0);
            let found = Component {
                place,
                variance,
                spread,
            };
            evidence.slope(&[found], 0).unwrap()
        };
        let numeric = (at(2.0 + 1e-4).deviance - at(2.0 - 1e-4).deviance) / 2e-4;
        assert!((-2.0 * at(2.0).score / numeric - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_difference_is_found_within_its_own_error_and_none_where_there_is_none() {
        // Six of eight degrees of freedom are left of each parameter, half a one less for what the first recording
        // does not tell apart: 55, so σ² is known to √(2/55) of itself.
        let runs = 200;
        let mut sum = 0.0;
        for seed in 0..runs {
            let found = drawn(2.0, seed)
                .found(chi_square_limit(1.0, FALSE_ALARM))
                .unwrap();
            sum += found[0].1 / f64::from(runs as u32);
        }
        let expected = 5.0 * (2.0f64 / 55.0).sqrt() / f64::from(runs as u32).sqrt();
        assert!((sum - 4.0).abs() < 4.0 * expected, "{sum} ± {expected}");
        let beyond = (0..runs).filter(|&seed| {
            drawn(0.0, seed)
                .found(chi_square_limit(1.0, 0.05))
                .is_some()
        });
        // One in twenty by a test of two sides, of which only one counts: five of 200, and 13 in one of a thousand.
        let beyond = beyond.count();
        assert!(beyond <= 13, "{beyond}");
    }

    #[test]
    fn what_a_recording_does_not_tell_apart_is_no_difference() {
        // It saw the sum of two parameters of which the first is 3 prior σ off, and shares it by their prior.
        let covariance =
            DMatrix::from_row_slice(2, 2, &[0.5, -0.5, -0.5, 0.5]) + DMatrix::identity(2, 2) * 1e-6;
        let evidence = RecordingEvidence::new(
            (&DVector::from_vec(vec![1.5, 1.5]), covariance),
            &DMatrix::identity(2, 2),
        )
        .unwrap();
        assert_eq!(evidence.values.len(), 1);
        let off = (&evidence.by_own * DVector::from_vec(vec![3.0, 0.0]) - &evidence.values)[0];
        assert!(off.abs() < 0.01, "{off}");
    }
}
