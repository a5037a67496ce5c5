//! From an ideal output to what a sample of the instrument holds: noise, Gauss–Markov bias, pulses.

use nalgebra::Vector3;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// What one sample holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// Whole pulses counted during the sample.
    Pulse,
    /// The integral of the output over the sample.
    Increment,
    /// The mean output over the sample.
    Rate,
}

/// Noise of one triad, alike on its three axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Noise {
    /// Angle random walk in rad/√s, or velocity random walk in (m/s)/√s.
    pub random_walk: f64,
    /// Gauss–Markov bias.
    pub gauss_markov: Option<GaussMarkov>,
}

/// A bias that varies as a stationary first-order Gauss–Markov process.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaussMarkov {
    /// Stationary 1σ in rad/s or m/s².
    pub sigma: f64,
    /// Correlation time in s.
    pub correlation_time: f64,
}

/// Draws a triad's noise, sample by sample.
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
        let bias = noise
            .gauss_markov
            .map_or_else(Vector3::zeros, |gauss_markov| {
                normal(rng) * gauss_markov.sigma
            });
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

/// A pulse counter: what is left over from one sample is carried into the next, so the sum of all
/// pulses stays within half a count of the integral.
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
