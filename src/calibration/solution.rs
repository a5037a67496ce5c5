//! The solution of a problem by either method, and its assessment.

use crate::calibration::result::Provenance;
use crate::calibration::start::closed_form::six_position_by;
use crate::calibration::{
    Budget, Calibration, CalibrationError, ClosedForm, Contradiction, Estimate, Finding, Method,
    Outcome, Problem, Progress, Quality, Reference, estimate, six_position,
};
use crate::imu::Sensor;

/// Result of one method for a problem.
#[derive(Debug, Clone)]
pub enum Solution {
    /// The filter.
    Filter(Box<Outcome>),
    /// The closed form.
    ClosedForm(Box<ClosedForm>),
}

/// Assessment of a solution and its model against the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// Residuals of gravity and turns.
    pub quality: Quality,
    /// Uncertainty budget; `None` for the closed form.
    pub budget: Option<Budget>,
}

impl Problem<'_> {
    /// Solves the problem with a method; fails if the recording contradicts run.toml.
    ///
    /// # Errors
    /// Returns [`CalibrationError`] if the runs cannot give a calibration by this method.
    pub fn solve(&self, method: Method, progress: Progress) -> Result<Solution, CalibrationError> {
        let is_missing = |&sensor: &Sensor| {
            self.lacks(sensor) && (sensor == Sensor::Accel || !self.shows_gravity_alone())
        };
        if let Some(sensor) = Sensor::ALL.into_iter().find(is_missing) {
            return Err(CalibrationError::OneTriad { sensor });
        }
        if let Some((run, contradiction)) = Contradiction::of(self) {
            return Err(CalibrationError::Contradicted {
                recording: (self.runs().count() > 1).then(|| run.recording.name.clone()),
                contradiction: Box::new(contradiction),
            });
        }
        Ok(match method {
            Method::Ekf if self.shows_gravity_alone() => {
                let closed_form = six_position_by(Reference::GravityAlone, self)?;
                Solution::ClosedForm(Box::new(closed_form))
            }
            Method::Ekf => Solution::Filter(Box::new(estimate(self, progress)?)),
            Method::SixPosition => Solution::ClosedForm(Box::new(six_position(self)?)),
        })
    }

    /// Origin of a calibration of the problem, without the list of files.
    pub fn provenance(&self) -> Provenance {
        Provenance {
            duration_s: self.runs().map(|run| run.recording.imu.duration()).sum(),
            dwells: self.dwells().count(),
            ..Provenance::of_run(self.run())
        }
    }
}

impl Solution {
    /// The filter's outcome.
    pub fn outcome(&self) -> Option<&Outcome> {
        match self {
            Self::Filter(outcome) => Some(outcome),
            Self::ClosedForm(_) => None,
        }
    }

    /// The closed form.
    pub fn closed_form(&self) -> Option<&ClosedForm> {
        match self {
            Self::Filter(_) => None,
            Self::ClosedForm(closed_form) => Some(closed_form),
        }
    }

    /// Both triads with their covariance.
    pub fn estimate(&self) -> &Estimate {
        match self {
            Self::Filter(outcome) => &outcome.estimate,
            Self::ClosedForm(closed_form) => &closed_form.estimate,
        }
    }

    /// Whether the filter converged; true for a closed form.
    pub fn converged(&self) -> bool {
        self.outcome().is_none_or(|outcome| outcome.converged)
    }

    /// Whether the solution may be used, that is, whether the filter converged and noise explains the residuals.
    pub fn is_usable(&self) -> bool {
        match self {
            Self::Filter(outcome) => outcome.is_usable(),
            Self::ClosedForm(closed_form) => closed_form.is_usable(),
        }
    }

    /// Evaluates the residuals of gravity and turns, and the uncertainty budget.
    ///
    /// # Errors
    /// Returns [`CalibrationError`] if the solution belongs to a different problem.
    pub fn assess(&self, problem: &Problem) -> Result<Assessment, CalibrationError> {
        match self {
            Self::Filter(outcome) => {
                let (quality, budget) = rayon::join(
                    || outcome.quality(problem),
                    || Budget::new(problem, outcome),
                );
                Ok(Assessment {
                    quality: quality?,
                    // The calibration is usable even without its budget.
                    budget: budget.ok(),
                })
            }
            Self::ClosedForm(closed_form) => Ok(Assessment {
                quality: closed_form.quality(problem)?,
                budget: None,
            }),
        }
    }

    /// Findings to read before using the results.
    pub fn findings(&self) -> &[Finding] {
        match self {
            Self::Filter(outcome) => &outcome.findings,
            Self::ClosedForm(closed_form) => &closed_form.findings,
        }
    }

    /// The calibration, in the file's quantity.
    pub fn calibration(&self, problem: &Problem, assessment: &Assessment) -> Calibration {
        match self {
            Self::Filter(outcome) => {
                let mut record = outcome.record(problem, &assessment.quality);
                if let Some(budget) = &assessment.budget {
                    record.take_budget(problem.run(), outcome, budget);
                }
                record
            }
            Self::ClosedForm(closed_form) => closed_form.record(problem, &assessment.quality),
        }
    }
}
