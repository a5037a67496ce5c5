//! A transition of the states, with its disturbances.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::calibration::chain::effects::Effect;

/// Independent disturbances of the states, each with σ = 1 before scaling by the size of its effect.
#[derive(Debug, Clone)]
pub struct Drive {
    pub effect: Effect,
    /// Number of the event among all events of its effect: the number of its move or position, or of the dwell after
    /// it.
    pub event: usize,
    /// Change of the states for a unit disturbance, one column per disturbance.
    pub by: DMatrix<f64>,
}

/// `x ← transition x + constants c + offset + drives + noise`
#[derive(Debug, Clone)]
pub struct Transition {
    pub states: DMatrix<f64>,
    pub constants: DMatrix<f64>,
    pub offset: DVector<f64>,
    pub drives: Vec<Drive>,
    /// Covariance of the noise at rest in the preceding part.
    pub covariance: DMatrix<f64>,
}

impl Transition {
    /// The transition that keeps all states.
    pub fn identity(states: usize, constants: usize) -> Self {
        Self {
            states: DMatrix::identity(states, states),
            constants: DMatrix::zeros(states, constants),
            offset: DVector::zeros(states),
            drives: Vec::new(),
            covariance: DMatrix::zeros(states, states),
        }
    }

    /// Appends a linear change of the states.
    pub fn then(&mut self, states: &DMatrix<f64>) {
        self.states = states * &self.states;
        self.constants = states * &self.constants;
        self.offset = states * &self.offset;
        for drive in &mut self.drives {
            drive.by = states * &drive.by;
        }
        self.covariance = states * &self.covariance * states.transpose();
    }

    /// Appends an effect of constants on the states, starting with the state `first`.
    pub fn add_constants(&mut self, first: usize, by: &DMatrix<f64>) {
        let mut rows = self.constants.rows_mut(first, by.nrows());
        rows += by;
    }

    /// Appends a disturbance that acts on the states, starting with the state `first`.
    pub fn drive(&mut self, effect: Effect, event: usize, first: usize, root: &DMatrix<f64>) {
        if root.amax() > 0.0 {
            let mut by = DMatrix::zeros(self.offset.len(), root.ncols());
            by.rows_mut(first, root.nrows()).copy_from(root);
            self.drives.push(Drive { effect, event, by });
        }
    }

    /// Resets some states to these values, independently of all earlier ones.
    pub fn reset(&mut self, which: Range<usize>, mean: &[f64]) {
        for (state, mean) in which.zip(mean) {
            self.states.row_mut(state).fill(0.0);
            self.constants.row_mut(state).fill(0.0);
            self.offset[state] = *mean;
            for drive in &mut self.drives {
                drive.by.row_mut(state).fill(0.0);
            }
            self.covariance.row_mut(state).fill(0.0);
            self.covariance.column_mut(state).fill(0.0);
        }
    }
}
