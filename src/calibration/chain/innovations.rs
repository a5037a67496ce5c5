//! Innovations of single observations, and the estimate as a function of time that a real-time filter would compute.

use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen};

use super::Filtered;
use super::effects::Dispersion;
use super::links::Link;
use super::part::{Whitened, filter_of, part_filters};
use crate::calibration::constants::{Sites, triangle};
use crate::calibration::record::Rest;
use crate::calibration::{
    CalibrationError, Epoch, Innovation, Known, Linearisation, MagneticEstimate, Model, Posterior,
    Prior, Problem, Script, to_vector,
};

/// Maximum number of points of the estimate against time.
const EPOCHS: usize = 300;

/// Mean of the quantities given to a part, and a square root of their covariance.
struct Expected {
    mean: DVector<f64>,
    root: DMatrix<f64>,
}

impl Filtered<'_> {
    /// Innovations of all observations, each predicted from the preceding observations, and the estimate after parts of
    /// dwells. `sites` gives the priors of the constants that may be absent.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Diverged`] if a covariance is not positive definite.
    pub fn innovations(
        &self,
        (problem, script): (&Problem, &Script),
        (prior, sites): (&Prior, &Sites),
        dispersion: &Dispersion,
    ) -> Result<(Vec<Innovation>, Vec<Epoch>), CalibrationError> {
        let mut known = Known::new(prior.clone());
        let undetermined = CalibrationError::Diverged { time: 0.0 };
        known.learn(&rows_of(sites, prior).ok_or(undetermined)?);
        let mut filters = part_filters(self.chain.states.moving);
        let rests = (0..problem.stretches().len()).flat_map(|stretch| {
            let rests = script.parts(stretch).filter(|rest| !rest.models.is_empty());
            rests.map(move |rest| (rest, &problem.stretches()[stretch]))
        });
        let every = self.chain.links.len().div_ceil(EPOCHS).max(1);
        let (mut innovations, mut epochs) = (Vec::new(), Vec::new());
        for (number, (rest, stretch)) in rests.enumerate() {
            let (link, passed) = (&self.chain.links[number], &self.passed[number]);
            let diverged = || CalibrationError::Diverged { time: link.time };
            let mut expected = self.expected(number, &known);
            let factor = dispersion.of(link.dwell).sqrt();
            let mut found = true;
            let filter = &mut filters[filter_of(rest)];
            let reduced = filter.reduce((rest, stretch), &problem.model, &mut |of| {
                let innovation = expected.innovation(&of, factor, (rest, link));
                found &= innovation.is_some();
                innovations.extend(innovation);
            });
            if reduced.is_none() || !found {
                return Err(diverged());
            }
            let columns = passed.of_constants.ncols();
            let mut rows = passed.of_constants.clone().insert_column(columns, 0.0);
            rows.set_column(columns, &passed.innovations);
            known.learn(&rows);
            if (number + 1) % every == 0 || number + 1 == self.chain.links.len() {
                let here = known.with(&Sites::none(prior)).ok_or_else(diverged)?;
                epochs.push(Epoch::new(link.time, &script.at, &here, &problem.model));
            }
        }
        Ok((innovations, epochs))
    }

    /// Quantities given to a part, from all rows before it.
    fn expected(&self, number: usize, known: &Known) -> Expected {
        let (link, passed) = (&self.chain.links[number], &self.passed[number]);
        let given = &link.given;
        let weights = &given.states * &passed.by_constants + &given.constants;
        let (of_constants, root_of_constants) = known.through(&weights);
        let of_states = root(&given.states * &passed.covariance * given.states.transpose());
        let (n, k) = (of_states.nrows(), of_states.ncols());
        let mut both = DMatrix::zeros(n, k + root_of_constants.ncols());
        both.columns_mut(0, k).copy_from(&of_states);
        both.columns_mut(k, root_of_constants.ncols())
            .copy_from(&root_of_constants);
        Expected {
            mean: &given.states * &passed.mean + of_constants,
            root: triangle(&both.transpose()).transpose(),
        }
    }
}

impl Expected {
    /// The innovation of an observation; it updates the expectation in Potter's form for three scalars at once: `S − S
    /// Bᵀ L⁻ᵀ (L + 1)⁻¹ B` (Andrews 1968, "A square root formulation of the Kalman covariance equations", AIAA Journal
    /// 6(6)). `factor` multiplies the noise σ of the dwell.
    fn innovation(
        &mut self,
        of: &Whitened,
        factor: f64,
        (rest, link): (&Rest, &Link),
    ) -> Option<Innovation> {
        let rows = DMatrix::from_row_slice(3, of.rows.len() / 3, of.rows) / factor;
        let by_root = &rows * &self.root;
        let covariance: Matrix3<f64> =
            (&by_root * by_root.transpose()).fixed_view::<3, 3>(0, 0) + Matrix3::identity();
        let root = covariance.cholesky()?.l();
        let expected = &rows * &self.mean;
        let off = of.scalars / factor - expected.fixed_rows::<3>(0);
        let whitened = root.solve_lower_triangular(&off)?;
        let inverse = root.try_inverse()?;
        let gaining = inverse * by_root.fixed_rows::<3>(0);
        let gain = &self.root * gaining.transpose();
        let shrinking = (root + Matrix3::identity()).try_inverse()? * by_root.fixed_rows::<3>(0);
        self.mean += &gain * whitened;
        self.root -= gain * shrinking;
        let observed = rest.seen[of.number];
        let step = rest
            .steps
            .iter()
            .find(|step| step.seen.contains(&of.number));
        whitened.norm_squared().is_finite().then_some(Innovation {
            time: step.map_or(link.time, |step| step.time),
            observation: observed.kind,
            whitened: whitened.into(),
            sigma: std::array::from_fn(|k| of.root[(k, k)] * root[(k, k)] * factor),
            dwell: link.dwell,
            after_move: rest.new_position,
        })
    }
}

/// A square root of a covariance that may be singular.
fn root(covariance: DMatrix<f64>) -> DMatrix<f64> {
    let scale = covariance.diagonal().map(|value| value.max(0.0).sqrt());
    let inverse = scale.map(|of| if of > 0.0 { of.recip() } else { 0.0 });
    let n = scale.len();
    let scaled = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] * inverse[i] * inverse[j]);
    let eigen = SymmetricEigen::new(scaled);
    let roots = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
    DMatrix::from_diagonal(&scale) * eigen.eigenvectors * DMatrix::from_diagonal(&roots)
}

/// Rows equivalent to the sites of the constants that may be absent; `None` if one is not positive definite.
fn rows_of(sites: &Sites, prior: &Prior) -> Option<DMatrix<f64>> {
    let (n, m) = (prior.sigma.len(), prior.candidates);
    let mut rows = DMatrix::zeros(m, n + 1);
    if m > 0 {
        let root = sites.information.matrix.clone().cholesky()?.unpack();
        rows.columns_mut(n - m, m).copy_from(&root.transpose());
        rows.set_column(n, &root.solve_lower_triangular(&sites.information.vector)?);
    }
    Some(rows)
}

impl Epoch {
    fn new(time: f64, at: &Linearisation, posterior: &Posterior, model: &Model) -> Self {
        let variance = posterior.parameter_covariance.diagonal();
        Self {
            time,
            estimate: to_vector(&at.triads) + posterior.parameters,
            sigma: variance.map(|variance| variance.max(0.0).sqrt()),
            magnetic: MagneticEstimate::new(posterior, at, model).map(|of| of.sigma()),
        }
    }
}
