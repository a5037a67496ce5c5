//! Scatter of values with their own σ.
//!
//! The value k is `μ + τ a + σ_k b` with standard normal a and b, where τ is the spread between units. With
//! `w_k = 1/(τ² + σ_k²)` and the weighted mean `m`, `Q(τ²) = Σ w_k (x_k − m)²` follows χ² with n − 1 degrees of freedom
//! at the true τ and decreases with τ². The estimate of τ is the value at which Q is n − 1 (Paule, Mandel, *J. Res.
//! NBS* 87, 1982, 377), and its interval ends where Q equals quantiles of χ² (Viechtbauer, *Statistics in Medicine* 26,
//! 2007, 37).

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::statistics::student_limit;

/// Probability outside the interval of a spread, half on each side.
const OUTSIDE: f64 = 0.05;
/// Smallest variance of a spread, so that values without σ have finite weights.
const LEAST: f64 = 1e-150;

/// A sum of squares that follows a χ² distribution if the stated σ are correct.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChiSquare {
    /// The sum.
    pub value: f64,
    /// Degrees of freedom.
    pub freedom: usize,
    /// Probability that the sum is at least as large; near zero if the σ are too small, near one if the σ are too
    /// large.
    pub p: f64,
}

impl ChiSquare {
    /// χ² of a sum with its degrees of freedom; `None` if there are no degrees of freedom.
    pub fn new(value: f64, freedom: usize) -> Option<Self> {
        let p = ChiSquared::new(freedom as f64).ok()?.sf(value);
        Some(Self { value, freedom, p })
    }
}

/// The spread between units after subtracting their own σ.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spread {
    /// 1σ from unit to unit; zero if the units' own σ explain the scatter.
    pub value: f64,
    /// 95 % interval.
    pub interval: (f64, f64),
}

/// Mean and scatter of values with their own σ.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Scatter {
    /// Mean, weighted by the spread and each value's own σ.
    pub mean: f64,
    /// 1σ.
    pub mean_sigma: f64,
    /// Sample standard deviation, which includes the σ of the units.
    pub deviation: f64,
    /// χ² of the scatter relative to the stated σ alone; `None` if a value has no σ.
    pub chi_square: Option<ChiSquare>,
    /// The spread from unit to unit.
    pub spread: Spread,
}

/// Sum of weights, weighted mean and Q of values with their variances, for a spread of this variance.
fn weighted(samples: &[(f64, f64)], spread: f64) -> (f64, f64, f64) {
    let weighted = |of: &dyn Fn(f64) -> f64| -> f64 {
        let parts = samples.iter().map(|s| of(s.0) * (spread + s.1).recip());
        parts.sum()
    };
    let weights = weighted(&|_| 1.0);
    let mean = weighted(&|value| value) / weights;
    (weights, mean, weighted(&|value| (value - mean).powi(2)))
}

/// Mean and scatter of values with their variances; `None` for fewer than two values.
pub fn scatter(samples: &[(f64, f64)]) -> Option<Scatter> {
    let freedom = samples.len().checked_sub(1).filter(|n| *n > 0)?;
    let n = freedom as f64;
    let centre = samples.iter().map(|s| s.0).sum::<f64>() / (n + 1.0);
    let variance = samples.iter().map(|s| (s.0 - centre).powi(2)).sum::<f64>() / n;
    let largest = samples.iter().map(|s| s.1).fold(0.0, f64::max);
    if variance + largest <= 0.0 {
        // All values are equal and have no σ.
        return Some(Scatter {
            mean: centre,
            ..Scatter::default()
        });
    }
    let chi2 = ChiSquared::new(n).ok()?;
    let at = |q: f64| spread_where(samples, q, variance + largest);
    let spread = at(n);
    let (weights, mean, _) = weighted(samples, spread.max(LEAST));
    let all_have_sigma = samples.iter().all(|s| s.1 > 0.0);
    Some(Scatter {
        mean,
        mean_sigma: weights.recip().sqrt(),
        deviation: variance.sqrt(),
        chi_square: all_have_sigma
            .then(|| weighted(samples, 0.0).2)
            .and_then(|value| ChiSquare::new(value, freedom)),
        spread: Spread {
            value: spread.sqrt(),
            interval: (
                at(chi2.inverse_cdf(1.0 - 0.5 * OUTSIDE)).sqrt(),
                at(chi2.inverse_cdf(0.5 * OUTSIDE)).sqrt(),
            ),
        },
    })
}

