//! Solution of a problem by either method, with its assessment.

use crate::calibration::checks::error_term_test::bias_variation;
use crate::calibration::result::Provenance;
use crate::calibration::{
    Budget, BudgetSource, Calibration, CalibrationError, ClosedForm, Contradiction, ErrorTermTest,
    Estimate, Finding, Method, Outcome, Problem, Progress, Quality, estimate, six_position,
    test_error_terms,
};
use crate::imu::{PerSensor, Sensor};
use crate::units::DEGREE;

/// Result of a method for a problem.
#[derive(Debug, Clone)]
pub enum Solution {
    /// The filter.
    Filter(Box<Outcome>),
    /// The closed form.
    ClosedForm(Box<ClosedForm>),
}

/// Assessment of a solution and of its model by the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// Tests of all error terms; empty for the closed form.
    pub error_terms: Vec<ErrorTermTest>,
    /// Residuals of gravity and turns.
    pub quality: Quality,
    /// Uncertainty budget; `None` for the closed form.
    pub budget: Option<Budget>,
}

impl Problem<'_> {
    /// Solves the problem with a method; fails if the recording contradicts run.toml.
    ///
    /// # Errors
    /// [`CalibrationError`] if the runs cannot give a calibration by this method.
    pub fn solve(&self, method: Method, progress: Progress) -> Result<Solution, CalibrationError> {
        let lacks = |&sensor: &Sensor| self.runs().any(|run| !run.recording.imu.has(sensor));
        if let Some(sensor) = Sensor::ALL.into_iter().find(lacks) {
            return Err(CalibrationError::OneTriad { sensor });
        }
        if let Some((run, contradiction)) = Contradiction::of(self) {
            return Err(CalibrationError::Contradicted {
                recording: (self.runs().count() > 1).then(|| run.recording.name.clone()),
                contradiction: Box::new(contradiction),
            });
        }
        Ok(match method {
            Method::Ekf => Solution::Filter(Box::new(estimate(self, progress)?)),
            Method::SixPosition => Solution::ClosedForm(Box::new(six_position(self)?)),
        })
    }

    /// Origin of a calibration of the problem, without the files.
    pub fn provenance(&self) -> Provenance {
        let run = self.run();
        let imu = &run.recording.imu;
        Provenance {
            program: concat!("turncal ", env!("CARGO_PKG_VERSION")).to_owned(),
            inputs: Vec::new(),
            nominal: PerSensor::from_fn(|sensor| run.instrument.nominal.get(sensor).0.into()),
            latitude_deg: (run.site.is_known).then_some(run.site.latitude / DEGREE),
            height_m: run.site.height,
            duration_s: self.runs().map(|run| run.recording.imu.duration()).sum(),
            rate_hz: 1.0 / imu.period,
            dwells: self.dwells().count(),
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

    /// Whether it may be used: the filter converged, and noise explains the residuals.
    pub fn is_usable(&self) -> bool {
        match self {
            Self::Filter(outcome) => outcome.is_usable(),
            Self::ClosedForm(closed_form) => closed_form.is_usable(),
        }
    }

    /// Tests error terms and evaluates the residuals of gravity and turns. The effect of significant error terms that
    /// are not estimated is added to the covariance of the estimate; if the noise was estimated, so is the effect of
    /// undetectable bias variations.
    ///
    /// # Errors
    /// [`CalibrationError`] if the problem is not the one of the solution.
    pub fn assess(&mut self, problem: &Problem) -> Result<Assessment, CalibrationError> {
        let outcome = match self {
            Self::Filter(outcome) => outcome,
            Self::ClosedForm(closed_form) => {
                return Ok(Assessment {
                    error_terms: Vec::new(),
                    quality: closed_form.quality(problem)?,
                    budget: None,
                });
            }
        };
        let (error_terms, (quality, budget)) = rayon::join(
            || test_error_terms(problem, outcome),
            || (outcome.quality(problem), Budget::new(problem, outcome)),
        );
        let (error_terms, left_off) = match error_terms {
            // Where the iterations ended without convergence there may be nothing to test.
            Err(_) if !outcome.converged => (Vec::new(), None),
            tests => tests?,
        };
        // A calibration is one without its budget, too.
        let mut budget = budget.ok();
        let variation = bias_variation(problem, outcome, &error_terms)?;
        for (source, part) in [
            (BudgetSource::ErrorTermsLeftOff, left_off),
            (BudgetSource::UnseenVariation, variation),
        ] {
            let Some(part) = part else { continue };
            outcome.set_part(source, part);
            budget = budget.map(|budget| budget.and(source, part));
        }
        Ok(Assessment {
            error_terms,
            quality: quality?,
            budget,
        })
    }

    /// Findings to read before using the results.
    pub fn findings(&self, assessment: &Assessment) -> Vec<Finding> {
        match self {
            Self::Filter(outcome) => outcome.findings_with(&assessment.error_terms),
            Self::ClosedForm(closed_form) => closed_form.findings.clone(),
        }
    }

    /// The calibration, in the quantity of the file.
    pub fn calibration(&self, problem: &Problem, assessment: &Assessment) -> Calibration {
        match self {
            Self::Filter(outcome) => {
                let tests = &assessment.error_terms;
                let mut record = outcome.record(problem, tests, &assessment.quality);
                if let Some(budget) = &assessment.budget {
                    record.take_budget(problem.run(), outcome, budget, tests);
                }
                record
            }
            Self::ClosedForm(closed_form) => closed_form.record(problem, &assessment.quality),
        }
    }
}
