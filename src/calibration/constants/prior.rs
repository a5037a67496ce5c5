//! The prior of constants.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::calibration::budget::source::BudgetSource;
use crate::calibration::{Candidate, Constant, Linearisation, Model, Posterior, to_vector};

/// The prior of constants, expressed as errors of the linearisation point.
#[derive(Debug, Clone)]
pub struct Prior {
    /// The constants, those that may be absent last.
    pub constants: Vec<Constant>,
    pub mean: DVector<f64>,
    /// 1σ of each constant; zero for constants fixed at their mean. For constants that may be absent, their typical
    /// magnitude.
    pub sigma: DVector<f64>,
    /// Number of constants that may be absent.
    pub candidates: usize,
}

impl Prior {
    /// The prior of these constants in a model, as errors of this point.
    pub fn new(constants: &[Constant], model: &Model, at: &Linearisation) -> Self {
        let parameters = model.prior_mean - to_vector(&at.triads);
        let mean = |constant: &Constant| match *constant {
            Constant::Parameter(index) => parameters[index],
            Constant::Term(index) => -at.terms[index],
            Constant::Thermal(of) => -of.of(&at.thermal),
            Constant::Magnetic(index) => at
                .magnetic
                .map_or(0.0, |at| model.magnetic.mean[index] - at[index]),
            _ => 0.0,
        };
        let may_be_absent = |of: &&Constant| Candidate::of(**of, model).is_some();
        Self {
            constants: constants.to_vec(),
            mean: DVector::from_iterator(constants.len(), constants.iter().map(mean)),
            sigma: DVector::from_iterator(
                constants.len(),
                constants.iter().map(|&constant| constant.sigma(model)),
            ),
            candidates: constants.iter().filter(may_be_absent).count(),
        }
    }

    /// Exact contribution of the prior to a covariance, by source: `P P₀⁻¹ P`, without the constants that may be
    /// absent.
    pub fn parts(&self, of: &Posterior) -> BTreeMap<BudgetSource, DMatrix<f64>> {
        let n = self.constants.len();
        let mut parts = BTreeMap::new();
        let known = self.constants.iter().take(n - self.candidates);
        for (k, constant) in known.enumerate() {
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
