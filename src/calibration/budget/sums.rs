//! Covariances that are summed source by source.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::source::BudgetSource;
use crate::calibration::parameters::{PARAMETERS, ParameterMatrix};
use crate::calibration::pass::Effect;

/// Effects that are multiplied out at once.
const AT_ONCE: usize = 256;

/// What independent errors of unit variance do, by source.
#[derive(Default)]
pub struct Sums(BTreeMap<BudgetSource, Sum>);

struct Sum {
    /// Effects not yet in the covariance, a column each.
    effects: DMatrix<f64>,
    filled: usize,
    covariance: DMatrix<f64>,
}

impl Sums {
    pub fn add(&mut self, source: BudgetSource, effect: &Effect) {
        let sum = self.0.entry(source).or_insert_with(|| Sum {
            effects: DMatrix::zeros(PARAMETERS, AT_ONCE),
            filled: 0,
            covariance: DMatrix::zeros(PARAMETERS, PARAMETERS),
        });
        sum.effects.column_mut(sum.filled).copy_from_slice(effect);
        sum.filled += 1;
        if sum.filled == AT_ONCE {
            sum.multiply();
        }
    }

    /// Covariance of each source.
    pub fn covariances(self) -> impl Iterator<Item = (BudgetSource, ParameterMatrix)> {
        self.0.into_iter().map(|(source, mut sum)| {
            sum.multiply();
            let covariance = &sum.covariance;
            let covariance = ParameterMatrix::from_fn(|i, j| covariance[(i, j)]);
            (source, covariance)
        })
    }
}

impl Sum {
    fn multiply(&mut self) {
        let effects = self.effects.columns(0, self.filled);
        self.covariance
            .gemm(1.0, &effects, &effects.transpose(), 1.0);
        self.filled = 0;
    }
}
