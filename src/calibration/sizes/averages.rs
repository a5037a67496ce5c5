//! Average over effects that may be absent and whose size is not known: error terms, temperature orders.
//!
//! A group of constants is absent with probability one half, else of its usual size, which is known to a factor three.
//! The posterior of all constants is the average over these cases. With many groups it is found by expectation
//! propagation (Minka 2001, "Expectation propagation for approximate Bayesian inference", UAI 17): the prior of each
//! group becomes the normal factor with which the average over its own cases has the right mean and covariance, given
//! those of all others. For one group this is exact.

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use crate::calibration::constants::Sites;

/// Sizes over the usual one: every half power of three to the factor 3^(3/2), with weights of a triangle over their
/// logarithms.
const SIZES: [(f64, f64); 7] = [
    (0.192_450_089_729_875_26, 1.0 / 16.0),
    (0.333_333_333_333_333_3, 2.0 / 16.0),
    (0.577_350_269_189_625_8, 3.0 / 16.0),
    (1.0, 4.0 / 16.0),
    (1.732_050_807_568_877_2, 3.0 / 16.0),
    (3.0, 2.0 / 16.0),
    (5.196_152_422_706_632, 1.0 / 16.0),
];
/// The largest size over the usual one.
pub const LARGEST: f64 = SIZES[6].0;
/// Prior probability that a group is absent.
const ABSENT: f64 = 0.5;
/// Most rounds over all groups …
const ROUNDS: usize = 100;
/// … of which this many go to where each group leads, later ones half the way.
const WHOLE: usize = 20;
/// A change of the probability that any group is absent by less than this has settled.
const SETTLED: f64 = 1e-8;

/// Information below this part of the largest is rounding.
const ROUNDING: f64 = 1e-9;

/// The average over all cases of groups of constants, in units of their usual sizes.
#[derive(Debug, Clone, PartialEq)]
pub struct Average {
    /// The normal factor in place of the prior of each group, block by block.
    pub sites: Sites,
    /// Probability that each group is absent.
    pub absent: Vec<f64>,
}

/// A mean with its covariance.
struct Moments {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Average {
    /// Every group present with this size over the usual one.
    pub fn begun(groups: &[Vec<usize>], sizes: &[f64]) -> Self {
        let n = groups.iter().map(Vec::len).sum();
        let mut information = DMatrix::zeros(n, n);
        for (places, size) in groups.iter().zip(sizes) {
            for &place in places {
                information[(place, place)] = size.powi(-2);
            }
        }
        Self {
            sites: Sites {
                information,
                vector: DVector::zeros(n),
            },
            absent: vec![ABSENT; groups.len()],
        }
    }

    /// The average given what data say of all groups, each with its places among the constants, begun at this one; `None` if
    /// the two contradict each other beyond rounding.
    pub fn given(mut self, data: &Sites, groups: &[Vec<usize>]) -> Option<Self> {
        for round in 0..ROUNDS {
            let mut now = self.moments(data)?;
            let mut most = 0.0f64;
            for (k, places) in groups.iter().enumerate() {
                let Some((site, absent)) = self.of_group(places, &now) else {
                    continue;
                };
                let fraction = if round < WHOLE { 1.0 } else { 0.5 };
                most = most.max((absent - self.absent[k]).abs());
                self.absent[k] = absent;
                let change = self.replace(places, &site, fraction);
                now.update(places, &change)?;
            }
            if most < SETTLED {
                break;
            }
        }
        self.moments(data).map(|_| self)
    }

    /// Mean and covariance of all.
    fn moments(&self, data: &Sites) -> Option<Moments> {
        let information = &data.information + &self.sites.information;
        let scale = information.diagonal().map(|value| value.sqrt().recip());
        let n = scale.len();
        let scaled = DMatrix::from_fn(n, n, |i, j| information[(i, j)] * scale[i] * scale[j]);
        let inverse = Cholesky::new(scaled)?.inverse();
        let covariance = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        Some(Moments {
            mean: &covariance * (&data.vector + &self.sites.vector),
            covariance,
        })
    }

    /// The factor of a group that gives its average over all cases, given all others, and the probability that it is
    /// absent; `None` if the others do not allow one yet.
    fn of_group(&self, places: &[usize], now: &Moments) -> Option<(Sites, f64)> {
        let cavity = self.cavity(places, now)?;
        let (average, absent) = cases(&cavity)?;
        let inverse = Cholesky::new(average.covariance)?.inverse();
        let site = Sites {
            vector: &inverse * average.mean - cavity.vector,
            information: inverse - cavity.information,
        };
        Some((site, absent))
    }

