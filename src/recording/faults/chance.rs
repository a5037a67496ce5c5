//! Significance limits for faults, that is, how improbable samples must be in a recording without faults.

use statrs::distribution::{ContinuousCDF, Normal};

/// Number of faultless recordings per false alarm of one kind of fault.
const RECORDS: f64 = 1e4;

/// The limit of one kind of fault in a recording, with Bonferroni's correction over all samples of its six axes.
#[derive(Debug, Clone, Copy)]
pub struct Limit {
    /// −ln of the probability that a sample without a fault exceeds the limit.
    pub nats: f64,
    /// The equivalent two-sided limit in σ of a normal distribution.
    pub sigmas: f64,
}

impl Limit {
    /// The limit for a recording with this number of rows.
    pub fn of_rows(rows: usize) -> Self {
        let probability = (6.0 * rows.max(1) as f64 * RECORDS).recip();
        Self {
            nats: -probability.ln(),
            sigmas: quantile(probability),
        }
    }

    /// The limit in σ if σ is itself an estimate with few degrees of freedom, by Wallace's approximation of Student's t
    /// distribution.
    pub fn of_student(&self, freedom: f64) -> f64 {
        let exponent = self.sigmas.powi(2) * (freedom - 1.5).max(0.0) / (freedom - 1.0).powi(2);
        (freedom * exponent.exp_m1()).sqrt()
    }

    /// The quantile that one in a thousand of these values exceeds, and the limit of a statistic with the same tail as
    /// these values, in σ of the normal distribution.
    ///
    /// The limit is extrapolated from two quantiles of the values, with a power of the normal quantiles; the tail may
    /// therefore be heavier than normal, but never lighter. A few faults among the values do not affect these
    /// quantiles. `values` are reordered.
    pub fn of_tail(&self, values: &mut [f64]) -> (f64, f64) {
        let rows = values.len();
        let [inner, outer] = TAIL.map(|part| {
            let rank = rows - 1 - (part * rows as f64) as usize;
            *values.select_nth_unstable_by(rank, f64::total_cmp).1
        });
        let [normal_inner, normal_outer] = TAIL.map(quantile);
        let power = (outer / inner).ln() / (normal_outer / normal_inner).ln();
        // If most values are zero, no tail is visible.
        let power = if power.is_finite() {
            power.max(1.0)
        } else {
            1.0
        };
        let carried = |sigmas: f64| sigmas.max(outer * (sigmas / normal_outer).powf(power));
        (carried(quantile(FEW)), carried(self.sigmas))
    }
}

/// Fractions of samples beyond the two quantiles from which the tail is extrapolated.
const TAIL: [f64; 2] = [5e-2, 5e-3];
/// Fraction of the values of a faultless recording beyond the first returned quantile.
const FEW: f64 = 1e-3;

/// σ beyond which a normal variate lies with this probability, two-sided.
fn quantile(probability: f64) -> f64 {
    -Normal::standard().inverse_cdf(0.5 * probability)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};
    use statrs::distribution::StudentsT;

    #[test]
    fn the_limit_of_a_normal_tail_is_that_of_the_normal_distribution() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let draw = |_| f64::abs(StandardNormal.sample(&mut random));
        let mut values: Vec<f64> = (0..60_000).map(draw).collect();
        let limit = Limit::of_rows(values.len());
        assert!(
            (2.0 * Normal::standard().cdf(-limit.sigmas) * 3.6e9 - 1.0).abs() < 1e-3,
            "{}",
            limit.sigmas
        );
        values[..20].fill(1e6);
        let (_, of_tail) = limit.of_tail(&mut values);
        assert!((of_tail / limit.sigmas - 1.0).abs() < 0.15, "{of_tail}");
    }

    #[test]
    fn a_heavier_tail_is_carried_on_as_it_is() {
        // Of a Laplace distribution, whose tail is exp(−u).
        let values = |k: usize| -((k as f64 + 0.5) / 60_000.0).ln();
        let mut values: Vec<f64> = (0..60_000).map(values).collect();
        let limit = Limit::of_rows(values.len());
        let (_, of_tail) = limit.of_tail(&mut values);
        assert!((of_tail / limit.nats - 1.0).abs() < 0.15, "{of_tail}");
    }

    #[test]
    fn a_sigma_that_few_values_show_moves_the_limit_out() {
        // Two-sided quantiles of Student's distribution by its incomplete beta function.
        let limit = Limit::of_rows(60_000);
        for freedom in [8.0, 30.0, 200.0] {
            let student = StudentsT::new(0.0, 1.0, freedom).unwrap();
            let beyond = 2.0 * student.cdf(-limit.of_student(freedom));
            assert!(
                (beyond.ln() / -limit.nats - 1.0).abs() < 0.05,
                "{freedom}: {beyond:e}"
            );
        }
    }
}
