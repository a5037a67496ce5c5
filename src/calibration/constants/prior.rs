//! The prior of constants.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::calibration::budget::source::BudgetSource;
use crate::calibration::{Constant, Linearisation, Model, Posterior, parameter, to_vector};
use crate::imu::PARAMETERS as PER_TRIAD;

/// The prior of constants, as errors of the linearisation point.
#[derive(Debug, Clone)]
pub struct Prior {
    /// The constants.
    pub constants: Vec<Constant>,
    pub mean: DVector<f64>,
    /// 1σ of each; zero for constants fixed at their mean.
    pub sigma: DVector<f64>,
}

impl Prior {
    /// The prior of these constants in a model, as errors of this point.
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
            Constant::Disturbance(of, component) => {
                let bias = |sensor| model.prior_sigma[parameter(sensor, PER_TRIAD - 3 + component)];
                (0.0, of.sigma(bias))
            }
        };
        let (mean, sigma): (Vec<f64>, Vec<f64>) = constants.iter().map(of).unzip();
        Self {
            constants: constants.to_vec(),
            mean: mean.into(),
            sigma: sigma.into(),
        }
    }

    /// Its exact contribution to a covariance, by source: `P P₀⁻¹ P`.
    pub fn parts(&self, of: &Posterior) -> BTreeMap<BudgetSource, DMatrix<f64>> {
        let n = self.constants.len();
        let mut parts = BTreeMap::new();
        for (k, constant) in self.constants.iter().enumerate() {
            if self.sigma[k] > 0.0 {
                let column = of.covariance.column(k) / self.sigma[k];
                let part = parts.entry(constant.source());
                let part = part.or_insert_with(|| DMatrix::zeros(n, n));
                *part += &column * column.transpose();
            }
        }
        parts
    }
}
