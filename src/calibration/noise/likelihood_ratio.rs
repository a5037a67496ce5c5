//! Significance limit of a likelihood ratio.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Half of a 95 % interval, in σ.
pub const INTERVAL: f64 = 1.96;

/// The limit that −2 ln of a likelihood ratio exceeds with the probability `false_alarm`. `two_sided` factors may
/// increase or decrease; `one_sided` factors are at their lower bound of zero. The distribution is a mixture of χ²:
/// each one-sided factor counts with probability one half (Self and Liang 1987, J. Am. Stat. Assoc. 82(398), case 9,
/// with uncorrelated factors).
pub fn limit(two_sided: usize, one_sided: usize, false_alarm: f64) -> f64 {
    let beyond = |limit: f64| -> f64 {
        let mut weight = 0.5f64.powi(one_sided as i32);
        let mut chance = 0.0;
        for above in 0..=one_sided {
            // χ² with no degree of freedom is always zero.
            if let Ok(chi2) = ChiSquared::new((two_sided + above) as f64) {
                chance += weight * chi2.sf(limit);
            }
            weight *= (one_sided - above) as f64 / (above + 1) as f64;
        }
        chance
    };
    let (mut low, mut high) = (0.0, 1.0);
    while beyond(high) > false_alarm {
        high *= 2.0;
    }
    // Bisection to the last digit.
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        if beyond(middle) > false_alarm {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn without_bounds_it_is_chi_squared_and_one_bound_halves_the_chance() {
        // Percentage points of χ²: Abramowitz and Stegun, Table 26.8.
        assert_relative_eq!(limit(1, 0, 0.05), 3.84146, epsilon = 1e-5);
        assert_relative_eq!(limit(10, 0, 0.001), 29.588, epsilon = 1e-3);
        assert_relative_eq!(limit(0, 1, 0.025), limit(1, 0, 0.05), epsilon = 1e-9);
        // Of two bounds one in four draws is above both, one in two above one.
        let chi2 = |freedom: f64| ChiSquared::new(freedom).unwrap().sf(limit(0, 2, 0.01));
        assert_relative_eq!(0.5 * chi2(1.0) + 0.25 * chi2(2.0), 0.01, epsilon = 1e-9);
    }
}