    /// What all others say of a group.
    fn cavity(&self, places: &[usize], now: &Moments) -> Option<Sites> {
        let own = now.covariance.select_rows(places).select_columns(places);
        let inverse = Cholesky::new(own)?.inverse();
        let (information, vector) = self.site(places);
        Some(Sites {
            vector: &inverse * now.mean.select_rows(places) - vector,
            information: inverse - information,
        })
    }

    fn site(&self, places: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
        let Sites {
            information,
            vector,
        } = &self.sites;
        let information = information.select_rows(places).select_columns(places);
        (information, vector.select_rows(places))
    }

    /// Moves the factor of a group a fraction of the way to another; returns the change.
    fn replace(&mut self, places: &[usize], site: &Sites, fraction: f64) -> Sites {
        let (information, vector) = self.site(places);
        let change = Sites {
            information: (&site.information - information) * fraction,
            vector: (&site.vector - vector) * fraction,
        };
        for (row, &i) in places.iter().enumerate() {
            self.sites.vector[i] += change.vector[row];
            for (column, &j) in places.iter().enumerate() {
                self.sites.information[(i, j)] += change.information[(row, column)];
            }
        }
        change
    }
}

impl Moments {
    /// With the factor of a group changed (Woodbury's identity).
    fn update(&mut self, places: &[usize], change: &Sites) -> Option<()> {
        let across = self.covariance.select_columns(places);
        let own = across.select_rows(places);
        let n = places.len();
        let inverse = (DMatrix::identity(n, n) + &change.information * own).try_inverse()?;
        let gain = &across * &inverse;
        // (P⁻¹ + ΔS)⁻¹ (P⁻¹ m + Δη) = m + P_g (I + ΔS P_gg)⁻¹ (Δη − ΔS m_g)
        let mean = self.mean.select_rows(places);
        self.mean += &gain * (&change.vector - &change.information * mean);
        self.covariance -= gain * &change.information * across.transpose();
        Some(())
    }
}

/// Mean and covariance of a group over its cases, given what all others say, and the probability that it is absent.
fn cases(cavity: &Sites) -> Option<(Moments, f64)> {
    let n = cavity.vector.len();
    // Along the directions that the others determine independently.
    let turned = SymmetricEigen::try_new(cavity.information.clone(), f64::EPSILON, 0)?;
    let largest = turned.eigenvalues.amax();
    if turned.eigenvalues.min() < -ROUNDING * largest {
        return None;
    }
    let told = turned.eigenvectors.tr_mul(&cavity.vector);
    let known = turned.eigenvalues.map(|value| value.max(0.0));
    let mut weights = vec![ABSENT.ln()];
    let mut means = vec![DVector::zeros(n)];
    let mut variances = vec![DVector::zeros(n)];
    for (size, weight) in SIZES {
        let variance = known.map(|known| (known + size.powi(-2)).recip());
        let mean = variance.component_mul(&told);
        let likelihood = 0.5
            * (0..n)
                .map(|k| mean[k] * told[k] - (1.0 + size.powi(2) * known[k]).ln())
                .sum::<f64>();
        weights.push(((1.0 - ABSENT) * weight).ln() + likelihood);
        means.push(mean);
        variances.push(variance);
    }
    let largest = weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = weights
        .iter()
        .map(|weight| (weight - largest).exp())
        .collect();
    let sum: f64 = weights.iter().sum();
    let mut mean = DVector::zeros(n);
    let mut squares = DMatrix::zeros(n, n);
    for ((weight, of), variance) in weights.iter().zip(&means).zip(&variances) {
        let weight = weight / sum;
        mean.axpy(weight, of, 1.0);
        squares += (of * of.transpose() + DMatrix::from_diagonal(variance)) * weight;
    }
    let covariance = squares - &mean * mean.transpose();
    let back = turned.eigenvectors;
    let covariance = &back * covariance * back.transpose();
    let mean = back * mean;
    Some((Moments { mean, covariance }, weights[0] / sum))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What correlated rows say of two terms of these sizes beside two other constants.
    fn seen(terms: [f64; 2]) -> Sites {
        let rows = DMatrix::from_row_slice(
            6,
            4,
            &[
                1.0, 0.0, 0.8, 0.0, 0.0, 1.0, 0.0, 0.6, 1.0, 1.0, 0.2, 0.1, 0.5, 0.0, -0.3, 0.4,
                0.0, 0.7, 0.2, 0.9, 0.3, 0.3, 0.9, 0.5,
            ],
        ) * 3.0;
        let truth = DVector::from_vec(vec![0.3, -0.2, terms[0], terms[1]]);
        let vector = rows.tr_mul(&(&rows * truth));
        let information = rows.tr_mul(&rows);
        let others = information.view((0, 0), (2, 2)).into_owned().try_inverse();
        let across = information.view((2, 0), (2, 2)) * others.unwrap();
        Sites {
            vector: vector.rows(2, 2) - &across * vector.rows(0, 2),
            information: information.view((2, 2), (2, 2))
                - across * information.view((0, 2), (2, 2)),
        }
    }

    /// Mean, covariance and probabilities.
    struct Whole {
        mean: DVector<f64>,
        covariance: DMatrix<f64>,
        absent: Vec<f64>,
    }

    fn by_propagation(data: &Sites, groups: &[Vec<usize>]) -> Whole {
        let found = Average::begun(groups, &vec![1.0; groups.len()])
            .given(data, groups)
            .unwrap();
        let Moments { mean, covariance } = found.moments(data).unwrap();
        Whole {
            mean,
            covariance,
            absent: found.absent,
        }
    }

    /// The average over all cases, each case solved alone; one constant a group.
    fn by_cases(data: &Sites) -> Whole {
        let cases: Vec<(f64, f64)> = std::iter::once((0.0, ABSENT))
            .chain(SIZES.map(|(size, weight)| (size, (1.0 - ABSENT) * weight)))
            .collect();
        let n = data.vector.len();
        let (mut sum, mut mean) = (0.0, DVector::zeros(n));
        let mut squares = DMatrix::zeros(n, n);
        let mut absent = vec![0.0; n];
        for number in 0..cases.len().pow(n as u32) {
            let case = |k: usize| cases[number / cases.len().pow(k as u32) % cases.len()];
            let mut information = data.information.clone();
            let mut weight = 1.0f64;
            for k in 0..n {
                let size = case(k).0.max(1e-7);
                weight *= case(k).1 / size;
                information[(k, k)] += size.powi(-2);
            }
            let covariance = information.try_inverse().unwrap();
            let of = &covariance * &data.vector;
            weight *= covariance.determinant().sqrt() * (0.5 * of.dot(&data.vector)).exp();
            sum += weight;
            mean += &of * weight;
            squares += (&covariance + &of * of.transpose()) * weight;
            (0..n)
                .filter(|&k| case(k).0 == 0.0)
                .for_each(|k| absent[k] += weight);
        }
        mean /= sum;
        Whole {
            covariance: squares / sum - &mean * mean.transpose(),
            absent: absent.iter().map(|of| of / sum).collect(),
            mean,
        }
    }

    #[test]
    fn one_group_is_averaged_exactly() {
        for size in [0.0, 0.1, 1.0, 3.0] {
            let both = seen([size, 0.0]);
            let data = Sites {
                information: both.information.view((0, 0), (1, 1)).into_owned(),
                vector: both.vector.rows(0, 1).into_owned(),
            };
            let (found, expected) = (by_propagation(&data, &[vec![0]]), by_cases(&data));
            assert!((found.mean - expected.mean).amax() < 1e-6, "{size}");
            let off = (found.covariance - expected.covariance).amax();
            assert!(off < 1e-6, "{size}: {off}");
            let off = (found.absent[0] - expected.absent[0]).abs();
            assert!(off < 1e-6, "{size}: {off}");
        }
    }

    #[test]
    fn two_groups_that_are_seen_together_are_averaged_within_a_twentieth_of_sigma() {
        for sizes in [[0.0, 0.0], [0.5, 0.0], [0.3, 0.3], [0.0, 2.0], [1.0, -1.0]] {
            let data = seen(sizes);
            let groups = [vec![0], vec![1]];
            let (found, expected) = (by_propagation(&data, &groups), by_cases(&data));
            for k in 0..2 {
                let (one, other) = (found.covariance[(k, k)], expected.covariance[(k, k)]);
                let sigma = other.sqrt();
                let off = (found.mean[k] - expected.mean[k]).abs() / sigma;
                assert!(off < 0.05, "{sizes:?} {k}: {off} σ");
                let ratio = one.sqrt() / sigma;
                assert!((ratio - 1.0).abs() < 0.05, "{sizes:?} {k}: σ × {ratio}");
            }
        }
    }

    #[test]
    fn what_is_not_seen_at_all_stays_at_its_prior() {
        let data = Sites {
            information: DMatrix::zeros(1, 1),
            vector: DVector::zeros(1),
        };
        let found = by_propagation(&data, &[vec![0]]);
        let mean_square: f64 = SIZES
            .iter()
            .map(|(size, weight)| weight * size.powi(2))
            .sum();
        let expected = (1.0 - ABSENT) * mean_square;
        assert!((found.covariance[(0, 0)] / expected - 1.0).abs() < 1e-9);
        assert!((found.absent[0] - ABSENT).abs() < 1e-9);
    }
}
