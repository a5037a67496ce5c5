//! Spread of units beyond their own σ.
//!
//! Unit k's value is `μ + τ a + σ_k b`, a and b standard normal: τ is the spread of the lot. With
//! `w_k = 1/(τ² + σ_k²)` and the weighted mean `m`, `Q(τ²) = Σ w_k (x_k − m)²` follows χ² of n − 1 degrees of
//! freedom at the true τ and falls with τ²: τ is where Q is n − 1 (Paule, Mandel, *J. Res. NBS* 87, 1982, 377),
//! its interval where Q is at the quantiles of χ² (Viechtbauer, *Statistics in Medicine* 26, 2007, 37).

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::calibration::ChiSquare;

/// Probability outside the interval of a spread, half on each side.
const OUTSIDE: f64 = 0.05;

/// The spread of a lot, without the σ of its units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spread {
    /// 1σ from unit to unit; zero if the units' own σ explain the scatter.
    pub value: f64,
    /// Its own 1σ; `None` if it is zero.
    pub sigma: Option<f64>,
    /// 95 % interval.
    pub interval: (f64, f64),
}

/// Mean and scatter of values with their own σ.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Scatter {
    /// Mean, weighted by spread and own σ.
    pub mean: f64,
    /// Its 1σ.
    pub mean_sigma: f64,
    /// Sample standard deviation, the units' σ included.
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

/// Mean and scatter of values with their variances; `None` for fewer than two.
pub fn scatter(samples: &[(f64, f64)]) -> Option<Scatter> {
    let freedom = samples.len().checked_sub(1).filter(|n| *n > 0)?;
    let n = freedom as f64;
    let centre = samples.iter().map(|s| s.0).sum::<f64>() / (n + 1.0);
    let variance = samples.iter().map(|s| (s.0 - centre).powi(2)).sum::<f64>() / n;
    let largest = samples.iter().map(|s| s.1).fold(0.0, f64::max);
    if variance + largest <= 0.0 {
        // All the same, and without σ.
        return Some(Scatter {
            mean: centre,
            ..Scatter::default()
        });
    }
    let chi2 = ChiSquared::new(n).ok()?;
    let at = |q: f64| spread_where(samples, q, variance + largest);
    let spread = at(n);
    let value = spread.sqrt();
    let spread = spread.max(f64::MIN_POSITIVE);
    let (weights, mean, _) = weighted(samples, spread);
    // The slope of Q at the true spread, in the mean.
    let squares: f64 = samples.iter().map(|s| (spread + s.1).powi(-2)).sum();
    let slope = weights - squares / weights;
    let all_have_sigma = samples.iter().all(|s| s.1 > 0.0);
    Some(Scatter {
        mean,
        mean_sigma: weights.recip().sqrt(),
        deviation: variance.sqrt(),
        chi_square: all_have_sigma
            .then(|| weighted(samples, 0.0).2)
            .and_then(|value| ChiSquare::new(value, freedom)),
        spread: Spread {
            value,
            sigma: (value > 0.0).then(|| (2.0 * n).sqrt() / slope / (2.0 * value)),
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
    // As many halvings as the digits of a floating-point number, on a logarithmic scale.
    for _ in 0..64 {
        let middle = (low * high).sqrt();
        match above(middle) {
            true => low = middle,
            false => high = middle,
        }
    }
    (low * high).sqrt()
}
