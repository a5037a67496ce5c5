//! What is linear in the errors.

use nalgebra::DMatrix;

/// Quantities that are linear in the errors, a row each: by state, and by parameter that is tried.
#[derive(Debug)]
pub struct Linear {
    pub states: DMatrix<f64>,
    pub tried: DMatrix<f64>,
}

impl Linear {
    pub fn zeros(rows: usize, states: usize, tried: usize) -> Self {
        Self {
            states: DMatrix::zeros(rows, states),
            tried: DMatrix::zeros(rows, tried),
        }
    }

    /// Combinations of them, a row of weights each.
    pub fn combined(&self, weights: &DMatrix<f64>) -> Self {
        Self {
            states: weights * &self.states,
            tried: weights * &self.tried,
        }
    }

    /// The rows from a first on become more by others.
    pub fn add(&mut self, first: usize, others: &Self) {
        let count = others.states.nrows();
        let mut rows = self.states.rows_mut(first, count);
        rows += &others.states;
        let mut rows = self.tried.rows_mut(first, count);
        rows += &others.tried;
    }
}
