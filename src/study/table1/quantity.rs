//! The quantities of the paper's table, and mean and standard deviation of each.

use crate::study::navigation::Quantity;

/// The errors in the table of the paper, in the same order; velocity and position errors are horizontal.
pub const QUANTITIES: ByQuantity<Quantity> = {
    let [pitch, roll, heading, _, _, velocity, _, _, position] = Quantity::ALL;
    [pitch, roll, heading, velocity, position]
};

/// A value for each of [`QUANTITIES`].
pub type ByQuantity<T> = [T; 5];

/// Mean and standard deviation (`n − 1`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub std: f64,
}

impl Moments {
    /// Moments of some values; NaN for fewer than two.
    pub(super) fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let n = values.clone().count() as f64;
        let mean = values.clone().sum::<f64>() / n;
        let squares: f64 = values.map(|x| (x - mean).powi(2)).sum();
        Self {
            mean,
            std: (squares / (n - 1.0)).sqrt(),
        }
    }
}
