//! Counters and clocks that begin again.

/// Sizes of counters of samples.
pub(super) const COUNTERS: [f64; 4] = [256.0, 65_536.0, 16_777_216.0, 4_294_967_296.0];
/// After so many seconds clocks begin again: registers of milliseconds and microseconds, a day, a week of satellites.
pub(super) const CLOCKS: [f64; 7] = [
    65.536,
    16.777_216,
    16_777.216,
    4_294.967_296,
    4_294_967.296,
    86_400.0,
    604_800.0,
];

/// The first of these sizes of a counter that makes its step back one forward that is no longer than usual.
pub(super) fn wrap<const N: usize>(
    step: f64,
    sizes: [f64; N],
    longest: impl Fn(f64) -> f64,
) -> Option<f64> {
    let forward = |size: &f64| step + size > 0.0 && step + size <= longest(*size);
    sizes.into_iter().find(forward)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_wraps_at_the_smallest_size_that_makes_a_small_step() {
        let wrap = |step| wrap(step, COUNTERS, |size| 0.25 * size);
        assert_eq!(wrap(-255.0), Some(256.0));
        assert_eq!(wrap(-250.0), Some(256.0));
        assert_eq!(wrap(-65535.0), Some(65536.0));
        assert_eq!(wrap(-65530.0), Some(65536.0));
        assert_eq!(wrap(3.0 - 4_294_967_295.0), Some(4_294_967_296.0));
        assert_eq!(wrap(-256.0), None, "the same count");
        assert_eq!(wrap(-50.0), None, "rows out of order");
    }
}
