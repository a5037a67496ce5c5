//! Probability that an absent error term explains as much by chance.

use nalgebra::DMatrix;

use crate::statistics::{chi_square_limit, ln_survival};

/// A smaller reduction of a prior variance is only rounding.
const ROUNDING: f64 = 1e-9;

/// Improvement of the fit by some parameters, compared with chance.
///
/// By chance, the cost falls by `Σ w_k χ²₁`, with w_k the share of the prior variance that the data remove in the
/// k-th independent direction. This is approximated by `w χ²` of `Σ w_k / w` states with w the largest share: the
/// mean is exact, and the tail is that of the best observed direction. Source: MacKay 1992, "Bayesian
/// interpolation", Neural Computation 4(3), for the number of states that data determine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Decrease of the cost with them.
    pub gain: f64,
    /// Share of the prior variance that the data remove in the best observed direction.
    share: f64,
    /// Number of states that the data determine.
    states: f64,
}

impl Evidence {
    /// Evidence of parameters with this gain and covariance, each parameter in units of its prior σ.
    pub fn new(gain: f64, over_prior: &DMatrix<f64>) -> Self {
        let taken = DMatrix::identity(over_prior.nrows(), over_prior.ncols()) - over_prior;
        let share = taken.symmetric_eigenvalues().max();
        let shows = share > ROUNDING;
        Self {
            gain,
            share,
            states: if shows { taken.trace() / share } else { 0.0 },
        }
    }

    /// The gain as a χ² under the null hypothesis, and its degrees of freedom; `None` if the term is not observed.
    pub fn chi_square(&self) -> Option<(f64, f64)> {
        (self.states > 0.0).then(|| (self.gain / self.share, self.states))
    }

    /// −2 ln of the p-value; zero if the term is not observed.
    pub fn significance(&self) -> f64 {
        let square = self.chi_square();
        square.map_or(0.0, |(square, states)| -2.0 * ln_survival(states, square))
    }

    /// Limit that the gain exceeds by chance with this probability; infinite if the term is not observed.
    pub fn limit(&self, chance: f64) -> f64 {
        if self.states > 0.0 {
            self.share * chi_square_limit(self.states, chance)
        } else {
            f64::INFINITY
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn what_data_hardly_show_takes_little_to_be_significant_and_counts_as_few_states() {
        let covariance =
            DMatrix::from_diagonal(&nalgebra::DVector::from_row_slice(&[0.01, 0.5, 0.99, 0.99]));
        let evidence = Evidence::new(20.0, &covariance);
        // Of what they do not show at all nothing is significant.
        let unseen = DMatrix::identity(4, 4) * (1.0 - 1e-12);
        assert_eq!(Evidence::new(0.0, &unseen).limit(0.5), f64::INFINITY);
        assert_relative_eq!(evidence.states, 1.51 / 0.99, max_relative = 1e-12);
        let chance = (-0.5 * evidence.significance()).exp();
        assert_relative_eq!(evidence.limit(chance), 20.0, max_relative = 1e-6);
    }
}
