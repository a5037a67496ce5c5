//! Score and information of constants that are not estimated, given the estimated ones.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::calibration::checks::error_term_test::Evidence;
use crate::calibration::{Constant, Disturbance, ErrorTerm, Prior, Reduction};

/// A cause that explains a recording better than its model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// A single event.
    Disturbance(Disturbance),
    /// An error term.
    Term(ErrorTerm),
}

impl Cause {
    /// The cause to which a constant belongs, if any.
    pub fn of(constant: &Constant) -> Option<Self> {
        match *constant {
            Constant::Disturbance(of, _) => Some(Self::Disturbance(of)),
            constant => constant.error_term().map(Self::Term),
        }
    }
}

/// Scores of the constants that are not estimated, given the estimated ones.
pub struct Scores {
    constants: Vec<Constant>,
    /// Prior 1σ of each.
    sigma: DVector<f64>,
    score: DVector<f64>,
    information: DMatrix<f64>,
}

impl Scores {
    /// Scores of the constants that `is_off` selects; `None` if rounding makes the information matrix singular.
    pub fn new(
        reduction: &Reduction,
        prior: &Prior,
        is_off: impl Fn(&Constant) -> bool,
    ) -> Option<Self> {
        let constants = &reduction.constants;
        let n = constants.len();
        let (off, on): (Vec<usize>, Vec<usize>) = (0..n).partition(|&k| is_off(&constants[k]));
        let squares = reduction.squares();
        let within =
            |rows: &[usize], columns: &[usize]| squares.select_rows(rows).select_columns(columns);
        let mut among = within(&on, &on);
        let mut right = within(&on, &[n]);
        for (i, &k) in on.iter().enumerate() {
            among[(i, i)] += prior.sigma[k].powi(-2);
            right[i] += prior.mean[k] / prior.sigma[k].powi(2);
        }
        // Each over its own σ, lest different units spoil the digits.
        let scale = DMatrix::from_diagonal(&among.map_diagonal(|own| own.powf(-0.5)));
        let root = (&scale * among * &scale).cholesky()?;
        let across = &scale * within(&on, &off);
        let explained = root.solve(&across);
        let score = within(&off, &[n]) - explained.tr_mul(&(&scale * right));
        Some(Self {
            constants: off.iter().map(|&k| constants[k]).collect(),
            sigma: prior.sigma.select_rows(&off),
            score: score.column(0).into_owned(),
            information: within(&off, &off) - explained.tr_mul(&across),
        })
    }

    /// χ² of a cause under the null hypothesis, its degrees of freedom and its components; `None` if the cause is not
    /// observed, or a single event only in part. An error term has its usual size, and no components.
    pub fn explained_by(&self, cause: Cause) -> Option<(f64, f64, Vector3<f64>)> {
        let constants = self.constants.iter().enumerate();
        let of = constants.filter(|(_, constant)| Cause::of(constant) == Some(cause));
        let of: Vec<usize> = of.map(|(place, _)| place).collect();
        let score = self.score.select_rows(&of);
        let information = self.information.select_rows(&of).select_columns(&of);
        if let Cause::Disturbance(_) = cause {
            let value = information.cholesky()?.solve(&score);
            let components = Vector3::from_column_slice(value.as_slice());
            return Some((score.dot(&value), of.len() as f64, components));
        }
        let sigma = DMatrix::from_diagonal(&self.sigma.select_rows(&of));
        let information = &sigma * information * &sigma + DMatrix::identity(of.len(), of.len());
        let (covariance, score) = (information.cholesky()?.inverse(), &sigma * score);
        let gain = score.dot(&(&covariance * &score));
        let (square, degrees) = Evidence::new(gain, &covariance).chi_square()?;
        Some((square, degrees, Vector3::zeros()))
    }
}
