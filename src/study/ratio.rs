//! The ratio of two root mean squares with a bootstrap interval.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Number of bootstrap samples.
const SAMPLES: usize = 2000;
/// Probability outside the interval, half on each side.
const OUTSIDE: f64 = 0.01;
/// The bootstrap's own seed: its draws have nothing to do with those of the runs.
const SEED: u64 = 0;

/// A ratio of root mean squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratio {
    /// Of all runs.
    pub value: f64,
    /// 99 % interval: percentiles of the ratio over runs drawn with replacement (Efron, Tibshirani,
    /// *An Introduction to the Bootstrap*, §13.3).
    pub interval: (f64, f64),
}

impl Ratio {
    /// The ratio of two root mean squares of the same runs, each given by the sum of squares of each
    /// run; `None` without runs.
    pub(super) fn of(over: &[f64], under: &[f64]) -> Option<Self> {
        let runs = over.len().min(under.len());
        if runs == 0 {
            return None;
        }
        let ratio = |(over, under): (f64, f64)| (over / under).sqrt();
        let sums = |run: &mut dyn FnMut(usize) -> usize| {
            (0..runs).fold((0.0, 0.0), |(a, b), k| {
                let k = run(k);
                (a + over[k], b + under[k])
            })
        };
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let mut samples: Vec<f64> = (0..SAMPLES)
            .map(|_| ratio(sums(&mut |_| rng.random_range(0..runs))))
            .collect();
        samples.sort_by(f64::total_cmp);
        let at = |share: f64| samples[((SAMPLES - 1) as f64 * share).round() as usize];
        Some(Self {
            value: ratio(sums(&mut |k| k)),
            interval: (at(OUTSIDE / 2.0), at(1.0 - OUTSIDE / 2.0)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn the_interval_of_normal_errors_is_that_of_chi_square() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let squares: Vec<f64> = (0..500)
            .map(|_| {
                (0..3)
                    .map(|_| -> f64 { StandardNormal.sample(&mut rng) })
                    .map(|x| x * x)
                    .sum()
            })
            .collect();
        let ratio = Ratio::of(&squares, &[3.0; 500]).unwrap();
        // √(χ²/n) of n = 1500 has σ = 1/√(2n) = 0.0183; 2.576 of them make 99 %.
        let half = 2.576 / 3000f64.sqrt();
        assert!((ratio.value - 1.0).abs() < half, "{ratio:?}");
        let (low, high) = ratio.interval;
        assert!(
            ((high - low) / (2.0 * half) - 1.0).abs() < 0.15,
            "{ratio:?}"
        );
    }

    #[test]
    fn runs_that_go_together_leave_no_spread() {
        let squares = [1.0, 4.0, 9.0];
        let ratio = Ratio::of(&[4.0, 16.0, 36.0], &squares).unwrap();
        assert_eq!((ratio.value, ratio.interval), (2.0, (2.0, 2.0)));
        assert_eq!(Ratio::of(&[], &[]), None);
    }
}
