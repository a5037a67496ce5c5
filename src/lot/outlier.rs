//! Outliers: the generalized extreme Studentized deviate test (Rosner, *Technometrics* 25, 1983, 165) with a stated
//! false-alarm rate. Several outliers do not mask one another.

use statrs::statistics::Statistics;

use crate::statistics::{SIGMA_OF_MEDIAN, median, student_limit};

/// Largest number of outliers. From 25 values on it is a quarter of them, and from 15 on two: there, Rosner found the
/// limits valid for several outliers. From five values on it is one, for which the limits are exact (Grubbs). Fewer
/// values cannot show an outlier.
fn most(count: usize) -> usize {
    match count {
        25.. => count / 4,
        15.. => 2,
        5.. => 1,
        _ => 0,
    }
}

/// Indices of the outliers among values with variances, at this false-alarm rate for normal values.
pub fn outliers(samples: &[(f64, f64)], chance: f64) -> Vec<usize> {
    let mut rest: Vec<(usize, f64)> = standardised(samples).into_iter().enumerate().collect();
    let (mut removed, mut outliers) = (Vec::new(), 0);
    for _ in 0..most(samples.len()) {
        let Some((place, deviate)) = extreme(&rest) else {
            break;
        };
        let beyond = deviate > limit(rest.len(), chance);
        removed.push(rest.remove(place).0);
        if beyond {
            outliers = removed.len();
        }
    }
    removed.truncate(outliers);
    removed.sort_unstable();
    removed
}

/// Values on one scale: minus the median, over the root sum square of their own σ and a robust spread of the lot.
fn standardised(samples: &[(f64, f64)]) -> Vec<f64> {
    let middle = |of: &dyn Fn(&(f64, f64)) -> f64| {
        median(&mut samples.iter().map(of).collect::<Vec<_>>()).unwrap_or_default()
    };
    let centre = middle(&|s| s.0);
    let deviation = SIGMA_OF_MEDIAN * middle(&|s| (s.0 - centre).abs());
    let spread = (deviation.powi(2) - middle(&|s| s.1)).max(0.0);
    let sigma = |own: f64| match spread + own {
        all if all > 0.0 => all.sqrt(),
        _ => 1.0,
    };
    samples
        .iter()
        .map(|s| (s.0 - centre) / sigma(s.1))
        .collect()
}

/// Index and Studentized deviate of the value farthest from the mean; `None` if all are equal.
fn extreme(values: &[(usize, f64)]) -> Option<(usize, f64)> {
    let values = || values.iter().map(|v| v.1);
    let (mean, deviation) = (values().mean(), values().std_dev());
    let distances = values().map(|value| (value - mean).abs()).enumerate();
    let (place, distance) = distances.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (deviation > 0.0).then(|| (place, distance / deviation))
}

/// Limit of the largest deviate among this many values, exceeded with probability `chance`.
fn limit(count: usize, chance: f64) -> f64 {
    let n = count as f64;
    let t = student_limit(n - 2.0, chance / (2.0 * n));
    (n - 1.0) * t / ((n - 2.0 + t * t) * n).sqrt()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// NIST/SEMATECH e-Handbook of Statistical Methods, 1.3.5.17.3: Rosner's own 54 values.
    const ROSNER: [f64; 54] = [
        -0.25, 0.68, 0.94, 1.15, 1.20, 1.26, 1.26, 1.34, 1.38, 1.43, 1.49, 1.49, 1.55, 1.56, 1.58,
        1.65, 1.69, 1.70, 1.76, 1.77, 1.81, 1.91, 1.94, 1.96, 1.99, 2.06, 2.09, 2.10, 2.14, 2.15,
        2.23, 2.24, 2.26, 2.35, 2.37, 2.40, 2.47, 2.54, 2.62, 2.64, 2.90, 2.92, 2.92, 2.93, 3.21,
        3.26, 3.30, 3.59, 3.68, 4.30, 4.64, 5.34, 5.42, 6.01,
    ];

    #[test]
    fn the_published_example_has_its_three_outliers_and_its_limits() {
        let samples: Vec<(f64, f64)> = ROSNER.iter().map(|&x| (x, 0.0)).collect();
        assert_eq!(outliers(&samples, 0.05), [51, 52, 53]);
        for (count, published) in [(54, 3.158), (53, 3.151), (45, 3.085)] {
            assert!((limit(count, 0.05) - published).abs() < 2e-3, "{count}");
        }
    }

    #[test]
    fn lots_without_outliers_have_them_named_as_seldom_as_stated() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let (lots, chance) = (2000, 0.05);
        for count in [6, 20, 50] {
            let alarms = (0..lots).filter(|_| {
                let draw = |_| (StandardNormal.sample(&mut rng), 0.0);
                let samples: Vec<(f64, f64)> = (0..count).map(draw).collect();
                !outliers(&samples, chance).is_empty()
            });
            // 5 % of 2000 is 100 ± 10; more false alarms than four σ above are too many.
            let alarms = alarms.count();
            assert!(alarms < 140 && alarms > 20, "{count}: {alarms}");
        }
    }

    #[test]
    fn a_value_with_a_wide_sigma_of_its_own_is_not_apart() {
        let mut samples: Vec<(f64, f64)> = (0..20).map(|k| (f64::from(k % 5), 1.0)).collect();
        samples.push((60.0, 1.0));
        assert_eq!(outliers(&samples, 0.01), [20]);
        samples[20].1 = 900.0;
        assert!(outliers(&samples, 0.01).is_empty());
    }
}
