//! One run of the study.

use super::{AccuracyStudy, Baseline, StudyError};
use crate::calibration::outcome::{Moment, Nis, from_vector, to_vector};
use crate::calibration::states::{PARAMETERS, ParameterMatrix, ParameterVector};
use crate::calibration::{
    Estimate, FormTest, Nees, Outcome, bound, estimate, in_general_form, nees,
};
use crate::imu::{InstallationForm, PerSensor, Triad};
use crate::run::record::BodyFrame;
use crate::simulation::Simulated;

/// One run. Errors are estimate less truth; everything is in the general form.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Its number, the stream of its random numbers.
    pub run: u64,
    /// Why the filter failed; none if it did not.
    pub failure: Option<String>,
    /// What the filter gave; a run that did not converge gives its last pass.
    pub filtered: Option<Filtered>,
    /// σ of the bound.
    pub bound: ParameterVector,
    /// Covariance of the bound.
    pub(super) bound_covariance: ParameterMatrix,
    /// σ of the bound at each of the [`moments`].
    pub(super) bound_track: Vec<ParameterVector>,
    /// Error of the closed form for each part of its dwells; none where it failed.
    pub(super) closed_form: Vec<Option<ParameterVector>>,
}

/// What the filter gave in one run.
#[derive(Debug, Clone)]
pub struct Filtered {
    /// Error of each parameter.
    pub error: ParameterVector,
    /// σ that it claims.
    pub sigma: ParameterVector,
    /// Covariance that it claims.
    pub(super) covariance: ParameterMatrix,
    /// NEES/n.
    pub nees: Option<Nees>,
    /// Number of passes.
    pub passes: usize,
    /// NIS of zero velocity.
    pub velocity: Nis,
    /// NIS of table attitude.
    pub table: Nis,
    /// Observations that the gate left out.
    pub rejected: usize,
    /// Whether the data reject the form.
    pub form_test: Option<FormTest>,
    /// Error at each of the [`moments`] of the last pass.
    pub(super) track: Vec<ParameterVector>,
}

/// Number of moments in the curve against time.
const MOMENTS: usize = 40;

/// Times at which errors are kept, s; the last is the end of a run of this duration.
pub(super) fn moments(duration: f64) -> impl Iterator<Item = f64> {
    (1..=MOMENTS).map(move |k| duration * k as f64 / MOMENTS as f64)
}

impl AccuracyStudy {
    pub(super) fn trial(&self, baseline: &Baseline, run: u64) -> Result<Trial, StudyError> {
        let Simulated {
            run: mut record,
            truth,
            ..
        } = self.scenario.simulate(self.seed, run)?;
        if self.scenario.body_frame == BodyFrame::Accelerometer {
            record.table = None;
        }
        let duration = record.imu.duration();
        let form = self.bound_form(&truth);
        let attainable = PerSensor::from_fn(|sensor| truth.get(sensor).in_form(form));
        let bound =
            bound(&record, &attainable).map_err(|source| StudyError::Bound { run, source })?;
        let outcome = estimate(&record, self.form, &|_| {});
        let attained = bound.estimate.in_general_form();
        Ok(Trial {
            run,
            failure: match &outcome {
                Err(error) => Some(error.to_string()),
                Ok(outcome) => (!outcome.converged).then(|| "not converged".to_owned()),
            },
            filtered: outcome
                .ok()
                .map(|outcome| Filtered::new(&outcome, &truth, duration)),
            bound: attained.sigma(),
            bound_covariance: attained.covariance,
            bound_track: track(&bound.history, form, duration)
                .map(|estimate| estimate.sigma())
                .collect(),
            closed_form: baseline.errors(self.seed, run, self.form)?,
        })
    }

    /// The filter's form if it can hold the truth, else the general one, which is what could be had.
    fn bound_form(&self, truth: &PerSensor<Triad>) -> InstallationForm {
        if self.form.holds(truth.gyro.form) {
            self.form
        } else {
            InstallationForm::General
        }
    }
}

impl Filtered {
    fn new(outcome: &Outcome, truth: &PerSensor<Triad>, duration: f64) -> Self {
        let truth = to_vector(&in_general_form(truth));
        let form = outcome.estimate.form();
        let estimate = outcome.estimate.in_general_form();
        let error = estimate.vector() - truth;
        let all: Vec<usize> = (0..PARAMETERS).collect();
        Self {
            error,
            sigma: estimate.sigma(),
            covariance: estimate.covariance,
            nees: nees(&error, &estimate.covariance, &all),
            passes: outcome.passes.len(),
            velocity: outcome.consistency.velocity,
            table: outcome.consistency.table,
            rejected: outcome.innovations.iter().filter(|i| !i.accepted).count(),
            form_test: outcome.form_test,
            track: track(&outcome.history, form, duration)
                .map(|estimate| estimate.vector() - truth)
                .collect(),
        }
    }
}

/// What a history says at each of the moments, in the general form. It holds no correlations, which
/// to first order the change of form does not need.
fn track(
    history: &[Moment],
    form: InstallationForm,
    duration: f64,
) -> impl Iterator<Item = Estimate> {
    moments(duration).filter_map(move |time| {
        let after = history.partition_point(|moment| moment.time <= time);
        let moment = history.get(after.saturating_sub(1))?;
        let estimate = Estimate {
            triads: from_vector(form, &moment.estimate),
            covariance: ParameterMatrix::from_diagonal(&moment.sigma.map(|s| s * s)),
        };
        Some(estimate.in_general_form())
    })
}
