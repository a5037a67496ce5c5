//! Score and information of constants that are not estimated, beside those that are.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::calibration::checks::error_term_test::Evidence;
use crate::calibration::{Constant, Disturbance, ErrorTerm, Prior, Reduction};

/// Scores of the constants that are not estimated, beside those that are.
pub struct Scores {
    constants: Vec<Constant>,
    /// 1σ of each before the data.
    sigma: DVector<f64>,
    score: DVector<f64>,
    information: DMatrix<f64>,
}

impl Scores {
    /// Of those that are off; none where rounding has the last word.
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

    /// By how much the cost falls with a disturbance, and its components; none where the data do not show all of them.
    pub fn of_disturbance(&self, disturbance: Disturbance) -> Option<(f64, Vector3<f64>)> {
        let mut constants = self.constants.iter();
        let first = constants.position(|of| *of == Constant::Disturbance(disturbance, 0))?;
        let score = self.score.fixed_rows::<3>(first);
        let value = self.information.fixed_view::<3, 3>(first, first);
        let value = value.into_owned().cholesky()?.solve(&score);
        Some((score.dot(&value), value))
    }

    /// χ² and degrees of freedom of what an error term of its usual size explains.
    pub fn of_term(&self, term: ErrorTerm) -> Option<(f64, f64)> {
        let constants = self.constants.iter().enumerate();
        let of = constants.filter(|(_, constant)| constant.error_term() == Some(term));
        let of: Vec<usize> = of.map(|(place, _)| place).collect();
        let sigma = DMatrix::from_diagonal(&self.sigma.select_rows(&of));
        let information = self.information.select_rows(&of).select_columns(&of);
        let information = &sigma * information * &sigma + DMatrix::identity(of.len(), of.len());
        let covariance = information.cholesky()?.inverse();
        let score = &sigma * self.score.select_rows(&of);
        let gain = score.dot(&(&covariance * &score));
        Evidence::new(gain, &covariance).chi_square()
    }
}
