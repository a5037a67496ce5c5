//! Conversion of an ideal output to the samples of an instrument, with noise, Gauss–Markov bias and pulses.

use nalgebra::Vector3;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// Quantity in one sample.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Output {
    /// Whole pulses counted during the sample.
    Pulse,
    /// The integral of the output over the sample.
    Increment,
    /// The mean output over the sample.
    #[default]
    Rate,
}

/// Noise of one triad, equal on its three axes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Noise {
    /// Angle random walk in rad/√s, or velocity random walk in (m/s)/√s.
    pub random_walk: f64,
    /// Gauss–Markov bias.
    pub gauss_markov: Option<GaussMarkov>,
}

/// A bias that varies as a stationary first-order Gauss–Markov process.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GaussMarkov {
    /// Stationary 1σ in rad/s or m/s².
    pub sigma: f64,
    /// Correlation time in s.
    pub correlation_time: f64,
}

/// White noise of a triad during moves, in addition to its noise at rest: 1σ densities of the integrated angle or
/// velocity. Simulations do not generate this noise.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct MotionNoise {
    /// Part of the noise that grows with the speed of a move, √s: 1σ divided by the square root of ∫|ω − ω_ie|² dt or
    /// ∫|f + g|² dt.
    pub by_motion: f64,
    /// Part of the noise that grows with the duration of a move, rad/√s or (m/s)/√s.
    pub by_duration: f64,
}

impl MotionNoise {
    /// Noise of moves by hand: 0.05° (1σ) in a quarter turn of 1.5 s, as found in recordings of MEMS sensors turned by
    /// hand (bandwidth, timing and second-order effects of the sensor).
    pub const BY_HAND: Self = Self {
        by_motion: 7e-4,
        by_duration: 0.0,
    };
}

impl GaussMarkov {
    /// The equivalent random walk over times much shorter than its correlation time, rad/s/√s or m/s²/√s.
    pub fn walk(&self) -> f64 {
        self.sigma * (2.0 / self.correlation_time).sqrt()
    }
}

impl Noise {
    /// Covariance, on one axis, of the mean outputs over two time spans (start and end, s): (rad/s)² or (m/s²)². For
    /// two equal spans, the covariance is the variance of the mean.
    ///
    /// The random walk contributes where the two spans overlap. The contribution of the Gauss–Markov bias is the double
    /// integral of its autocovariance `σ² exp(−|t|/τ)` over both spans.
    pub fn covariance_of_means(&self, one: [f64; 2], other: [f64; 2]) -> f64 {
        let product = (one[1] - one[0]) * (other[1] - other[0]);
        let overlap = (one[1].min(other[1]) - one[0].max(other[0])).max(0.0);
        let white = self.random_walk.powi(2) * overlap;
        let bias = self.gauss_markov.map_or(0.0, |gauss_markov| {
            let (sigma, tau) = (gauss_markov.sigma, gauss_markov.correlation_time);
            // The double integral is a product of one integral per span, so no digits are lost if the spans are long or
            // far apart.
            let mut spans = [one, other];
            spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
            let [first, second] = spans;
            let decayed = |time: f64| -(-time / tau).exp_m1();
            let double_integral = if second[0] >= first[1] {
                let apart = (-(second[0] - first[1]) / tau).exp();
                decayed(first[1] - first[0]) * decayed(second[1] - second[0]) * apart
            } else {
                // The second antiderivative of exp(−|t|/τ), over τ².
                let whole = |time: f64| {
                    let time = time.abs() / tau;
                    (-time).exp_m1() + time
                };
                whole(first[1] - second[0]) + whole(first[0] - second[1])
                    - whole(first[0] - second[0])
                    - whole(first[1] - second[1])
            };
            (sigma * tau).powi(2) * double_integral
        });
        (white + bias) / product
    }
}

/// Generates the noise of a triad sample by sample.
#[derive(Debug, Clone)]
pub struct NoiseSource {
    noise: Noise,
    period: f64,
    bias: Vector3<f64>,
}

fn normal(rng: &mut impl Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| StandardNormal.sample(rng))
}

impl NoiseSource {
    /// A source for samples of this period in s; the Gauss–Markov bias starts from its stationary
    /// distribution.
    pub fn new(noise: Noise, period: f64, rng: &mut impl Rng) -> Self {
        let of_bias = noise.gauss_markov;
        let bias = of_bias.map_or_else(Vector3::zeros, |of| normal(rng) * of.sigma);
        Self {
            noise,
            period,
            bias,
        }
    }

    /// The noise in the integral of the next sample's output, rad or m/s.
    pub fn draw(&mut self, rng: &mut impl Rng) -> Vector3<f64> {
        let white = normal(rng) * (self.noise.random_walk * self.period.sqrt());
        if let Some(gauss_markov) = self.noise.gauss_markov {
            let keep = (-self.period / gauss_markov.correlation_time).exp();
            self.bias =
                self.bias * keep + normal(rng) * (gauss_markov.sigma * (1.0 - keep * keep).sqrt());
        }
        white + self.bias * self.period
    }
}

