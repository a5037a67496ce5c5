//! What is linear in the errors.

use nalgebra::DMatrix;

/// Quantities that are linear in the errors, a row each: by state, and by constant that is no state.
#[derive(Debug)]
pub struct Linear {
    pub states: DMatrix<f64>,
    pub columns: DMatrix<f64>,
}

impl Linear {
    pub fn zeros(rows: usize, states: usize, columns: usize) -> Self {
        Self {
            states: DMatrix::zeros(rows, states),
            columns: DMatrix::zeros(rows, columns),
        }
    }

    /// Combinations of them, a row of weights each.
    pub fn combined(&self, weights: &DMatrix<f64>) -> Self {
        Self {
            states: weights * &self.states,
            columns: weights * &self.columns,
        }
    }

    /// The rows from a first on become more by others.
    pub fn add(&mut self, first: usize, others: &Self) {
        let count = others.states.nrows();
        let mut rows = self.states.rows_mut(first, count);
        rows += &others.states;
        let mut rows = self.columns.rows_mut(first, count);
        rows += &others.columns;
    }
}
