//! The links of a chain, made from the events of a recording.

mod given;
mod link;
mod magnetic;
mod maker;
mod rows;
mod transition;

use super::effects::Dispersion;
use super::states::States;
use crate::calibration::{CalibrationError, Constant, Problem, Script};
pub use link::Link;
use maker::Maker;
pub use rows::Rows;
pub use transition::Transition;

/// The links of all stretches.
#[derive(Debug, Clone)]
pub struct Chain {
    pub states: States,
    pub constants: Vec<Constant>,
    pub links: Vec<Link>,
    /// Number of scalars that were observed.
    pub observations: usize,
    /// 1σ of the slip in one move, divided by the 1σ of a table position.
    pub slip: f64,
    /// Sum of squares of the observations within parts that does not depend on states or constants.
    pub squares: f64,
    /// Log-determinant of the covariance of the observations within parts.
    pub log_determinant: f64,
}

impl Chain {
    /// A copy without the rows of the dwells with these numbers.
    pub fn observed_in(mut self, used: impl Fn(usize) -> bool) -> Self {
        let (n, c) = (self.states.count, self.constants.len());
        for link in self.links.iter_mut().filter(|link| !used(link.dwell)) {
            link.rows = Rows::none(n, c);
        }
        self
    }

    /// The links of a problem, made from its events at one linearisation point, with this dispersion of the dwells.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Diverged`] if a part of a dwell cannot be reduced.
    pub fn new(
        problem: &Problem,
        script: &Script,
        dispersion: &Dispersion,
    ) -> Result<Self, CalibrationError> {
        let mut links = Vec::new();
        let chain = Self::each(problem, script, dispersion, |link| {
            links.push(link);
            Ok(())
        })?;
        Ok(Self { links, ..chain })
    }

    /// A chain whose links are visited one by one.
    pub fn each(
        problem: &Problem,
        script: &Script,
        dispersion: &Dispersion,
        take: impl FnMut(Link) -> Result<(), CalibrationError>,
    ) -> Result<Self, CalibrationError> {
        let one_gravity = problem.one_gravity();
        let states = States::new(&problem.model, one_gravity);
        let constants = Constant::all(&problem.model, one_gravity);
        let mut maker = Maker::new((problem, dispersion), &states, &constants, take);
        for number in 0..problem.stretches().len() {
            maker.stretch(script, number)?;
        }
        let Maker {
            squares,
            log_determinant,
            observations,
            ..
        } = maker;
        Ok(Self {
            links: Vec::new(),
            observations,
            slip: problem.slip(),
            squares,
            log_determinant,
            states,
            constants,
        })
    }
}
