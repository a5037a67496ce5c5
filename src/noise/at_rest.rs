//! Noise of each axis at rest, from the dwells of any run.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::allan::{Curve, cluster_sizes, overlapping};
use crate::imu::{PerSensor, Sensor};
use crate::recording::ImuSamples;

/// White-noise density of each axis that matches the Allan variance of the dwells at one cluster time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RestNoise {
    /// The cluster time, s. This cluster time is a quarter of the median dwell, so that quantisation is small.
    pub tau_s: f64,
    /// Allan deviation times √τ: rad/√s and m/s/√s.
    pub density: PerSensor<[f64; 3]>,
    /// Equivalent degrees of freedom of each variance.
    pub freedom: f64,
}

impl RestNoise {
    /// The noise at rest from the samples in these dwells; `None` if no dwell is long enough.
    pub fn of(imu: &ImuSamples, dwells: &[Range<usize>]) -> Option<Self> {
        let mut lengths: Vec<usize> = dwells.iter().map(ExactSizeIterator::len).collect();
        lengths.sort_unstable();
        let size = lengths.get(lengths.len() / 2)? / 4;
        let tau_s = size as f64 * imu.period;
        let (variances, freedom) = pooled(imu, dwells, size)?;
        Some(Self {
            tau_s,
            density: PerSensor::from_fn(|sensor| {
                variances.get(sensor).map(|of| (of * tau_s).sqrt())
            }),
            freedom,
        })
    }

    /// Relative 1σ of each density.
    pub fn relative_sigma(&self) -> f64 {
        (2.0 * self.freedom).sqrt().recip()
    }
}

/// Overlapping Allan variance of each axis at rest, pooled over the dwells, at clusters up to a quarter of the longest.
pub fn curves_at_rest(imu: &ImuSamples, dwells: &[Range<usize>]) -> PerSensor<[Curve; 3]> {
    let longest = dwells.iter().map(ExactSizeIterator::len).max();
    let mut curves: PerSensor<[Curve; 3]> = PerSensor::default();
    for size in cluster_sizes(longest.unwrap_or(0)) {
        let Some((variances, _)) = pooled(imu, dwells, size) else {
            continue;
        };
        for sensor in Sensor::ALL {
            let of_axes = variances.get(sensor);
            for (curve, variance) in curves.get_mut(sensor).iter_mut().zip(of_axes) {
                curve.tau.push(size as f64 * imu.period);
                curve.variance.push(*variance);
            }
        }
    }
    curves
}

/// Allan variance of each axis for clusters of this size, averaged over the dwells of four clusters or more by their
/// degrees of freedom, and the sum of these; `None` if there is no such dwell.
fn pooled(
    imu: &ImuSamples,
    dwells: &[Range<usize>],
    size: usize,
) -> Option<(PerSensor<[f64; 3]>, f64)> {
    let used = dwells.iter().filter(|dwell| dwell.len() >= 4 * size);
    let used: Vec<(&Range<usize>, f64)> = used.map(|d| (d, freedom(d.len(), size))).collect();
    let sum: f64 = used.iter().map(|(_, weight)| weight).sum();
    if size == 0 || used.is_empty() {
        return None;
    }
    let variance = |sensor: Sensor, axis: usize| {
        let variances = used.iter().map(|(dwell, weight)| {
            let of_dwell = imu.of(sensor).within((*dwell).clone()).map(|v| v[axis]);
            let curve = overlapping(of_dwell, imu.period, &[size]);
            weight * curve.variance.first().copied().unwrap_or_default()
        });
        variances.sum::<f64>() / sum
    };
    let variances = PerSensor::from_fn(|sensor| [0, 1, 2].map(|axis| variance(sensor, axis)));
    Some((variances, sum))
}

/// Equivalent degrees of freedom of the overlapping Allan variance of white noise: Riley, NIST SP 1065, 5.4.1,
/// for `samples` increments and clusters of `size`.
fn freedom(samples: usize, size: usize) -> f64 {
    let (n, m) = ((samples + 1) as f64, size as f64);
    let clusters = 1.5 * (n - 1.0) / m - 2.0 * (n - 2.0) / n;
    clusters * 4.0 * m * m / (4.0 * m * m + 5.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn the_noise_of_each_axis_is_found_within_its_own_sigma() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let (period, samples) = (0.01, 40_000);
        let truth = [1e-6, 5e-6, 1e-6];
        let mut draw = |density: [f64; 3]| {
            let increment = density.map(|d| {
                let white: f64 = StandardNormal.sample(&mut rng);
                d * f64::sqrt(period) * white
            });
            Vector3::from(increment)
        };
        let gyro: Vec<_> = (0..samples).map(|_| draw(truth)).collect();
        let accel: Vec<_> = (0..samples).map(|_| draw([1e-4; 3])).collect();
        let imu = ImuSamples::new(0.0, period, gyro, accel).unwrap();
        let dwells: Vec<Range<usize>> = (0..20).map(|k| 2000 * k..2000 * k + 1600).collect();
        let found = RestNoise::of(&imu, &dwells).unwrap();
        assert_eq!(found.tau_s, 4.0);
        let sigma = found.relative_sigma();
        assert!((0.05..0.1).contains(&sigma), "{sigma}");
        for (found, truth) in found.density.gyro.iter().zip(truth) {
            assert!((found / truth).ln().abs() < 4.0 * sigma, "{found} {truth}");
        }
        assert_eq!(RestNoise::of(&imu, &[]), None);
        let short = std::iter::once(0..3).collect::<Vec<_>>();
        assert_eq!(RestNoise::of(&imu, &short), None);
    }
}
