//! What a record says of the constants, at one point of linearisation and with given noise.
//!
//! The Kalman filter runs over what moves and what is drawn anew; constants are columns that it carries (see
//! [`super::filter::columns`]). Each dwell leaves whitened rows `[G ν]`, so that `ν = G c + noise of σ 1`: with a prior they
//! give the estimate of any part of the constants, without another pass.

use nalgebra::{DMatrix, DVector};

use super::error::CalibrationError;
use super::layout::Constant;
use super::linearisation::Linearisation;
use super::model::Model;
use super::noise::Script;
use super::parameters::to_vector;
use super::problem::Problem;

/// Whitened rows of all dwells.
#[derive(Debug, Clone)]
pub struct Reduction {
    /// The constants that rows have columns of; the last column is what was observed.
    pub constants: Vec<Constant>,
    /// The rows of each dwell.
    pub dwells: Vec<DMatrix<f64>>,
    /// Squares that no constant has a part in.
    pub squares: f64,
    /// Logarithm of the determinant of the covariance of all that was observed, the constants given.
    pub log_determinant: f64,
}

/// What is known of constants beforehand, as errors of the point of linearisation.
#[derive(Debug, Clone)]
pub struct Prior {
    pub mean: DVector<f64>,
    /// 1σ of each; zero of one that is off.
    pub sigma: DVector<f64>,
}

/// What is known of constants with the data.
#[derive(Debug, Clone)]
pub struct Posterior {
    /// Zero of those that are off, as in the covariance.
    pub mean: DVector<f64>,
    pub covariance: DMatrix<f64>,
    /// Squared residuals over their σ, with those of the prior.
    pub cost: f64,
    /// −2 ln of the likelihood, except a constant.
    pub deviance: f64,
}

impl Reduction {
    /// Of what is let in.
    pub fn new(
        script: &Script,
        problem: &Problem,
        accepted: &[bool],
    ) -> Result<Self, CalibrationError> {
        script.reduce(problem, accepted)
    }

    /// With what is known beforehand; `None` where that and the data together leave a constant open.
    pub fn posterior(&self, prior: &Prior) -> Option<Posterior> {
        let on: Vec<usize> = (0..self.constants.len())
            .filter(|&k| prior.sigma[k] > 0.0)
            .collect();
        let n = on.len();
        let observed = self.constants.len();
        let count: usize = self.dwells.iter().map(DMatrix::nrows).sum();
        let mut stacked = DMatrix::zeros(n + count, n + 1);
        for (row, &k) in on.iter().enumerate() {
            stacked[(row, row)] = prior.sigma[k].recip();
            stacked[(row, n)] = prior.mean[k] / prior.sigma[k];
        }
        let mut first = n;
        for dwell in &self.dwells {
            for (place, &k) in on.iter().chain([&observed]).enumerate() {
                let mut column = stacked.view_mut((first, place), (dwell.nrows(), 1));
                column.copy_from(&dwell.column(k));
            }
            first += dwell.nrows();
        }
        let triangle = stacked.qr().unpack_r();
        let root = triangle.view((0, 0), (n, n));
        let mut inverse = DMatrix::identity(n, n);
        let solved = root.solve_upper_triangular_mut(&mut inverse);
        let last = triangle.get((n, n)).copied().unwrap_or(0.0);
        let logarithms = root.diagonal().map(|of| of.abs().ln()).sum();
        let of_prior: f64 = on.iter().map(|&k| prior.sigma[k].ln()).sum();
        let found = &inverse * triangle.view((0, n), (n, 1));
        let within = &inverse * inverse.transpose();
        let mut mean = DVector::zeros(observed);
        let mut covariance = DMatrix::zeros(observed, observed);
        for (i, &row) in on.iter().enumerate() {
            mean[row] = found[i];
            for (j, &column) in on.iter().enumerate() {
                covariance[(row, column)] = within[(i, j)];
            }
        }
        let cost = self.squares + last.powi(2);
        solved.then_some(Posterior {
            mean,
            covariance,
            cost,
            deviance: cost + self.log_determinant + 2.0 * (logarithms + of_prior),
        })
    }
}

impl Prior {
    /// Of these constants, by a model, as errors of this point.
    pub fn new(constants: &[Constant], model: &Model, at: &Linearisation) -> Self {
        let parameters = model.prior_mean - to_vector(&at.triads);
        let of = |constant: &Constant| match *constant {
            Constant::Parameter(index) => (parameters[index], model.prior_sigma[index]),
            Constant::Term(index) => (-at.terms[index], model.term_sigma[index]),
            Constant::Thermal(of) => {
                let sigma = model.thermal.as_deref();
                let sigma = sigma.map_or(0.0, |thermal| of.of(&thermal.sigma));
                (-of.of(&at.thermal), sigma)
            }
            Constant::Gravity => (0.0, model.gravity_sigma),
            Constant::Base(axis) => (0.0, model.geometry.base[axis]),
            Constant::Axis(index) => (0.0, model.geometry.axes[index]),
        };
        let (mean, sigma): (Vec<f64>, Vec<f64>) = constants.iter().map(of).unzip();
        Self {
            mean: mean.into(),
            sigma: sigma.into(),
        }
    }
}

#[cfg(test)]
mod tests;
