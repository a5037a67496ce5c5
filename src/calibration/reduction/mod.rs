//! What a record says of the constants, at one point of linearisation and with given noise.
//!
//! The Kalman filter runs over what moves and what is drawn anew; constants are columns that it carries (see
//! [`super::filter::columns`]). Each dwell leaves whitened rows `[G ν]`, so that `ν = G c + noise of σ 1`: with a prior they
//! give the estimate of any part of the constants, without another pass.

mod script;

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::budget::BudgetSource;
use super::error::CalibrationError;
use super::filter::columns::triangle;
use super::layout::Constant;
use super::linearisation::Linearisation;
use super::model::Model;
use super::parameters::{ParameterMatrix, ParameterVector, to_vector};
use crate::calibration::several::thermal::Coefficient;
use crate::imu::Sensor;
pub use script::{Moves, Replay, Script};

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
    /// 1σ of each; zero of what is known to be at its mean.
    pub sigma: DVector<f64>,
}

/// What is known of constants with the data.
#[derive(Debug, Clone)]
pub struct Posterior {
    /// Errors of all constants.
    pub mean: DVector<f64>,
    /// Errors of the parameters of both triads.
    pub parameters: ParameterVector,
    /// Of all constants; zero of what was known.
    pub covariance: DMatrix<f64>,
    /// Of the parameters of both triads.
    pub parameter_covariance: ParameterMatrix,
    /// Squared residuals over their σ, with those of the prior.
    pub cost: f64,
    /// −2 ln of the likelihood, except a constant.
    pub deviance: f64,
}

impl Reduction {
    /// One triangle of the rows of all dwells: what remains of them where no dwell is looked at alone.
    pub fn folded(mut self) -> Self {
        let columns = self.constants.len() + 1;
        let empty = DMatrix::zeros(0, columns);
        let folded = self.dwells.iter().fold(empty, |folded, dwell| {
            let (above, below) = (folded.nrows(), dwell.nrows());
            let mut both = folded.resize_vertically(above + below, 0.0);
            both.rows_mut(above, below).copy_from(dwell);
            match both.nrows() > columns {
                true => triangle(&both),
                false => both,
            }
        });
        self.dwells = vec![folded];
        self
    }

    /// With what is known beforehand.
    ///
    /// # Errors
    /// [`CalibrationError::Singular`] where that and the data together leave a constant open.
    pub fn posterior(&self, prior: &Prior) -> Result<Posterior, CalibrationError> {
        let all = self.constants.len();
        let on: Vec<usize> = (0..all).filter(|&k| prior.sigma[k] > 0.0).collect();
        let off: Vec<usize> = (0..all).filter(|&k| prior.sigma[k] == 0.0).collect();
        let known = prior.mean.select_rows(&off);
        let n = on.len();
        let count: usize = self.dwells.iter().map(DMatrix::nrows).sum();
        let mut stacked = DMatrix::zeros(n + count, n + 1);
        for (row, &k) in on.iter().enumerate() {
            stacked[(row, row)] = prior.sigma[k].recip();
            stacked[(row, n)] = prior.mean[k] / prior.sigma[k];
        }
        let mut first = n;
        for dwell in &self.dwells {
            let mut rows = stacked.rows_mut(first, dwell.nrows());
            rows.columns_mut(0, n).copy_from(&dwell.select_columns(&on));
            let observed = dwell.column(all) - dwell.select_columns(&off) * &known;
            rows.set_column(n, &observed);
            first += dwell.nrows();
        }
        let triangle = triangle(&stacked);
        let root = triangle.view((0, 0), (n, n));
        let mut inverse = DMatrix::identity(n, n);
        if !root.solve_upper_triangular_mut(&mut inverse) {
            return Err(CalibrationError::Singular {
                sensor: Sensor::Gyro,
            });
        }
        let last = triangle.get((n, n)).copied().unwrap_or(0.0);
        let logarithms = root.diagonal().map(|of| of.abs().ln()).sum();
        let of_prior: f64 = on.iter().map(|&k| prior.sigma[k].ln()).sum();
        let mut mean = prior.mean.clone();
        let found = &inverse * triangle.view((0, n), (n, 1));
        let within = &inverse * inverse.transpose();
        let mut covariance = DMatrix::zeros(all, all);
        for (i, &row) in on.iter().enumerate() {
            mean[row] = found[i];
            for (j, &column) in on.iter().enumerate() {
                covariance[(row, column)] = within[(i, j)];
            }
        }
        let mut parameters = ParameterVector::zeros();
        for (row, index) in self.parameters() {
            parameters[index] = mean[row];
        }
        let cost = self.squares + last.powi(2);
        Ok(Posterior {
            parameter_covariance: self.of_parameters(&covariance),
            covariance,
            parameters,
            mean,
            cost,
            deviance: cost + self.log_determinant + 2.0 * (logarithms + of_prior),
        })
    }

    /// Information of the constants by the rows alone.
    pub fn information(&self) -> DMatrix<f64> {
        let n = self.constants.len();
        let mut information = DMatrix::zeros(n, n);
        for dwell in &self.dwells {
            let rows = dwell.columns(0, n);
            information += rows.tr_mul(&rows);
        }
        information
    }

    /// What prior σ of a model add to a covariance by their sources, which is exact: `P P₀⁻¹ P`.
    pub fn by_prior(&self, of: &Posterior, prior: &Prior) -> BTreeMap<BudgetSource, DMatrix<f64>> {
        let mut parts = BTreeMap::new();
        for (k, constant) in self.constants.iter().enumerate() {
            if prior.sigma[k] > 0.0 {
                let column = of.covariance.column(k) / prior.sigma[k];
                let n = self.constants.len();
                let zeros = || DMatrix::zeros(n, n);
                let part = parts.entry(constant.source()).or_insert_with(zeros);
                *part += &column * column.transpose();
            }
        }
        parts
    }

    /// A matrix of the constants as one of the parameters of both triads.
    pub fn of_parameters(&self, of_constants: &DMatrix<f64>) -> ParameterMatrix {
        let mut parameters = ParameterMatrix::zeros();
        for (row, i) in self.parameters() {
            for (column, j) in self.parameters() {
                parameters[(i, j)] = of_constants[(row, column)];
            }
        }
        parameters
    }

    /// The coefficients of temperature among the constants, with their places.
    pub fn coefficients(&self) -> impl Iterator<Item = (usize, Coefficient)> + '_ {
        let places = self.constants.iter().enumerate();
        places.filter_map(|(place, constant)| match constant {
            Constant::Thermal(coefficient) => Some((place, *coefficient)),
            _ => None,
        })
    }

    /// The parameters of both triads among the constants: place and index of each.
    fn parameters(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let places = self.constants.iter().enumerate();
        places.filter_map(|(place, constant)| match constant {
            Constant::Parameter(index) => Some((place, *index)),
            _ => None,
        })
    }
}

impl Posterior {
    /// What the covariance of another one lacks if this one's prior is right: the mean square error of what that
    /// one finds is the covariance here and the square of what is between them.
    pub fn added_to(&self, other: &Self) -> ParameterMatrix {
        let change = self.parameters - other.parameters;
        self.parameter_covariance - other.parameter_covariance + change * change.transpose()
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
