//! The links of a chain, made from the events of a recording.

mod given;
mod maker;
mod transition;

use nalgebra::{DMatrix, DVector, Matrix3};

use super::effects::Dispersion;
use super::states::States;
use crate::calibration::{CalibrationError, Constant, Problem, Script};
pub use given::Given;
use maker::Maker;
pub use maker::SLIP;
pub use transition::Transition;

/// Observations linear in states and constants, each with noise of σ 1.
#[derive(Debug, Clone)]
pub struct Rows {
    /// Per state.
    pub states: DMatrix<f64>,
    /// Per constant.
    pub constants: DMatrix<f64>,
    /// What was observed.
    pub values: DVector<f64>,
}

/// A transition, and what is observed after it.
#[derive(Debug, Clone)]
pub struct Link {
    /// Whether a stretch begins here.
    pub begins: bool,
    /// Number of the recording.
    pub recording: usize,
    /// Number of the dwell.
    pub dwell: usize,
    /// Computed attitude, if a dwell begins here.
    pub attitude: Option<Matrix3<f64>>,
    /// End of the part, s.
    pub time: f64,
    pub transition: Transition,
    pub rows: Rows,
    /// What the part is given.
    pub given: Given,
}

/// The links of all stretches.
#[derive(Debug, Clone)]
pub struct Chain {
    pub states: States,
    pub constants: Vec<Constant>,
    pub links: Vec<Link>,
    /// Number of scalars that were observed.
    pub observations: usize,
    /// Sum of squares of the observations within parts that depends on nothing else …
    pub squares: f64,
    /// … and logarithm of the determinant of their covariance.
    pub log_determinant: f64,
}

impl Rows {
    fn none(states: usize, constants: usize) -> Self {
        Self {
            states: DMatrix::zeros(0, states),
            constants: DMatrix::zeros(0, constants),
            values: DVector::zeros(0),
        }
    }

    /// This number of rows, all zero.
    fn of(self, count: usize) -> Self {
        Self {
            states: DMatrix::zeros(count, self.states.ncols()),
            constants: DMatrix::zeros(count, self.constants.ncols()),
            values: DVector::zeros(count),
        }
    }

    /// With others above them.
    fn and(self, above: Self) -> Self {
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

impl Chain {
    /// The same without the rows of some dwells, given by number.
    pub fn observed_in(&self, used: impl Fn(usize) -> bool) -> Self {
        let mut part = self.clone();
        let (n, c) = (self.states.count, self.constants.len());
        for link in part.links.iter_mut().filter(|link| !used(link.dwell)) {
            link.rows = Rows::none(n, c);
        }
        part
    }

    /// The links of a problem, from its events at one linearisation point, with this dispersion of the dwells.
    ///
    /// # Errors
    /// [`CalibrationError::Diverged`] if a part of a dwell cannot be reduced.
    pub fn new(
        problem: &Problem,
        script: &Script,
        dispersion: &Dispersion,
    ) -> Result<Self, CalibrationError> {
        let one_gravity = problem.one_gravity();
        let states = States::new(&problem.model, one_gravity);
        let constants = Constant::all(&problem.model, one_gravity);
        let mut maker = Maker::new((problem, dispersion), &states, &constants);
        for number in 0..problem.stretches().len() {
            maker.stretch(script, number)?;
        }
        let Maker {
            links,
            squares,
            log_determinant,
            observations,
            ..
        } = maker;
        Ok(Self {
            links,
            observations,
            squares,
            log_determinant,
            states,
            constants,
        })
    }
}
