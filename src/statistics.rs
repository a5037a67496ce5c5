//! Order statistics, which a few wild values do not move, and what χ² stays below.

use statrs::distribution::{ChiSquared, ContinuousCDF};
use statrs::statistics::{Data, OrderStatistics};

/// σ of a normal distribution over the median of its absolute deviations.
pub(crate) const SIGMA_OF_MEDIAN: f64 = 1.482_602;

/// What χ² of so many degrees of freedom stays below but for this chance; infinite without a degree of
/// freedom, for then nothing is beyond chance.
pub(crate) fn chi_square_limit(degrees: f64, chance: f64) -> f64 {
    ChiSquared::new(degrees).map_or(f64::INFINITY, |chi2| chi2.inverse_cdf(1.0 - chance))
}

/// The median of some numbers, which lose their order; none of none.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    (!values.is_empty()).then(|| Data::new(values).median())
}