/// A pulse counter: the remainder of each sample is carried into the next one, so the sum of all pulses differs from
/// the integral by at most half a count.
#[derive(Debug, Clone, Default)]
pub struct Pulses {
    carry: Vector3<f64>,
}

impl Pulses {
    /// The whole pulses of a sample whose integral is `counts`.
    pub fn count(&mut self, counts: Vector3<f64>) -> Vector3<f64> {
        let total = self.carry + counts;
        let whole = total.map(f64::round);
        self.carry = total - whole;
        whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn the_sum_of_pulses_stays_within_half_a_count_of_the_integral() {
        let mut pulses = Pulses::default();
        let mut sum = Vector3::zeros();
        let rate = Vector3::new(0.3, -7.77, 1e-3);
        for k in 1..=10_000 {
            sum += pulses.count(rate);
            let lag = sum - rate * f64::from(k);
            assert!(lag.amax() <= 0.5 + 1e-9);
        }
    }

    #[test]
    fn means_over_two_spans_vary_together_as_drawn_ones_do() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let noise = Noise {
            random_walk: 0.5,
            gauss_markov: Some(GaussMarkov {
                sigma: 1.0,
                correlation_time: 2.0,
            }),
        };
        let (period, sets) = (0.05, 4000);
        // Apart, and overlapping; in samples.
        let spans = [0..40, 60..100, 20..90];
        let mut products = [[0.0; 3]; 3];
        for _ in 0..sets {
            let mut source = NoiseSource::new(noise, period, &mut rng);
            let drawn: Vec<Vector3<f64>> = (0..100).map(|_| source.draw(&mut rng)).collect();
            let mean = |span: &std::ops::Range<usize>| {
                drawn[span.clone()].iter().sum::<Vector3<f64>>() / (span.len() as f64 * period)
            };
            for (i, one) in spans.iter().enumerate() {
                for (j, other) in spans.iter().enumerate() {
                    products[i][j] += mean(one).dot(&mean(other)) / 3.0 / f64::from(sets);
                }
            }
        }
        let times = spans.map(|span| [span.start as f64 * period, span.end as f64 * period]);
        for i in 0..3 {
            for j in 0..3 {
                let stated = noise.covariance_of_means(times[i], times[j]);
                let variances = noise.covariance_of_means(times[i], times[i])
                    * noise.covariance_of_means(times[j], times[j]);
                // Of a mean of products of normal numbers, at four of its σ; sampling adds a fortieth.
                let limit = 4.0 * ((variances + stated.powi(2)) / 3.0 / f64::from(sets)).sqrt();
                let off = (products[i][j] - stated).abs();
                assert!(off < limit + 0.025 * stated, "{i} {j}: {off} {limit}");
            }
        }
    }

    #[test]
    fn white_noise_integrates_to_the_stated_random_walk() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let noise = Noise {
            random_walk: 2.0,
            gauss_markov: None,
        };
        let runs = 2000;
        let mut sum_of_squares = 0.0;
        for _ in 0..runs {
            let mut source = NoiseSource::new(noise, 0.25, &mut rng);
            let walk: Vector3<f64> = (0..16).map(|_| source.draw(&mut rng)).sum();
            sum_of_squares += walk.norm_squared();
        }
        // After 4 s the variance of each axis is 4 · 2²; 6000 draws give it to 1/√3000.
        let variance = sum_of_squares / f64::from(3 * runs);
        assert!((variance / 16.0 - 1.0).abs() < 4.0 / 3000f64.sqrt());
    }

    #[test]
    fn instability_keeps_its_stationary_sigma_and_forgets_with_its_correlation_time() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let gauss_markov = GaussMarkov {
            sigma: 3.0,
            correlation_time: 1.0,
        };
        let noise = Noise {
            random_walk: 0.0,
            gauss_markov: Some(gauss_markov),
        };
        let mut source = NoiseSource::new(noise, 0.5, &mut rng);
        let draws = 40_000;
        let drift: Vec<Vector3<f64>> = (0..draws).map(|_| source.draw(&mut rng) / 0.5).collect();
        let mean_product = |lag: usize| {
            let pairs = drift.iter().zip(&drift[lag..]);
            pairs.map(|(a, b)| a.dot(b)).sum::<f64>() / (3 * (drift.len() - lag)) as f64
        };
        assert!((mean_product(0) / 9.0 - 1.0).abs() < 0.05);
        for lag in [1, 2, 4] {
            let correlation = mean_product(lag) / mean_product(0);
            let expected = (-0.5 * lag as f64).exp();
            assert!(
                (correlation - expected).abs() < 0.03,
                "{lag}: {correlation}"
            );
        }
    }
}
