//! Average over effects that may be absent and whose size is not known, such as error terms and temperature orders.
//!
//! A group of constants is absent with a prior probability, usually one half; otherwise it has its usual size, known to
//! a factor of three. The posterior of all constants is the average over these cases. With many groups, the average is found as in
//! expectation propagation (Minka 2001, "Expectation propagation for approximate Bayesian inference", UAI 17): each
//! group gets the normal prior about zero for which its mean equals that of the average over its own cases, given the
//! priors of all others. The covariance is then the covariance within the cases plus the covariance between the cases.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::calibration::constants::{Information, inverse};

/// Sizes over the usual one: every half power of three up to the factor 3^(3/2), with triangular weights over their
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
/// The largest size divided by the usual size.
pub const LARGEST: f64 = SIZES[6].0;
/// Smallest variance of a prior: an absent constant is zero to a millionth of its usual size.
const NOTHING: f64 = 1e-12;
/// Prior probability that a group is absent, if nothing is known.
pub const ABSENT: f64 = 0.5;
/// Maximum number of rounds over all groups.
const ROUNDS: usize = 100;
/// The average has settled if no probability of absence changes by more than this.
const SETTLED: f64 = 1e-5;

/// The average over all cases of groups of constants, in units of their usual sizes.
#[derive(Debug, Clone, PartialEq)]
pub struct Average {
    /// Inverse covariance of each group's normal prior, block by block.
    pub precision: DMatrix<f64>,
    /// Covariance between the cases of each group, multiplied from both sides by the inverse covariance within the
    /// cases.
    pub between: DMatrix<f64>,
    /// Probability of absence for each group.
    pub absent: Vec<f64>,
    /// The same, without data.
    prior_absent: Vec<f64>,
}

/// A mean with its covariance.
struct Moments {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Average {
    /// A starting point in which every group is present, with this size divided by the usual size, and with its prior
    /// probability of absence.
    pub fn begun(groups: &[Vec<usize>], sizes: &[f64], prior_absent: Vec<f64>) -> Self {
        let n = groups.iter().map(Vec::len).sum();
        let mut precision = DMatrix::zeros(n, n);
        for (places, size) in groups.iter().zip(sizes) {
            for &place in places {
                precision[(place, place)] = size.powi(-2);
            }
        }
        Self {
            precision,
            between: DMatrix::zeros(n, n),
            absent: prior_absent.clone(),
            prior_absent,
        }
    }

    /// The average, given the information on all groups from the data; the calculation starts from this average. Each
    /// group is given by its positions among the constants. Returns `None` if the covariance of a group is not positive
    /// definite.
    pub fn given(mut self, data: &Information, groups: &[Vec<usize>]) -> Option<Self> {
        for _ in 0..ROUNDS {
            let mut now = self.moments(data)?;
            let mut most = 0.0f64;
            for (k, places) in groups.iter().enumerate() {
                let others = self.others(places, &now)?;
                let cases = Cases::of(&others, self.prior_absent[k]);
                most = most.max((cases.absent - self.absent[k]).abs());
                self.absent[k] = cases.absent;
                set(&mut self.between, places, &cases.between);
                let before = of(&self.precision, places);
                set(&mut self.precision, places, &cases.precision);
                now.update(places, &(cases.precision - before))?;
            }
            if most < SETTLED {
                break;
            }
        }
        Some(self)
    }

    /// Mean and covariance of all.
    fn moments(&self, data: &Information) -> Option<Moments> {
        let (covariance, _) = inverse(&(&data.matrix + &self.precision))?;
        Some(Moments {
            mean: &covariance * &data.vector,
            covariance,
        })
    }

