//! The straight line through equidistant values.

/// Mean of values, and slope of the line through them.
pub fn mean_and_slope(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let moments = values.iter().enumerate();
    let moment: f64 = moments.map(|(k, value)| (k as f64 - middle) * value).sum();
    (
        mean(values),
        moment * 12.0 / (count * (count * count - 1.0)),
    )
}

/// Mean of values.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
