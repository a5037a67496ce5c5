//! An uncertainty budget in the form stored in a calibration file.

use serde::{Deserialize, Serialize};

use crate::calibration::Budget;

/// Standard uncertainties of the estimated parameters by source, in the order and units of the parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BudgetRecord {
    /// Contribution of each source; the sum of the squares of the contributions is the variance.
    pub sources: Vec<BudgetPartRecord>,
    /// Effective degrees of freedom; `None` if infinite.
    pub degrees_of_freedom: Vec<Option<f64>>,
    /// Coverage factor for 95.45 %.
    pub coverage_factor: Vec<f64>,
}

/// Contribution of one source.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BudgetPartRecord {
    /// Name, such as `table position`.
    pub source: String,
    /// Standard uncertainty of each parameter.
    pub u: Vec<f64>,
    /// Degrees of freedom; `None` if infinite.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
}

impl Budget {
    /// Converts to a record of these parameters with these variances, each with its factor to the unit of the file.
    pub(in crate::calibration) fn record(
        &self,
        estimated: &[usize],
        variance: impl Fn(usize) -> f64,
        factor: impl Fn(usize) -> f64,
    ) -> BudgetRecord {
        // Negative differences are left out; without convergence, the parts are from a different linearisation.
        let share = |i: usize| {
            let sum: f64 = self.parts.iter().map(|part| part.variance(i)).sum();
            if sum > 0.0 { variance(i) / sum } else { 0.0 }
        };
        let finite = |freedom: f64| Some(freedom).filter(|freedom| freedom.is_finite());
        BudgetRecord {
            sources: self
                .parts
                .iter()
                .map(|part| BudgetPartRecord {
                    source: part.source.name(),
                    u: estimated
                        .iter()
                        .map(|&i| (part.variance(i) * share(i)).sqrt() * factor(i).abs())
                        .collect(),
                    degrees_of_freedom: finite(part.degrees_of_freedom),
                })
                .collect(),
            degrees_of_freedom: estimated
                .iter()
                .map(|&i| finite(self.degrees_of_freedom(i)))
                .collect(),
            coverage_factor: estimated.iter().map(|&i| self.coverage_factor(i)).collect(),
        }
    }
}
