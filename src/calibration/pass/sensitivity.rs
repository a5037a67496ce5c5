//! What parameters that are no states of a pass would do to it.
//!
//! The filter is linear: with such parameters at q instead of zero its mean would be `x + U q`, and its
//! innovations `ν − G q` with the same covariance. U is carried along; the normal equations of q are
//! summed from G. Estimate and covariance of q, and what q does to every state, are those of a filter that
//! has q among its states, of any prior and any part of q (Friedland 1969, "Treatment of bias in
//! recursive filtering", IEEE Trans. Automatic Control 14(4)), without the cost of that filter.

use nalgebra::{DMatrix, DVector};

use super::measurement::ScalarInnovation;

/// Rows of the normal equations that are summed at once.
const ROWS: usize = 96;

/// Parameters that are tried in a pass, and what they do to it.
#[derive(Debug, Clone)]
pub(in crate::calibration) struct Sensitivity {
    /// U, a column for each state.
    of_states: DMatrix<f64>,
    /// Whitened rows `[G ν]` that are not yet in the sum, a column each.
    rows: DMatrix<f64>,
    filled: usize,
    /// Sum of `[G ν]ᵀ [G ν]`.
    sum: DMatrix<f64>,
}

impl Sensitivity {
    /// Of so many parameters and states, before anything is observed.
    pub fn new(parameters: usize, states: usize) -> Self {
        Self {
            of_states: DMatrix::zeros(parameters, states),
            rows: DMatrix::zeros(parameters + 1, ROWS),
            filled: 0,
            sum: DMatrix::zeros(parameters + 1, parameters + 1),
        }
    }

    /// A state is drawn anew, whatever the parameters are.
    pub fn redraw(&mut self, state: usize) {
        self.of_states.column_mut(state).fill(0.0);
    }

    /// A state forgets.
    pub fn scale(&mut self, state: usize, keep: f64) {
        self.of_states.column_mut(state).scale_mut(keep);
    }

    /// The states that move, each at its place, become `phi` times those that stand in its columns, plus
    /// what each parameter adds to them.
    pub fn propagate<const MOVING: usize>(
        &mut self,
        phi: &[[f64; MOVING]],
        place: impl Fn(usize) -> usize,
        added: impl Iterator<Item = (usize, [f64; MOVING])>,
    ) {
        let phi = DMatrix::from_fn(phi.len(), MOVING, |k, row| phi[k][row]);
        let mut moved = self.of_states.columns(0, phi.nrows()) * phi;
        for (parameter, by) in added {
            for (row, by) in by.into_iter().enumerate() {
                moved[(parameter, row)] += by;
            }
        }
        for (moving, column) in moved.column_iter().enumerate() {
            self.of_states.column_mut(place(moving)).copy_from(&column);
        }
    }

    /// A state becomes itself plus others by these weights.
    pub fn add(&mut self, state: usize, others: impl Iterator<Item = (usize, f64)>) {
        let mut sum = self.of_states.column(state).into_owned();
        for (other, weight) in others {
            sum.axpy(weight, &self.of_states.column(other), 1.0);
        }
        self.of_states.column_mut(state).copy_from(&sum);
    }

    /// A scalar measurement is taken in: H over states and parameters, gain, innovation and its
    /// variance.
    pub fn update(
        &mut self,
        [states, parameters]: [&[f64]; 2],
        gain: &[f64],
        ScalarInnovation {
            innovation,
            variance,
        }: ScalarInnovation,
    ) {
        let mut sensed = DVector::zeros(self.of_states.nrows());
        for (column, &weight) in self.of_states.column_iter().zip(states) {
            if weight != 0.0 {
                sensed.axpy(weight, &column, 1.0);
            }
        }
        for (sensed, weight) in sensed.iter_mut().zip(parameters) {
            *sensed += weight;
        }
        for (mut column, gain) in self.of_states.column_iter_mut().zip(gain) {
            column.axpy(-gain, &sensed, 1.0);
        }
        let whiten = variance.sqrt().recip();
        let mut row = self.rows.column_mut(self.filled);
        row.rows_mut(0, sensed.len()).copy_from(&(&sensed * whiten));
        row[sensed.len()] = innovation * whiten;
        self.filled += 1;
        if self.filled == ROWS {
            self.flush();
        }
    }

    fn flush(&mut self) {
        let rows = self.rows.columns(0, self.filled);
        self.sum.gemm(1.0, &rows, &rows.transpose(), 1.0);
        self.filled = 0;
    }

    /// Information of the parameters, the score (the gradient of ln of the likelihood at zero), and the
    /// derivative of these states' means.
    pub fn normal_equations(
        mut self,
        states: impl Iterator<Item = usize>,
    ) -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>) {
        self.flush();
        let n = self.of_states.nrows();
        let states: Vec<usize> = states.collect();
        (
            self.sum.view((0, 0), (n, n)).into_owned(),
            self.sum.view((0, n), (n, 1)).column(0).into_owned(),
            self.of_states.select_columns(&states).transpose(),
        )
    }
}
