//! The overlapping Allan variance.

/// Allan variance of one axis at increasing cluster times.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curve {
    /// Cluster times τ, s.
    pub tau: Vec<f64>,
    /// Allan variance at each cluster time, (rad/s)² or (m/s²)².
    pub variance: Vec<f64>,
}

/// The mean Allan variance of several curves with the same cluster times.
pub fn mean(curves: &[&Curve]) -> Curve {
    let tau = curves.first().map_or_else(Vec::new, |of| of.tau.clone());
    let at = |point: usize| curves.iter().map(|of| of.variance[point]).sum::<f64>();
    let variance = (0..tau.len()).map(|point| at(point) / curves.len() as f64);
    Curve {
        variance: variance.collect(),
        tau,
    }
}

/// Minimum number of clusters for an Allan variance.
const FEWEST_CLUSTERS: usize = 4;

/// Lengths of clusters in samples: two per octave, from one sample to a quarter of the recording.
pub fn cluster_sizes(samples: usize) -> Vec<usize> {
    let longest = samples / FEWEST_CLUSTERS;
    let mut sizes: Vec<usize> = (0..)
        .map(|k| 2f64.powf(f64::from(k) / 2.0).round() as usize)
        .take_while(|&size| size <= longest)
        .collect();
    sizes.dedup();
    sizes
}

/// Overlapping Allan variance of a rate whose integrals over samples of `period` s are given, at clusters of these
/// sizes; clusters longer than half the recording are omitted.
///
/// With θ the running integral, `σ²(τ) = ⟨(θ(t+2τ) − 2θ(t+τ) + θ(t))²⟩ / 2τ²` over every t: Riley, NIST
/// SP 1065, 5.2.4.
pub fn overlapping(increments: impl Iterator<Item = f64>, period: f64, sizes: &[usize]) -> Curve {
    let increments: Vec<f64> = increments.collect();
    let mean = increments.iter().sum::<f64>() / increments.len().max(1) as f64;
    // A constant rate does not affect second differences; it is removed because gravity would cost digits.
    let rises = increments.iter().scan(0.0, |sum, increment| {
        *sum += increment - mean;
        Some(*sum)
    });
    let integral: Vec<f64> = std::iter::once(0.0).chain(rises).collect();
    let point = |&size: &usize| {
        let time = size as f64 * period;
        let places = integral.windows(2 * size + 1);
        let count = places.len();
        let squares = places.map(|w| (w[2 * size] - 2.0 * w[size] + w[0]).powi(2));
        let mean_square = squares.sum::<f64>() / count as f64;
        (size > 0 && count > 0).then(|| (time, mean_square / (2.0 * time * time)))
    };
    let (tau, variance) = sizes.iter().filter_map(point).unzip();
    Curve { tau, variance }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The 1000 numbers of NIST SP 1065, 12.4: a prime modulus generator by Park and Miller.
    fn nist() -> Vec<f64> {
        let mut n: u64 = 1_234_567_890;
        (0..1000)
            .map(|_| {
                let number = n as f64 / 2_147_483_647.0;
                n = 16_807 * n % 2_147_483_647;
                number
            })
            .collect()
    }

    #[test]
    fn the_published_deviations_of_the_nist_test_set_are_met_to_their_last_digit() {
        let data = nist();
        assert!((data[0] - 0.574_890_473_2).abs() < 1e-9);
        let curve = overlapping(data.into_iter(), 1.0, &[1, 10, 100]);
        // NIST SP 1065, table 31.
        for (variance, published) in
            curve
                .variance
                .iter()
                .zip([2.922_319e-1, 9.159_953e-2, 3.241_343e-2])
        {
            let deviation = variance.sqrt();
            assert!((deviation / published - 1.0).abs() < 2e-7, "{deviation}");
        }
    }

    #[test]
    fn an_even_rate_has_no_deviation_and_a_ramp_its_own_slope() {
        let period = 0.01;
        let ramp = (0..4000).map(|k| 9.8 * period + 3.0 * period * period * f64::from(k));
        let curve = overlapping(ramp, period, &[1, 64, 512]);
        for (tau, variance) in curve.tau.iter().zip(&curve.variance) {
            assert!((variance.sqrt() / (3.0 * tau / 2f64.sqrt()) - 1.0).abs() < 1e-6);
        }
        let even = overlapping((0..4000).map(|_| 9.8 * period), period, &[1, 512]);
        assert!(even.variance.iter().all(|v| *v < 1e-20));
    }

    #[test]
    fn clusters_grow_by_half_octaves_to_a_quarter_of_the_record() {
        assert_eq!(cluster_sizes(100), [1, 2, 3, 4, 6, 8, 11, 16, 23]);
        assert!(cluster_sizes(3).is_empty());
    }
}