/// The variance of the spread at which Q has this value; zero if Q is below it even without spread.
fn spread_where(samples: &[(f64, f64)], q: f64, scale: f64) -> f64 {
    let above = |spread: f64| weighted(samples, spread).2 > q;
    let (mut low, mut high) = (scale * f64::EPSILON, scale);
    if !above(low) {
        return 0.0;
    }
    while above(high) {
        (low, high) = (high, 2.0 * high);
    }
    // Number of halvings on a logarithmic scale that exhausts the digits of a floating-point number.
    for _ in 0..64 {
        let middle = (low * high).sqrt();
        if above(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low * high).sqrt()
}

/// Indices of outliers, at this false-alarm rate for all values together: the distance of a value from the weighted
/// mean of the others, relative to its σ, follows Student's t (Grubbs, *Technometrics* 11, 1969, 1). Among fewer than
/// three values, there are no outliers.
pub fn outliers(samples: &[(f64, f64)], scatter: &Scatter, false_alarm: f64) -> Vec<usize> {
    let n = samples.len() as f64;
    if n < 3.0 {
        return Vec::new();
    }
    let spread = scatter.spread.value.powi(2).max(LEAST);
    let (weights, mean, q) = weighted(samples, spread);
    let stated: f64 = samples.iter().map(|s| s.1 / (spread + s.1)).sum();
    let limit = student_limit(n - 2.0, 0.5 * false_alarm / n);
    let is_outlier = |&(value, own): &(f64, f64)| {
        let weight = (spread + own).recip();
        let squared = (value - mean).powi(2) * weight / (1.0 - weight / weights);
        // The scatter of the others is not taken to be smaller than their σ imply.
        let scatter = (q - squared) / (n - 2.0);
        let stated = (stated - weight * own) / (n - 1.0);
        squared > limit.powi(2) * scatter.max(stated)
    };
    let places = samples.iter().enumerate();
    places
        .filter(|(_, sample)| is_outlier(sample))
        .map(|(k, _)| k)
        .collect()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    fn outliers_of(samples: &[(f64, f64)], false_alarm: f64) -> Vec<usize> {
        outliers(samples, &scatter(samples).unwrap(), false_alarm)
    }

    #[test]
    fn lots_without_outliers_have_them_named_as_seldom_as_stated() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let (lots, chance) = (2000, 0.05);
        for (count, own) in [(3, 0.0), (6, 0.0), (20, 0.5), (50, 0.0)] {
            let alarms = (0..lots).filter(|_| {
                let draw = |_| (StandardNormal.sample(&mut rng), own);
                let samples: Vec<(f64, f64)> = (0..count).map(draw).collect();
                !outliers_of(&samples, chance).is_empty()
            });
            // 5 % of 2000 is 100 ± 10; more false alarms than four σ above are too many.
            let alarms = alarms.count();
            assert!(alarms < 140 && alarms > 20, "{count}: {alarms}");
        }
    }

    #[test]
    fn an_outlier_is_named_and_a_value_with_a_wide_sigma_of_its_own_is_not() {
        let mut samples: Vec<(f64, f64)> = (0..20).map(|k| (f64::from(k % 5), 1.0)).collect();
        samples.push((60.0, 1.0));
        assert_eq!(outliers_of(&samples, 0.01), [20]);
        samples[20].1 = 900.0;
        assert!(outliers_of(&samples, 0.01).is_empty());
        // Three equal values and a fourth that is off by less than their σ.
        let close = [(0.0, 1.0), (0.0, 1.0), (0.0, 1.0), (0.5, 1.0)];
        assert!(outliers_of(&close, 0.01).is_empty());
        assert!(outliers_of(&[(0.0, 1.0), (90.0, 1.0)], 0.01).is_empty());
    }
}
