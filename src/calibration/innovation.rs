//! Innovations: what an observation differs from its prediction by, and whether it is as much as its
//! covariance says.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// What was observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Observation {
    /// Zero velocity.
    Velocity,
    /// Attitude of the table.
    Table,
    /// Attitude that does not change at standstill, without a table.
    Attitude,
}

impl Observation {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Velocity, Self::Table, Self::Attitude];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Velocity => "velocity",
            Self::Table => "table attitude",
            Self::Attitude => "attitude at standstill",
        }
    }
}

/// The innovation of one observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Time, s.
    pub time: f64,
    /// What was observed.
    pub observation: Observation,
    /// East, North and Up in units of their own σ, independent of each other.
    pub whitened: [f64; 3],
    /// Whether the gate let it in.
    pub accepted: bool,
}

impl Innovation {
    /// Squared Mahalanobis distance, χ² with three degrees of freedom.
    pub fn distance(&self) -> f64 {
        self.whitened.iter().map(|w| w * w).sum()
    }
}

/// Normalised innovation squared, apart for each kind of observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Consistency {
    /// All observations.
    pub all: Nis,
    /// Zero velocity.
    pub velocity: Nis,
    /// Attitude of the table.
    pub table: Nis,
    /// Attitude that does not change at standstill, without a table.
    pub attitude: Nis,
}

impl Consistency {
    /// The kinds of observation that there are.
    pub fn kinds(&self) -> impl Iterator<Item = (Observation, Nis)> {
        let each = [self.velocity, self.table, self.attitude];
        let all = Observation::ALL.into_iter().zip(each);
        all.filter(|(_, nis)| nis.count > 0)
    }
}

/// Mean of normalised innovations squared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nis {
    /// Mean per scalar observation; one if σ are true. NaN without observations.
    pub mean: f64,
    /// Number of scalar observations.
    pub count: usize,
    /// 95 % interval of the mean for consistent σ (χ²).
    pub interval: (f64, f64),
    /// Correlation of neighbouring innovations, zero if they are white.
    pub lag_one: f64,
}

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
        all: of(&Observation::ALL),
        velocity: of(&[Observation::Velocity]),
        table: of(&[Observation::Table]),
        attitude: of(&[Observation::Attitude]),
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
