//! Additional noise caused by turning and holding the sensor by hand, estimated from the equations of a calibration
//! with gravity alone.

use nalgebra::{DMatrix, DVector};

use super::likelihood_ratio::limit;
use super::source::Source;
use super::variances::{Component, Slope, likeliest};
use crate::calibration::{Model, Problem};
use crate::statistics::FALSE_ALARM;

/// Sources of hand noise: both kinds of attitude noise in moves, and rotation in dwells.
pub const BY_HAND: [Source; 3] = [
    Source::GyroMotion,
    Source::GyroMoving,
    Source::RotationAtRest,
];

/// Variance that each of [`BY_HAND`] adds to each error, for unit σ in SI and radians.
pub type Parts = [DVector<f64>; BY_HAND.len()];

/// Additional noise that makes the errors more likely than the stated noise.
///
/// The noise is estimated by maximum likelihood, with the parameters integrated out under their prior. If there are
/// only a few more equations than parameters, the residuals do not show the noise, because unlikely parameter values
/// can explain any noise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ByHand {
    found: Vec<Component>,
}

impl ByHand {
    /// Adds sources one by one while the improvement is significant, given the errors of the equations at the prior and
    /// the covariance of these errors due to prior and stated noise.
    pub fn likeliest(
        errors: &DVector<f64>,
        covariance: &DMatrix<f64>,
        parts: &Parts,
    ) -> Option<Self> {
        let slope = |found: &[Component], place: usize| {
            let mut sum = covariance.clone();
            for one in found {
                add(&mut sum, &parts[one.place], one.variance);
            }
            of_errors(errors, sum, &parts[place])
        };
        // Limit of −2 ln of the likelihood ratio for one additional source.
        let limit = limit(0, 1, FALSE_ALARM / BY_HAND.len() as f64);
        let (found, _) = likeliest(BY_HAND.len(), limit, slope)?;
        Some(Self { found })
    }

    /// Whether no source is supported by the data.
    pub fn is_none(&self) -> bool {
        self.found.is_empty()
    }

    /// Whether two results agree: the same sources, with variances equal within a tenth of their uncertainty.
    pub fn is_like(&self, other: &Self) -> bool {
        let alike = |(one, other): (&Component, &Component)| {
            let off = (one.variance / other.variance).ln().abs();
            one.place == other.place && off < 0.1 * one.spread
        };
        self.found.len() == other.found.len() && self.found.iter().zip(&other.found).all(alike)
    }

    /// Subtracts this noise from a covariance.
    pub fn taken_from(&self, covariance: &mut DMatrix<f64>, parts: &Parts) {
        for one in &self.found {
            add(covariance, &parts[one.place], -one.variance);
        }
    }

    /// The model of a problem with this noise.
    pub fn model(&self, problem: &Problem) -> Model {
        let mut model = problem.model.clone();
        for one in &self.found {
            let source = BY_HAND[one.place];
            let sigma = source.sigma(problem).hypot(one.variance.sqrt());
            source.set(&mut model, sigma, 0.0);
        }
        model
    }
}

fn add(covariance: &mut DMatrix<f64>, parts: &DVector<f64>, variance: f64) {
    for (k, part) in parts.iter().enumerate() {
        covariance[(k, k)] += part * variance;
    }
}

/// The likelihood of errors with a covariance, and its slope with respect to a variance with these parts.
fn of_errors(
    errors: &DVector<f64>,
    covariance: DMatrix<f64>,
    parts: &DVector<f64>,
) -> Option<Slope> {
    let factor = covariance.cholesky()?;
    let weighted = factor.solve(errors);
    let (diagonal, inverse) = (factor.l_dirty().diagonal(), factor.inverse());
    let fit = parts.dot(&weighted.component_mul(&weighted));
    let squares = inverse.component_mul(&inverse);
    Some(Slope {
        deviance: errors.dot(&weighted) + 2.0 * diagonal.map(f64::ln).sum(),
        score: 0.5 * (fit - parts.dot(&inverse.diagonal())),
        information: 0.5 * parts.dot(&(squares * parts)),
    })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// So many errors of unit variance, and of noise of moves in the first half.
    fn errors(seed: u64, count: usize, variance: f64) -> DVector<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        DVector::from_fn(count, |k, _| {
            let normal: f64 = StandardNormal.sample(&mut rng);
            let of_moves = if 2 * k < count { variance } else { 0.0 };
            normal * (1.0 + of_moves).sqrt()
        })
    }

    #[test]
    fn noise_of_moves_is_found_at_its_size_and_none_where_there_is_none() {
        const COUNT: usize = 400;
        let of_moves = |k: usize| if 2 * k < COUNT { 1.0 } else { 0.0 };
        let parts = [
            DVector::from_fn(COUNT, |k, _| of_moves(k)),
            DVector::from_element(COUNT, 0.5),
            DVector::from_fn(COUNT, |k, _| 1.0 - of_moves(k)),
        ];
        let covariance = DMatrix::identity(COUNT, COUNT);
        let of = |variance| ByHand::likeliest(&errors(5, COUNT, variance), &covariance, &parts);
        let found = of(8.0).unwrap();
        assert_eq!(found.found.len(), 1, "{found:?}");
        assert_eq!(BY_HAND[found.found[0].place], Source::GyroMotion);
        // 1σ of a variance from 200 numbers is a tenth of it.
        assert!(
            (found.found[0].variance / 8.0 - 1.0).abs() < 0.35,
            "{found:?}"
        );
        assert!(of(0.0).unwrap().is_none());
    }
}
