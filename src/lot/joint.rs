//! Scatter of all parameters, including their correlations.

use nalgebra::{DMatrix, DVector};

use super::scatter::ChiSquare;
use crate::calibration::result::nees::Directions;

/// χ² of vectors about their weighted mean, with the covariance of each: the sum over all vectors of the squared
/// distance from the mean of the preceding vectors, normalised by the sum of both covariances. Directions that have no
/// σ are left out. `None` for fewer than two vectors, or if a matrix is not a covariance.
pub fn joint(all: impl IntoIterator<Item = (DVector<f64>, DMatrix<f64>)>) -> Option<ChiSquare> {
    let mut all = all.into_iter();
    let (mut mean, mut of_mean) = all.next()?;
    let indices: Vec<usize> = (0..mean.len()).collect();
    let (mut sum, mut freedom) = (0.0, 0);
    for (vector, covariance) in all {
        let directions = Directions::new(&(&of_mean + covariance), &indices)?;
        let distance = vector - &mean;
        let squares = directions.squares(distance.as_view());
        sum += squares.iter().sum::<f64>();
        freedom += squares.len();
        let gain = &of_mean * directions.inverse();
        mean += &gain * distance;
        of_mean -= &gain * of_mean.clone();
    }
    ChiSquare::new(sum, freedom)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const SIZE: usize = 6;

    /// Vectors that scatter by `factor` times their covariance, which differs between them.
    fn drawn(count: usize, factor: f64) -> Vec<(DVector<f64>, DMatrix<f64>)> {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let draws = (0..count).map(|_| {
            let root = DMatrix::from_fn(SIZE, SIZE, |i, j| {
                f64::from(u8::from(i == j)) + 0.3 * normal()
            });
            let white = DVector::from_fn(SIZE, |_, _| factor * normal());
            (&root * white, &root * root.transpose())
        });
        draws.collect()
    }

    #[test]
    fn scatter_of_true_covariances_is_inside_its_interval_and_of_wrong_ones_is_not() {
        let p = |factor| {
            let found = joint(drawn(40, factor)).unwrap();
            assert_eq!(found.freedom, SIZE * 39);
            found.p
        };
        assert!((0.005..0.995).contains(&p(1.0)));
        assert!(p(1.3) < 1e-6 && p(0.7) > 1.0 - 1e-4);
    }

    #[test]
    fn it_is_the_sum_of_squares_about_the_weighted_mean_in_any_order() {
        let mut all = drawn(5, 1.0);
        let inverses: Vec<DMatrix<f64>> = { all.iter() }
            .map(|(_, p)| p.clone().try_inverse().unwrap())
            .collect();
        let weights = inverses
            .iter()
            .fold(DMatrix::zeros(SIZE, SIZE), |a, w| a + w);
        let pairs = || all.iter().zip(&inverses);
        let sum = pairs().fold(DVector::zeros(SIZE), |a, ((x, _), w)| a + w * x);
        let mean = weights.try_inverse().unwrap() * sum;
        let squares = pairs().map(|((x, _), w)| (x - &mean).dot(&(w * (x - &mean))));
        let expected: f64 = squares.sum();
        let found = joint(all.clone()).unwrap().value;
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        all.reverse();
        let reversed = joint(all).unwrap().value;
        assert!((reversed / expected - 1.0).abs() < 1e-9, "{reversed}");
    }

    #[test]
    fn directions_without_sigma_are_left_out() {
        let singular = DMatrix::from_element(2, 2, 1.0);
        let at = |x: f64| (DVector::from_element(2, x), singular.clone());
        let found = joint([at(0.0), at(2.0)]).unwrap();
        assert_eq!(found.freedom, 1);
        assert!((found.value - 2.0).abs() < 1e-9, "{found:?}");
    }
}
