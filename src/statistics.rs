//! The middle of numbers, which a few wild ones do not move.

/// σ of a normal distribution over the median of its absolute deviations.
pub(crate) const SIGMA_OF_MEDIAN: f64 = 1.482_602;

/// The middle of some numbers, which lose their order; none of none.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
