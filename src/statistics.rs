//! Order statistics, which a few wild values do not move.

use statrs::statistics::{Data, OrderStatistics};

/// σ of a normal distribution over the median of its absolute deviations.
pub(crate) const SIGMA_OF_MEDIAN: f64 = 1.482_602;

/// The median of some numbers, which lose their order; none of none.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    (!values.is_empty()).then(|| Data::new(values).median())
}
