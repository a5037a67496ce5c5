//! Effect of constants on a filter.
//!
//! The filter is linear: with constants at q instead of zero, its mean would be `x + U q`, and its innovations `ν − G
//! q` with the same covariance. U is propagated; whitened rows `[G ν]` are kept. They give the same estimate and
//! covariance of q, and the same effect of q on every state, as a filter with q among its states, for any prior and any
//! subset of q (Friedland 1969, "Treatment of bias in recursive filtering", IEEE Trans. Automatic Control 14(4)),
//! without the cost of that filter.

use nalgebra::{DMatrix, DVector};

use crate::calibration::constants::triangle;

/// Quantities that are linear in the errors, one row each: coefficients of states, and of constants that are not
/// states.
#[derive(Debug)]
pub struct Linear {
    pub states: DMatrix<f64>,
    pub columns: DMatrix<f64>,
}

impl Linear {
    /// Combinations of the quantities, each given by a row of weights.
    pub fn combined(&self, weights: &DMatrix<f64>) -> Self {
        Self {
            states: weights * &self.states,
            columns: weights * &self.columns,
        }
    }

    /// Adds other rows to the rows from a first one on.
    pub fn add(&mut self, first: usize, others: &Self) {
        let count = others.states.nrows();
        let mut rows = self.states.rows_mut(first, count);
        rows += &others.states;
        let mut rows = self.columns.rows_mut(first, count);
        rows += &others.columns;
    }
}

/// Effect of constants on a filter.
#[derive(Debug, Clone)]
pub struct Columns {
    /// U, a column for each state.
    pub of_states: DMatrix<f64>,
    /// Whitened rows `[G ν]`, in sequence …
    rows: Vec<f64>,
    /// … and the number of values already read.
    looked_at: usize,
    /// Sum of squares of the observations, independent of constants and states.
    pub squares: f64,
    /// Logarithm of the determinant of the covariance of the observations, given the constants.
    pub log_determinant: f64,
}

impl Columns {
    /// For this number of constants and states, before any observation.
    pub fn new(constants: usize, states: usize) -> Self {
        Self {
            of_states: DMatrix::zeros(constants, states),
            rows: Vec::new(),
            looked_at: 0,
            squares: 0.0,
            log_determinant: 0.0,
        }
    }

    /// Updates with measurements H by a gain, given the whitening matrix of their innovations and the whitened
    /// innovations.
    pub fn update(
        &mut self,
        h: &Linear,
        gain: &DMatrix<f64>,
        (whiten, whitened): (&DMatrix<f64>, &DVector<f64>),
    ) {
        let sensed = &h.states * self.of_states.transpose() + &h.columns;
        self.of_states
            .gemm(-1.0, &sensed.transpose(), &gain.transpose(), 1.0);
        self.log_determinant -= 2.0 * whiten.diagonal().map(f64::ln).sum();
        let sensed = whiten * sensed;
        for (row, value) in sensed.row_iter().zip(whitened) {
            self.rows.extend(row.iter().chain([value]));
        }
    }

    /// The rows not yet read.
    pub fn new_rows(&mut self) -> DMatrix<f64> {
        let rows = self.matrix(&self.rows[self.looked_at..]);
        self.looked_at = self.rows.len();
        rows
    }

    /// The rows since the last call, reduced to a triangle if that has fewer rows.
    pub fn take_rows(&mut self) -> DMatrix<f64> {
        let rows = self.matrix(&self.rows);
        self.rows.clear();
        self.looked_at = 0;
        if rows.nrows() > rows.ncols() {
            triangle(&rows)
        } else {
            rows
        }
    }

    fn matrix(&self, rows: &[f64]) -> DMatrix<f64> {
        let columns = self.of_states.nrows() + 1;
        DMatrix::from_row_slice(rows.len() / columns, columns, rows)
    }
}
