//! The uncertainty budget of an estimate: its covariance by what it comes from (JCGM 100:2008, JCGM 102:2011).
//!
//! The estimate is linear in everything that the last pass took for random: what was known before, noise of
//! the instrument, errors of the table, noise of each observation. Followed back through the filter, an error
//! of one σ of each does so much to every parameter; the squares of all that is of one source are its part of
//! the covariance, and the parts of all sources are the covariance, whatever the gains of the filter are.

pub mod curvature;

mod follow;
mod freedom;
mod record;
mod source;
mod sums;

use super::error::CalibrationError;
use super::outcome::Outcome;
use super::parameters::{PARAMETERS, ParameterMatrix};
use super::problem::Problem;
use crate::calibration::budget::curvature::curvature;
use crate::statistics::student_limit;
use follow::Held;
pub use record::{BudgetPartRecord, BudgetRecord, LeftOffRecord};
pub use source::BudgetSource;

/// Two-sided probability that a coverage factor is for: k = 2 with a normal distribution.
const COVERAGE: f64 = 0.954_499_736_103_642;
/// A part of less than this share of every variance is nothing.
const NOTHING: f64 = 1e-12;

/// Covariance of an estimate by source.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// What each source adds; the sum is the covariance of the estimate.
    pub parts: Vec<BudgetPart>,
}

/// What one source adds to the covariance of an estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct BudgetPart {
    /// Which.
    pub source: BudgetSource,
    /// Its part of the covariance of the parameters of both triads, in their units.
    pub covariance: ParameterMatrix,
    /// Degrees of freedom with which its variance is known (JCGM 100, G.4.2); infinite where it is stated.
    pub degrees_of_freedom: f64,
}

/// Events that are had at once, with what the filter did in them: of a longer record they are done again on the
/// way back, part by part, for those of a day would take more memory than its samples.
const AT_ONCE: usize = 256;

impl Budget {
    /// The budget of an outcome's estimate.
    ///
    /// # Errors
    /// [`CalibrationError`] where the problem is not the one of the outcome.
    pub fn new(problem: &Problem, outcome: &Outcome) -> Result<Self, CalibrationError> {
        let problem = &problem.with_model(outcome.model.clone());
        let accepted: Vec<bool> = outcome.innovations.iter().map(|i| i.accepted).collect();
        let held = Held {
            problem,
            priors: &outcome.prior_attitudes,
            at: &outcome.linearised_at,
            accepted: &accepted,
        };
        let by_source: Vec<_> = held.forward(AT_ONCE)?.back()?.covariances().collect();
        let filter: ParameterMatrix = by_source.iter().map(|(_, covariance)| covariance).sum();
        let bent = curvature(&outcome.estimate.triads, &filter);
        let beside = outcome.beside.iter().map(|(&source, &part)| (source, part));
        let filter = by_source
            .into_iter()
            .chain([(BudgetSource::Curvature, bent)]);
        let parts = filter.chain(beside);
        let variance = outcome.estimate.covariance.diagonal();
        let counts = |part: &ParameterMatrix| {
            let own = part.diagonal();
            (0..PARAMETERS).any(|i| own[i] > NOTHING * variance[i])
        };
        Ok(Self {
            parts: parts
                .filter(|(_, covariance)| counts(covariance))
                .map(|(source, covariance)| BudgetPart {
                    source,
                    covariance,
                    degrees_of_freedom: source.degrees_of_freedom(outcome),
                })
                .collect(),
        })
    }

    /// With one part more, of what is exactly known.
    pub(in crate::calibration) fn and(
        mut self,
        source: BudgetSource,
        covariance: ParameterMatrix,
    ) -> Self {
        self.parts.push(BudgetPart {
            source,
            covariance,
            degrees_of_freedom: f64::INFINITY,
        });
        self
    }

    /// The sum of all parts.
    pub fn covariance(&self) -> ParameterMatrix {
        self.parts.iter().map(|part| part.covariance).sum()
    }

    /// Degrees of freedom of the combined standard uncertainty of a parameter (Welch and Satterthwaite,
    /// JCGM 100, G.4.1); infinite where all are.
    pub fn degrees_of_freedom(&self, parameter: usize) -> f64 {
        let of = |part: &BudgetPart| part.covariance[(parameter, parameter)];
        let combined: f64 = self.parts.iter().map(of).sum();
        let each = self.parts.iter();
        let sum: f64 = each
            .map(|part| of(part).powi(2) / part.degrees_of_freedom)
            .sum();
        combined.powi(2) / sum
    }

    /// Coverage factor of a parameter for 95.45 %: 2 where the degrees of freedom are infinite, else
    /// from Student's t (JCGM 100, G.3).
    pub fn coverage_factor(&self, parameter: usize) -> f64 {
        coverage_factor(self.degrees_of_freedom(parameter))
    }
}

/// Coverage factor for 95.45 % and so many degrees of freedom.
fn coverage_factor(degrees_of_freedom: f64) -> f64 {
    match degrees_of_freedom.is_finite() {
        true => student_limit(degrees_of_freedom, 0.5 * (1.0 - COVERAGE)),
        false => 2.0,
    }
}

#[cfg(test)]
mod tests;
