//! Order statistics, which are robust against outliers, and limits of χ² and Student's t.

use nalgebra::Vector3;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};
use statrs::function::beta::beta_reg;
use statrs::function::gamma::ln_gamma;
use statrs::statistics::{Data, OrderStatistics};

/// False-alarm rate of a whole list of checks, which is divided among the checks.
pub const FALSE_ALARM: f64 = 1e-3;

/// The σ of a normal distribution divided by the median of its absolute deviations.
pub const SIGMA_OF_MEDIAN: f64 = 1.482_602;

/// The limit that χ² with these degrees of freedom exceeds with probability `chance`; infinite for zero degrees of
/// freedom.
pub fn chi_square_limit(degrees: f64, chance: f64) -> f64 {
    ChiSquared::new(degrees).map_or(f64::INFINITY, |chi2| chi2.inverse_cdf(1.0 - chance))
}

/// ln of the probability that χ² with these degrees of freedom exceeds `x`, accurate even if the probability is tiny.
pub fn ln_survival(freedom: f64, x: f64) -> f64 {
    let (a, z) = (0.5 * freedom, 0.5 * x);
    if z < a + 1.0 {
        return ChiSquared::new(freedom).map_or(0.0, |chi2| chi2.sf(x.max(0.0)).ln());
    }
    // Continued fraction of the incomplete gamma function, NIST Digital Library of Mathematical
    // Functions, §8.9.2, by Lentz's method.
    const TINY: f64 = 1e-300;
    const TERMS: usize = 1000;
    let mut b = z + 1.0 - a;
    let mut c = 1.0 / TINY;
    let mut d = 1.0 / b;
    let mut fraction = d;
    for k in 1..TERMS {
        let k = k as f64;
        let numerator = -k * (k - a);
        b += 2.0;
        let bounded = |value: f64| if value.abs() < TINY { TINY } else { value };
        d = 1.0 / bounded(numerator * d + b);
        c = bounded(b + numerator / c);
        fraction *= d * c;
        if (d * c - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    a * z.ln() - z - ln_gamma(a) + fraction.ln()
}

/// Degrees of freedom above which t equals the normal distribution with its first correction, to 1e-7.
const MANY: f64 = 1e4;

/// The limit that Student's t exceeds with probability `chance` (below one half), for at least one degree of freedom.
///
/// The limit is found by bisection, because Newton's method does not converge for some degrees of freedom. Source:
/// Abramowitz and Stegun, *Handbook of Mathematical Functions*, 26.7.1 and 26.7.5.
pub fn student_limit(degrees: f64, chance: f64) -> f64 {
    if degrees > MANY {
        let z = -Normal::standard().inverse_cdf(chance);
        return z + (z.powi(3) + z) / (4.0 * degrees);
    }
    let degrees = degrees.max(1.0);
    let beyond = |t: f64| 0.5 * beta_reg(0.5 * degrees, 0.5, degrees / (degrees + t * t)) > chance;
    let (mut low, mut high) = (0.0, 1.0);
    while beyond(high) {
        (low, high) = (high, 2.0 * high);
    }
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return high;
        }
        if beyond(middle) {
            low = middle
        } else {
            high = middle
        }
    }
}

/// Factor by which the correlation of successive values increases the variance of their mean, from their correlations at
/// lags 1, 2, …, found from this many values. Correlations count as long as they are significant: those of white noise
/// are beyond the limit with p < 0.3 %.
pub fn correlation_factor(correlations: impl Iterator<Item = f64>, count: usize) -> f64 {
    let chance = 3.0 / (count.max(1) as f64).sqrt();
    1.0 + 2.0 * correlations.take_while(|&of| of > chance).sum::<f64>()
}

/// The median of these numbers; the list is reordered. `None` for an empty list.
pub fn median(values: &mut [f64]) -> Option<f64> {
    (!values.is_empty()).then(|| Data::new(values).median())
}

/// Median of each axis; `None` for an empty list.
pub fn median_of_axes(vectors: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let of = |axis: usize| median(&mut vectors.iter().map(|v| v[axis]).collect::<Vec<_>>());
    Some(Vector3::new(of(0)?, of(1)?, of(2)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// NIST/SEMATECH e-Handbook of Statistical Methods, 1.3.6.7.2.
    #[test]
    fn students_t_is_that_of_the_tables() {
        for (degrees, chance, t) in [
            (1.0, 0.025, 12.706),
            (5.0, 0.025, 2.571),
            (30.0, 0.001, 3.385),
            (100.0, 0.05, 1.660),
        ] {
            assert_relative_eq!(student_limit(degrees, chance), t, epsilon = 5e-4);
        }
    }

    #[test]
    fn of_any_degrees_of_freedom_students_t_is_found_and_falls_with_them() {
        let degrees = (0..20_000).map(|i| 10f64.powf(8.0 * f64::from(i) / 20_000.0));
        let limits: Vec<f64> = degrees.map(|of| student_limit(of, 0.022_75)).collect();
        assert!(limits.windows(2).all(|two| two[1] < two[0] + 1e-6));
        assert_relative_eq!(*limits.last().unwrap(), 2.0, epsilon = 1e-4);
    }

    #[test]
    fn the_tail_of_chi_squared_is_right_where_it_can_be_represented_and_goes_on_beyond() {
        for freedom in [0.7, 1.0, 3.0, 24.0] {
            let chi2 = ChiSquared::new(freedom).unwrap();
            for x in [0.1, 1.0, 10.0, 30.0, 300.0] {
                let expected = chi2.sf(x).ln();
                assert_relative_eq!(ln_survival(freedom, x), expected, max_relative = 1e-9);
            }
        }
        // Two degrees of freedom: exp(−x/2).
        assert_relative_eq!(ln_survival(2.0, 1e5), -5e4, max_relative = 1e-12);
    }
}
