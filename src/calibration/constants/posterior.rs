//! What is known of constants with the data.

use nalgebra::{DMatrix, DVector};

use super::parameters;
use crate::calibration::{Constant, ParameterMatrix, ParameterVector};

/// What is known of constants with the data.
#[derive(Debug, Clone)]
pub struct Posterior {
    /// Of which.
    pub constants: Vec<Constant>,
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

impl Posterior {
    /// Of constants, with the logarithm of how many times the data shrank their volume, squared.
    pub fn new(
        constants: &[Constant],
        mean: DVector<f64>,
        covariance: DMatrix<f64>,
        cost: f64,
        shrinking: f64,
    ) -> Self {
        let mut errors = ParameterVector::zeros();
        for (k, index) in parameters(constants) {
            errors[index] = mean[k];
        }
        Self {
            parameters: errors,
            parameter_covariance: of_parameters(constants, &covariance),
            constants: constants.to_vec(),
            covariance,
            mean,
            cost,
            deviance: cost + shrinking,
        }
    }

    /// The same with another covariance.
    pub fn with_covariance(self, covariance: DMatrix<f64>) -> Self {
        Self {
            parameter_covariance: of_parameters(&self.constants, &covariance),
            covariance,
            ..self
        }
    }

    /// What the covariance of another one lacks if this one's prior is right: the mean square error of what that
    /// one finds is the covariance here and the square of what is between them.
    pub fn added_to(&self, other: &Self) -> ParameterMatrix {
        let change = self.parameters - other.parameters;
        self.parameter_covariance - other.parameter_covariance + change * change.transpose()
    }
}

/// A matrix of constants as one of the parameters of both triads.
pub fn of_parameters(constants: &[Constant], of_constants: &DMatrix<f64>) -> ParameterMatrix {
    let mut all = ParameterMatrix::zeros();
    for (row, i) in parameters(constants) {
        for (column, j) in parameters(constants) {
            all[(i, j)] = of_constants[(row, column)];
        }
    }
    all
}
