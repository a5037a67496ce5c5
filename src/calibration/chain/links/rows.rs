//! Observations of states and constants.

use nalgebra::{DMatrix, DVector};

/// Observations that are linear in states and constants, each with noise of σ = 1.
#[derive(Debug, Clone)]
pub struct Rows {
    /// Coefficients of the states.
    pub states: DMatrix<f64>,
    /// Coefficients of the constants.
    pub constants: DMatrix<f64>,
    /// Observed values.
    pub values: DVector<f64>,
}

impl Rows {
    pub fn none(states: usize, constants: usize) -> Self {
        Self {
            states: DMatrix::zeros(0, states),
            constants: DMatrix::zeros(0, constants),
            values: DVector::zeros(0),
        }
    }

    /// A set of this many rows, all zero.
    pub fn of(self, count: usize) -> Self {
        Self {
            states: DMatrix::zeros(count, self.states.ncols()),
            constants: DMatrix::zeros(count, self.constants.ncols()),
            values: DVector::zeros(count),
        }
    }

    /// Appends these rows to the rows `above`.
    pub fn and(self, above: Self) -> Self {
        let (m, k) = (above.values.len(), self.values.len());
        let mut all = above.of_more(k);
        all.states.rows_mut(m, k).copy_from(&self.states);
        all.constants.rows_mut(m, k).copy_from(&self.constants);
        all.values.rows_mut(m, k).copy_from(&self.values);
        all
    }

    fn of_more(self, more: usize) -> Self {
        let m = self.values.len();
        Self {
            states: self.states.insert_rows(m, more, 0.0),
            constants: self.constants.insert_rows(m, more, 0.0),
            values: self.values.insert_rows(m, more, 0.0),
        }
    }
}
