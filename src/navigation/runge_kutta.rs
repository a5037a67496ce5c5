//! Fourth-order integration.

use nalgebra::SMatrix;

/// The value of `at` after a step of this duration in s (fourth-order Runge–Kutta), with the derivatives at its start,
/// middle and end.
#[inline]
pub fn step<const R: usize, const C: usize, F>(
    at: &SMatrix<f64, R, C>,
    duration: f64,
    [start, middle, end]: [&F; 3],
    rate: impl Fn(&F, &SMatrix<f64, R, C>) -> SMatrix<f64, R, C>,
) -> SMatrix<f64, R, C> {
    let h = duration;
    let k1 = rate(start, at);
    let k2 = rate(middle, &(at + k1 * (0.5 * h)));
    let k3 = rate(middle, &(at + k2 * (0.5 * h)));
    let k4 = rate(end, &(at + k3 * h));
    at + k1 * (h / 6.0) + k2 * (h / 3.0) + k3 * (h / 3.0) + k4 * (h / 6.0)
}