    /// Information on a group from the data and all other groups.
    fn others(&self, places: &[usize], now: &Moments) -> Option<Information> {
        let inverse = Cholesky::new(of(&now.covariance, places))?.inverse();
        Some(Information {
            vector: &inverse * now.mean.select_rows(places),
            matrix: inverse - of(&self.precision, places),
        })
    }
}

fn of(matrix: &DMatrix<f64>, places: &[usize]) -> DMatrix<f64> {
    matrix.select_rows(places).select_columns(places)
}

fn set(matrix: &mut DMatrix<f64>, places: &[usize], block: &DMatrix<f64>) {
    for (row, &i) in places.iter().enumerate() {
        for (column, &j) in places.iter().enumerate() {
            matrix[(i, j)] = block[(row, column)];
        }
    }
}

impl Moments {
    /// Changes the prior of a group (Woodbury's identity).
    fn update(&mut self, places: &[usize], change: &DMatrix<f64>) -> Option<()> {
        let across = self.covariance.select_columns(places);
        let own = across.select_rows(places);
        let n = places.len();
        let inverse = (DMatrix::identity(n, n) + change * own).try_inverse()?;
        // (P⁻¹ + ΔS)⁻¹ = P − P_g (I + ΔS P_gg)⁻¹ ΔS P_gᵀ
        let gain = &across * inverse * change;
        self.mean -= &gain * self.mean.select_rows(places);
        self.covariance -= gain * across.transpose();
        Some(())
    }
}

/// The cases of a group, given the information from all others.
struct Cases {
    /// Probability that the group is absent.
    absent: f64,
    /// Inverse covariance of the normal prior, as in [`Average`].
    precision: DMatrix<f64>,
    between: DMatrix<f64>,
}

impl Cases {
    fn of(others: &Information, prior_absent: f64) -> Self {
        let n = others.vector.len();
        // Computed along the directions that the others determine independently.
        let turned = others.matrix.clone().symmetric_eigen();
        let said = turned.eigenvectors.tr_mul(&others.vector);
        let known = turned.eigenvalues.map(|value| value.max(0.0));
        let mut weights = vec![prior_absent.ln()];
        let mut variances = vec![DVector::zeros(n)];
        for (size, weight) in SIZES {
            let variance = known.map(|known| (known + size.powi(-2)).recip());
            let likelihood: f64 = (0..n)
                .map(|k| variance[k] * said[k].powi(2) - (1.0 + size.powi(2) * known[k]).ln())
                .sum();
            weights.push(((1.0 - prior_absent) * weight).ln() + 0.5 * likelihood);
            variances.push(variance);
        }
        let largest = weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        weights
            .iter_mut()
            .for_each(|of| *of = (*of - largest).exp());
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|of| *of /= sum);
        let mut within = DVector::zeros(n);
        // 1 − known · variance, without the rounding of a difference.
        let mut open = DVector::from_element(n, weights[0]);
        for ((weight, variance), (size, _)) in weights.iter().zip(&variances).skip(1).zip(SIZES) {
            within.axpy(*weight, variance, 1.0);
            open.axpy(weight * size.powi(-2), variance, 1.0);
        }
        within.axpy(NOTHING, &open, 1.0);
        // The mean of a case is its variance times the information vector of the others, so the overall mean follows
        // from the mean variance.
        let mut between = DMatrix::zeros(n, n);
        for (weight, variance) in weights.iter().zip(&variances) {
            let off = (variance - &within)
                .component_mul(&said)
                .component_div(&within);
            between.ger(*weight, &off, &off, 1.0);
        }
        let back = &turned.eigenvectors;
        let precision = DMatrix::from_diagonal(&open.component_div(&within));
        Self {
            absent: weights[0],
            precision: back * precision * back.transpose(),
            between: back * between * back.transpose(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Information of correlated rows on two terms of these sizes, with two other constants.
    fn seen(terms: [f64; 2]) -> Information {
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
        Information {
            vector: vector.rows(2, 2) - &across * vector.rows(0, 2),
            matrix: information.view((2, 2), (2, 2)) - across * information.view((0, 2), (2, 2)),
        }
    }

    /// Mean, covariance and probabilities.
    struct Whole {
        mean: DVector<f64>,
        covariance: DMatrix<f64>,
        absent: Vec<f64>,
    }

    fn by_propagation(data: &Information, groups: &[Vec<usize>]) -> Whole {
        let found = Average::begun(groups, &vec![1.0; groups.len()], vec![ABSENT; groups.len()])
            .given(data, groups)
            .unwrap();
        let Moments { mean, covariance } = found.moments(data).unwrap();
        let between = &covariance * &found.between * &covariance;
        Whole {
            mean,
            covariance: covariance + between,
            absent: found.absent,
        }
    }

    /// The average over all cases, each case solved alone; one constant a group.
    fn by_cases(data: &Information) -> Whole {
        let cases: Vec<(f64, f64)> = std::iter::once((0.0, ABSENT))
            .chain(SIZES.map(|(size, weight)| (size, (1.0 - ABSENT) * weight)))
            .collect();
        let n = data.vector.len();
        let (mut sum, mut mean) = (0.0, DVector::zeros(n));
        let mut squares = DMatrix::zeros(n, n);
        let mut absent = vec![0.0; n];
        for number in 0..cases.len().pow(n as u32) {
            let case = |k: usize| cases[number / cases.len().pow(k as u32) % cases.len()];
            let mut information = data.matrix.clone();
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
            let data = Information {
                matrix: both.matrix.view((0, 0), (1, 1)).into_owned(),
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
        let data = Information {
            matrix: DMatrix::zeros(1, 1),
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
