//! Ratios between two methods over the same runs, with a bootstrap interval.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Number of bootstrap samples.
const SAMPLES: usize = 2000;
/// Probability outside the interval, half on each side.
const OUTSIDE: f64 = 0.01;
/// Random seed of the bootstrap; its draws are independent of those of the runs.
const SEED: u64 = 0;

/// A ratio of root mean squares, or of medians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratio {
    /// Ratio over all runs.
    pub value: f64,
    /// 99 % interval, from percentiles of the ratio over runs that are drawn with replacement (Efron, Tibshirani, *An
    /// Introduction to the Bootstrap*, §13.3).
    pub interval: (f64, f64),
}

impl Ratio {
    /// The ratio of two root mean squares over the same runs, each given by the sums of squares of all runs; `None` if
    /// there are no runs.
    pub fn of(over: &[f64], under: &[f64]) -> Option<Self> {
        let sum = |of: &[f64], chosen: &[usize]| chosen.iter().map(|&k| of[k]).sum::<f64>();
        let ratio = |chosen: &[usize]| (sum(over, chosen) / sum(under, chosen)).sqrt();
        Self::bootstrapped(over.len().min(under.len()), ratio)
    }

    /// The ratio of the medians of the same runs; `None` without runs.
    pub(super) fn of_medians(over: &[f64], under: &[f64]) -> Option<Self> {
        let ratio = |chosen: &[usize]| median(over, chosen) / median(under, chosen);
        Self::bootstrapped(over.len().min(under.len()), ratio)
    }

    fn bootstrapped(runs: usize, statistic: impl Fn(&[usize]) -> f64) -> Option<Self> {
        let (value, interval) = bootstrap(runs, statistic)?;
        Some(Self { value, interval })
    }
}

/// A statistic of all runs with its 99 % interval; `statistic` receives the run numbers. `None` without runs.
pub fn bootstrap(runs: usize, statistic: impl Fn(&[usize]) -> f64) -> Option<(f64, (f64, f64))> {
    if runs == 0 {
        return None;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut samples: Vec<f64> = (0..SAMPLES)
        .map(|_| {
            let chosen: Vec<usize> = (0..runs).map(|_| rng.random_range(0..runs)).collect();
            statistic(&chosen)
        })
        .collect();
    samples.sort_by(f64::total_cmp);
    let at = |share: f64| samples[((SAMPLES - 1) as f64 * share).round() as usize];
    let all: Vec<usize> = (0..runs).collect();
    Some((
        statistic(&all),
        (at(OUTSIDE / 2.0), at(1.0 - OUTSIDE / 2.0)),
    ))
}

/// The median of the values at these indices.
pub fn median(of: &[f64], chosen: &[usize]) -> f64 {
    let mut values: Vec<f64> = chosen.iter().map(|&k| of[k]).collect();
    values.sort_by(f64::total_cmp);
    quantile(&values, 0.5)
}

/// The value below which this fraction of the sorted values lies, by linear interpolation; NaN without values.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * sorted.len().saturating_sub(1) as f64;
    let (below, part) = (place as usize, place.fract());
    match (sorted.get(below), sorted.get(below + 1)) {
        (Some(low), Some(high)) => low + part * (high - low),
        (Some(&last), None) => last,
        (None, _) => f64::NAN,
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
        let ratio = Ratio::of_medians(&[2.0, 6.0, 4.0], &[1.0, 3.0, 2.0]).unwrap();
        assert_eq!((ratio.value, ratio.interval), (2.0, (2.0, 2.0)));
    }

    #[test]
    fn the_median_of_an_even_number_lies_between_the_middle_two() {
        assert_eq!(quantile(&[1.0, 2.0, 4.0, 8.0], 0.5), 3.0);
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 1.0), 4.0);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
