//! One run of the study.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::{AccuracyStudy, Baseline};
use crate::calibration::{
    AUXILIARY, AuxiliaryVector, Estimate, FormTest, Nees, Nis, Options, Outcome, PARAMETERS,
    ParameterMatrix, ParameterVector, Problem, TermEvidence, UNWATCHED, auxiliary_vector, bound,
    estimate, in_general_form, nees, to_vector,
};
use crate::imu::{BodyFrame, InstallationForm, PerSensor, Triad};
use crate::run::Aiding;
use crate::simulation::Runs;
use crate::study::StudyError;

/// A run of the study. Errors are estimate minus truth; all values are in the general form.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Trial {
    /// Number of the run, which selects its stream of random numbers.
    pub run: u64,
    /// Reason for failure of the filter; `None` if it did not fail.
    pub failure: Option<String>,
    /// Results of the filter; for a run that did not converge, the results of its last pass.
    pub filtered: Option<Filtered>,
    /// σ of the bound.
    pub bound: ParameterVector,
    /// Covariance of the bound.
    pub(super) bound_covariance: ParameterMatrix,
    /// σ of the bound of the auxiliary constants; zero for constants without a bound.
    pub auxiliary_bound: AuxiliaryVector,
    /// Evidence for each error term, in the first run only.
    pub effects: Vec<TermEvidence>,
    /// Error of the closed form in its own time and in the filter's; `None` if it failed.
    pub(super) closed_form: [Option<ParameterVector>; 2],
}

/// Results of the filter in one run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Filtered {
    /// Error of each parameter.
    pub error: ParameterVector,
    /// Stated σ of each parameter.
    pub sigma: ParameterVector,
    /// Stated covariance of the parameters.
    pub(super) covariance: ParameterMatrix,
    /// Error of each estimated auxiliary constant; zero for others.
    pub auxiliary_error: AuxiliaryVector,
    /// Stated σ of the auxiliary constants.
    pub auxiliary_sigma: AuxiliaryVector,
    /// NEES/n of the parameters and the auxiliary constants.
    pub nees: Option<Nees>,
    /// Number of passes.
    pub passes: usize,
    /// NIS of zero velocity.
    pub velocity: Nis,
    /// NIS of table attitude.
    pub table: Nis,
    /// Test of the misalignment form.
    pub form_test: Option<FormTest>,
}

impl AccuracyStudy {
    /// One run of the filter and one of the baseline.
    pub(super) fn trial(
        &self,
        baseline: &Baseline,
        [filter_runs, baseline_runs]: &[Runs; 2],
        run: u64,
    ) -> Result<Trial, StudyError> {
        let simulated = filter_runs.simulate(self.seed, run)?;
        let (record, truth) = (simulated.run, simulated.truth);
        let aiding = match self.scenario.body_frame {
            BodyFrame::Table => Aiding::Table,
            BodyFrame::Accelerometer => Aiding::Velocity,
        };
        let mut options = Options::default()
            .installation(self.form)
            .aiding(aiding)
            .noise(self.noise);
        // Terms that are deliberately left unmodelled must not be switched on automatically.
        options.auto_terms = self.auto_terms && self.unmodelled.is_empty();
        let mut problem = Problem::new(&record, &options);
        let form = self.bound_form(&truth);
        let attainable = PerSensor::from_fn(|sensor| truth.get(sensor).in_form(form));
        let bound = bound(&problem, &attainable, &simulated.terms)
            .map_err(|source| StudyError::Bound { run, source })?;
        for &term in &self.unmodelled {
            problem.model.switch_off(term);
        }
        let outcome = estimate(&problem, UNWATCHED);
        let effects = match &outcome {
            Ok(outcome) if run == 0 => outcome.terms.clone(),
            _ => Vec::new(),
        };
        let auxiliary = auxiliary_vector(&simulated.geometry, &simulated.terms);
        let attained = bound.estimate.in_general_form();
        Ok(Trial {
            run,
            failure: match &outcome {
                Err(error) => Some(error.to_string()),
                Ok(outcome) => (!outcome.converged).then(|| "not converged".to_owned()),
            },
            filtered: outcome
                .ok()
                .map(|outcome| Filtered::new(&outcome, &truth, &auxiliary)),
            effects,
            auxiliary_bound: bound.auxiliary.sigma(),
            bound: attained.sigma(),
            bound_covariance: attained.covariance,
            closed_form: baseline.errors(baseline_runs.simulate(self.seed, run)?, self.form),
        })
    }

    /// Form for the bound: that of the filter if it can represent the truth, otherwise the general form.
    fn bound_form(&self, truth: &PerSensor<Triad>) -> InstallationForm {
        if self.form.holds(truth.gyro.form) {
            self.form
        } else {
            InstallationForm::General
        }
    }
}

impl Filtered {
    fn new(outcome: &Outcome, truth: &PerSensor<Triad>, auxiliary: &AuxiliaryVector) -> Self {
        let truth = to_vector(&in_general_form(truth));
        let estimate = outcome.estimate.in_general_form();
        let error = estimate.vector() - truth;
        let auxiliary_sigma = outcome.auxiliary.sigma();
        let auxiliary_error =
            (outcome.auxiliary.values - auxiliary).zip_map(&auxiliary_sigma, |error, sigma| {
                if sigma > 0.0 { error } else { 0.0 }
            });
        Self {
            error,
            sigma: estimate.sigma(),
            covariance: estimate.covariance,
            nees: whole_nees(outcome, &estimate, &error, &auxiliary_error),
            auxiliary_error,
            auxiliary_sigma,
            passes: outcome.passes.len(),
            velocity: outcome.consistency.velocity,
            table: outcome.consistency.table,
            form_test: outcome.form_test,
        }
    }
}

/// Joint NEES of the parameters, in the general form, and the auxiliary constants.
fn whole_nees(
    outcome: &Outcome,
    estimate: &Estimate,
    error: &ParameterVector,
    auxiliary_error: &AuxiliaryVector,
) -> Option<Nees> {
    let auxiliary = &outcome.auxiliary;
    let cross = outcome.estimate.to_general_form(BodyFrame::Table) * &auxiliary.cross;
    let covariance = estimate.covariance_with(&cross, &auxiliary.covariance);
    let error = error.iter().chain(auxiliary_error).copied();
    let error = DVector::from_iterator(PARAMETERS + AUXILIARY, error);
    nees(&error, &covariance, &Vec::from_iter(0..error.len()))
}
