//! The Kalman filter of the chain, with the constants as sensitivity columns.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::effects::{Dispersion, Sizes};
use super::links::{Chain, Link, Rows, Transition};
use super::states::States;
use crate::calibration::constants::Sites;
use crate::calibration::{CalibrationError, Constant, Known, Posterior, Prior, Problem, Script};

/// Number of links whose rows are added at once.
const BLOCK: usize = 100;

/// A filtered link.
#[derive(Debug, Clone)]
pub struct Passed {
    /// States before the rows are used: the mean for the case that all constants are zero, the effect of the constants,
    /// and the covariance.
    pub mean: DVector<f64>,
    pub by_constants: DMatrix<f64>,
    pub covariance: DMatrix<f64>,
    /// `H P`, whitened.
    pub across: DMatrix<f64>,
    /// Coefficients of the states in the whitened innovations.
    pub rows: DMatrix<f64>,
    /// Coefficients of the constants in the whitened innovations.
    pub of_constants: DMatrix<f64>,
    /// Whitened innovations.
    pub innovations: DVector<f64>,
}

/// The filter after a link: mean given zero constants, effect of the constants, and covariance of the states.
#[derive(Debug, Clone)]
pub struct Forward {
    mean: DVector<f64>,
    by_constants: DMatrix<f64>,
    covariance: DMatrix<f64>,
    /// Log-determinant of the covariance of all innovations.
    log_determinant: f64,
}

/// A filtered chain.
pub struct Filtered<'a> {
    pub chain: &'a Chain,
    pub sizes: Sizes,
    pub passed: Vec<Passed>,
    log_determinant: f64,
}

impl Chain {
    /// Runs the filter with these sizes of the effects.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Diverged`] if a covariance is not positive definite.
    pub fn filter(&self, sizes: &Sizes) -> Result<Filtered<'_>, CalibrationError> {
        let mut forward = Forward::new(self.states.count, self.constants.len());
        let passed = self.links.iter().map(|link| forward.pass(link, sizes));
        let passed = passed.collect::<Result<_, _>>()?;
        Ok(Filtered {
            chain: self,
            sizes: sizes.clone(),
            passed,
            log_determinant: self.log_determinant + forward.log_determinant,
        })
    }

    /// Information on the constants from a filter with these sizes, without keeping its links.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Diverged`] if a part cannot be reduced, or a covariance is not positive definite.
    pub fn information(
        problem: &Problem,
        script: &Script,
        (dispersion, sizes): (&Dispersion, &Sizes),
    ) -> Result<DMatrix<f64>, CalibrationError> {
        let one_gravity = problem.one_gravity();
        let states = States::new(&problem.model, one_gravity);
        let count = Constant::all(&problem.model, one_gravity).len();
        let mut forward = Forward::new(states.count, count);
        let mut information = DMatrix::zeros(count, count);
        Self::each(problem, script, dispersion, |link| {
            let seen = forward.pass(&link, sizes)?.of_constants;
            information.gemm_tr(1.0, &seen, &seen, 1.0);
            Ok(())
        })?;
        Ok(information)
    }
}

impl Forward {
    /// The filter before the first link.
    pub fn new(states: usize, constants: usize) -> Self {
        Self {
            mean: DVector::zeros(states),
            by_constants: DMatrix::zeros(states, constants),
            covariance: DMatrix::zeros(states, states),
            log_determinant: 0.0,
        }
    }

    /// Filters one link.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Diverged`] if a covariance is not positive definite.
    fn pass(&mut self, link: &Link, sizes: &Sizes) -> Result<Passed, CalibrationError> {
        let (seen, log_determinant) = self
            .step(&link.transition, &link.rows, sizes)
            .ok_or(CalibrationError::Diverged { time: link.time })?;
        self.log_determinant += log_determinant;
        Ok(seen)
    }

    /// Filters a transition and the rows after it; also returns the log-determinant of the innovation covariance.
    /// `None` if this covariance is not positive definite.
    pub fn step(
        &mut self,
        transition: &Transition,
        rows: &Rows,
        sizes: &Sizes,
    ) -> Option<(Passed, f64)> {
        let mean = &transition.states * &self.mean + &transition.offset;
        let by_constants = &transition.states * &self.by_constants + &transition.constants;
        let mut covariance = &transition.states * &self.covariance * transition.states.transpose()
            + &transition.covariance;
        for drive in &transition.drives {
            let factor = sizes.of(drive.effect, drive.event);
            covariance.gemm(factor, &drive.by, &drive.by.transpose(), 1.0);
        }
        let (seen, log_determinant) = Passed::new(rows, mean, by_constants, covariance)?;
        self.mean = &seen.mean + seen.across.tr_mul(&seen.innovations);
        self.by_constants = &seen.by_constants - seen.across.tr_mul(&seen.of_constants);
        self.covariance = &seen.covariance - seen.across.tr_mul(&seen.across);
        Some((seen, log_determinant))
    }
}

impl Passed {
    /// Also returns the log-determinant of the innovation covariance; `None` if this covariance is not positive
    /// definite.
    fn new(
        rows: &Rows,
        mean: DVector<f64>,
        by_constants: DMatrix<f64>,
        covariance: DMatrix<f64>,
    ) -> Option<(Self, f64)> {
        let mut across = &rows.states * &covariance;
        let mut of_innovations = &across * rows.states.transpose();
        (0..rows.values.len()).for_each(|k| of_innovations[(k, k)] += 1.0);
        let root = Cholesky::new(of_innovations)?.unpack();
        let log_determinant = 2.0 * root.diagonal().map(f64::ln).sum();
        let mut innovations = &rows.values - &rows.states * &mean;
        let mut of_constants = &rows.states * &by_constants + &rows.constants;
        let mut states = rows.states.clone();
        let whitened = root.solve_lower_triangular_mut(&mut across)
            && root.solve_lower_triangular_mut(&mut innovations)
            && root.solve_lower_triangular_mut(&mut of_constants)
            && root.solve_lower_triangular_mut(&mut states);
        whitened.then_some((
            Self {
                mean,
                by_constants,
                covariance,
                across,
                rows: states,
                of_constants,
                innovations,
            },
            log_determinant,
        ))
    }
}

impl Filtered<'_> {
    /// Information on the constants from all rows and the prior.
    pub fn known(&self, prior: &Prior) -> Known {
        let c = self.chain.constants.len();
        let mut known = Known::new(prior.clone());
        for block in self.passed.chunks(BLOCK) {
            let count = block.iter().map(|of| of.innovations.len()).sum();
            let mut rows = DMatrix::zeros(count, c + 1);
            let mut first = 0;
            for of in block {
                let m = of.innovations.len();
                rows.view_mut((first, 0), (m, c))
                    .copy_from(&of.of_constants);
                rows.view_mut((first, c), (m, 1)).copy_from(&of.innovations);
                first += m;
            }
            known.learn(&rows);
        }
        known
    }

    /// The posterior of the constants from the information on them; `None` if a constant is undetermined.
    pub fn posterior_with(&self, known: &Known, sites: &Sites) -> Option<Posterior> {
        let of_rows = known.with(sites)?;
        Some(Posterior {
            cost: of_rows.cost + self.chain.squares,
            deviance: of_rows.deviance + self.chain.squares + self.log_determinant,
            ..of_rows
        })
    }

    /// Information on the constants from all rows.
    pub fn information(&self) -> DMatrix<f64> {
        let c = self.chain.constants.len();
        let mut information = DMatrix::zeros(c, c);
        for of in &self.passed {
            information.gemm_tr(1.0, &of.of_constants, &of.of_constants, 1.0);
        }
        information
    }
}
