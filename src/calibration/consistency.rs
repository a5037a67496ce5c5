//! Whether the innovations are as large as their covariance says, and white.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::outcome::{Consistency, Innovation, Nis, Observation};

/// Two-sided probability outside the intervals.
const OUTSIDE: f64 = 0.05;

/// Consistency of a pass: velocity and table apart.
pub(super) fn consistency(innovations: &[Innovation]) -> Consistency {
    let of = |kinds: &[Observation]| {
        nis(innovations
            .iter()
            .filter(|i| kinds.contains(&i.observation) && i.accepted)
            .map(|i| i.whitened))
    };
    Consistency {
        all: of(&[Observation::Velocity, Observation::Table]),
        velocity: of(&[Observation::Velocity]),
        table: of(&[Observation::Table]),
    }
}

fn nis(whitened: impl Iterator<Item = [f64; 3]>) -> Nis {
    let (mut squares, mut products, mut count) = (0.0, 0.0, 0usize);
    let mut last = [0.0; 3];
    for w in whitened {
        for axis in 0..3 {
            squares += w[axis].powi(2);
            products += w[axis] * last[axis];
        }
        last = w;
        count += 3;
    }
    Nis {
        mean: squares / count as f64,
        count,
        interval: mean_square_interval(count, OUTSIDE),
        lag_one: products / squares,
    }
}

/// The interval that holds the mean of `count` squared standard normal numbers but for a chance of
/// `outside`, half on each side (Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to
/// Tracking and Navigation*, §5.4.2). NaN if there are none.
pub fn mean_square_interval(count: usize, outside: f64) -> (f64, f64) {
    let n = count as f64;
    ChiSquared::new(n).map_or((f64::NAN, f64::NAN), |chi2| {
        (
            chi2.inverse_cdf(outside / 2.0) / n,
            chi2.inverse_cdf(1.0 - outside / 2.0) / n,
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn interval_meets_tabulated_chi_square_quantiles() {
        // Abramowitz and Stegun, table 26.8: χ²(30) at 0.975 and 0.025 is 16.791 and 46.979.
        let (low, high) = mean_square_interval(30, 0.05);
        assert_abs_diff_eq!(low, 16.791 / 30.0, epsilon = 1e-4);
        assert_abs_diff_eq!(high, 46.979 / 30.0, epsilon = 1e-4);
    }

    #[test]
    fn interval_of_many_observations_is_that_of_the_normal_limit() {
        let n = 36_000.0;
        let (low, high) = mean_square_interval(n as usize, 0.05);
        let half = 1.959964 * (2f64 / n).sqrt();
        assert_abs_diff_eq!(low, 1.0 - half, epsilon = 1e-4);
        assert_abs_diff_eq!(high, 1.0 + half, epsilon = 1e-4);
    }
}
