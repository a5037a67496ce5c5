//! The posterior of constants.

use nalgebra::{DMatrix, DVector};

use super::{coefficients, parameters};
use crate::calibration::{
    Constant, Linearisation, Model, PARAMETERS, ParameterMatrix, ParameterVector, Thermal,
};

/// The posterior of constants.
#[derive(Debug, Clone)]
pub struct Posterior {
    /// The constants.
    pub constants: Vec<Constant>,
    /// Estimated errors of all constants.
    pub mean: DVector<f64>,
    /// Estimated errors of the parameters of both triads.
    pub parameters: ParameterVector,
    /// Covariance of all constants; zero for fixed constants.
    pub covariance: DMatrix<f64>,
    /// Covariance of the parameters of both triads.
    pub parameter_covariance: ParameterMatrix,
    /// Sum of squared normalised residuals, including those of the prior.
    pub cost: f64,
    /// −2 ln of the likelihood, up to a constant.
    pub deviance: f64,
}

impl Posterior {
    /// The posterior of constants; `shrinking` is the log of the squared ratio of prior volume to posterior volume.
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

    /// Estimates of the temperature coefficients, linearised at the point `at`; `None` if no parameter depends on
    /// temperature.
    pub fn thermal(&self, at: &Linearisation, model: &Model) -> Option<Thermal> {
        let of_model = model.thermal.as_deref()?;
        let (places, coefficients): (Vec<usize>, Vec<_>) = coefficients(&self.constants).unzip();
        let n = places.len();
        let mut cross = DMatrix::zeros(PARAMETERS, n);
        for (k, index) in parameters(&self.constants) {
            for (column, &place) in places.iter().enumerate() {
                cross[(index, column)] = self.covariance[(k, place)];
            }
        }
        Some(Thermal {
            model: of_model.clone(),
            values: DVector::from_fn(n, |k, _| {
                coefficients[k].of(&at.thermal) + self.mean[places[k]]
            }),
            covariance: self.covariance.select_rows(&places).select_columns(&places),
            cross,
            coefficients,
        })
    }
}

/// Extracts the parameters of both triads from a matrix of constants.
pub fn of_parameters(constants: &[Constant], of_constants: &DMatrix<f64>) -> ParameterMatrix {
    let mut all = ParameterMatrix::zeros();
    for (row, i) in parameters(constants) {
        for (column, j) in parameters(constants) {
            all[(i, j)] = of_constants[(row, column)];
        }
    }
    all
}
