//! What parameters that are no states of a pass would do to it.
//!
//! The filter is linear: with such parameters at q instead of zero its mean would be `x + U q`, and its
//! innovations `ν − G q` with the same covariance. U is carried along; the normal equations of q are
//! summed from G. Estimate and covariance of q, and what q does to every state, are those of a filter that
//! has q among its states, of any prior and any part of q (Friedland 1969, "Treatment of bias in
//! recursive filtering", IEEE Trans. Automatic Control 14(4)), without the cost of that filter.

use nalgebra::{DMatrix, DVector};

use super::linear::Linear;

/// Parameters that are tried in a pass, and what they do to it.
#[derive(Debug, Clone)]
pub struct Sensitivity {
    /// U, a column for each state.
    of_states: DMatrix<f64>,
    /// Sum of `[G ν]ᵀ [G ν]`, whitened.
    sum: DMatrix<f64>,
}

impl Sensitivity {
    /// Of so many parameters and states, before anything is observed.
    pub fn new(parameters: usize, states: usize) -> Self {
        Self {
            of_states: DMatrix::zeros(parameters, states),
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

    /// The states that move become what `transition` makes of the first states, plus what each parameter adds to
    /// them (rows, by parameter).
    pub fn propagate(&mut self, moving: &[usize], transition: &DMatrix<f64>, added: &DMatrix<f64>) {
        let first = self.of_states.columns(0, transition.ncols());
        let moved = first * transition.transpose() + added;
        for (&state, column) in moving.iter().zip(moved.column_iter()) {
            self.of_states.column_mut(state).copy_from(&column);
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

    /// Measurements H are taken in by a gain: what whitens their innovations, and the whitened innovations.
    pub fn update(
        &mut self,
        h: &Linear,
        gain: &DMatrix<f64>,
        (whiten, whitened): (&DMatrix<f64>, &DVector<f64>),
    ) {
        let sensed = &h.states * self.of_states.transpose() + &h.columns;
        self.of_states
            .gemm(-1.0, &sensed.transpose(), &gain.transpose(), 1.0);
        let last = sensed.ncols();
        let mut rows = (whiten * sensed).insert_column(last, 0.0);
        rows.set_column(last, whitened);
        self.sum.gemm(1.0, &rows.transpose(), &rows, 1.0);
    }

    /// Information of the parameters, the score (the gradient of ln of the likelihood at zero), and the
    /// derivative of these states' means.
    pub fn normal_equations(
        self,
        states: impl Iterator<Item = usize>,
    ) -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>) {
        let n = self.of_states.nrows();
        let states: Vec<usize> = states.collect();
        (
            self.sum.view((0, 0), (n, n)).into_owned(),
            self.sum.view((0, n), (n, 1)).column(0).into_owned(),
            self.of_states.select_columns(&states).transpose(),
        )
    }
}
