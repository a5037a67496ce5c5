//! The methods, and the calibration of an instrument by each.

use serde::{Deserialize, Serialize};

use crate::calibration::{
    Estimate, NoisePolicy, Options, ParameterMatrix, ParameterVector, Problem, UNWATCHED, estimate,
    in_general_form, six_position, to_vector,
};
use crate::imu::InstallationForm;
use crate::models::ModelError;
use crate::simulation::{Scenario, Simulated};
use crate::study::StudyError;
use crate::turntable::TableError;

/// The static positions described in the paper, used by the closed form.
pub(super) const POSITIONS: &str = "six-position";
/// A filter path with the table time of the closed form.
const HOUR_PATH: &str = "three-axis-hour";

/// An estimator and its path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Estimator {
    /// The closed form on the static positions described in the paper.
    #[serde(rename = "six-position")]
    ClosedForm,
    /// The filter on the path of the scenario.
    #[serde(rename = "ekf")]
    Filter,
    /// The filter on a path with the table time of the closed form.
    #[serde(rename = "ekf-equal-time")]
    LongFilter,
}

/// An estimator with a misalignment form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Method {
    /// The estimator.
    pub estimator: Estimator,
    /// The misalignment form.
    pub form: InstallationForm,
}

impl Estimator {
    /// All estimators, in the order in which results list them.
    pub const ALL: [Self; 3] = [Self::ClosedForm, Self::Filter, Self::LongFilter];
}

impl Method {
    /// All methods, in the order in which results list them.
    pub fn all() -> impl Iterator<Item = Self> {
        Estimator::ALL
            .into_iter()
            .flat_map(|estimator| InstallationForm::ALL.map(|form| Self { estimator, form }))
    }
}

/// One instrument.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Trial {
    /// Number of the instrument, which selects its stream of random numbers.
    pub run: u64,
    /// Calibration by each of [`Method::all`], or the reason for failure.
    pub calibrations: Vec<Result<Calibrated, String>>,
}

impl Trial {
    /// Calibration by a method, given by its index.
    pub(super) fn of(&self, place: usize) -> Option<&Calibrated> {
        self.calibrations.get(place)?.as_ref().ok()
    }
}

/// A calibration in the general form.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Calibrated {
    /// Errors, true − estimated.
    pub error: ParameterVector,
    /// The stated covariance.
    pub covariance: ParameterMatrix,
    /// False if the method reports that it did not converge.
    pub converged: bool,
    /// Whether the method reports that the data reject its misalignment form.
    pub rejects_form: bool,
}

/// The simulated scenario of each estimator.
pub struct Scenarios(Vec<(Estimator, Scenario)>);

impl Scenarios {
    pub fn new(scenario: &Scenario) -> Result<Self, ModelError> {
        let on = |estimator| {
            let scenario = scenario.clone();
            let scenario = match estimator {
                Estimator::ClosedForm => scenario.with_path(POSITIONS)?,
                Estimator::Filter => scenario,
                Estimator::LongFilter => scenario.with_path(HOUR_PATH)?,
            };
            Ok((estimator, scenario))
        };
        let all = Estimator::ALL.into_iter().map(on);
        Ok(Self(all.collect::<Result<_, ModelError>>()?))
    }

    /// Table time of each of [`Method::all`], s.
    pub fn table_times(&self) -> Result<Vec<f64>, TableError> {
        let mut times = Vec::new();
        for (_, scenario) in &self.0 {
            times.extend([scenario.duration()?; InstallationForm::ALL.len()]);
        }
        Ok(times)
    }

    /// Simulates one instrument, which is the same for all methods.
    pub fn trial(&self, seed: u64, run: u64) -> Result<Trial, StudyError> {
        let mut calibrations = Vec::new();
        for (estimator, scenario) in &self.0 {
            let simulated = scenario.simulate(seed, run)?;
            let forms = InstallationForm::ALL.into_iter();
            calibrations.extend(forms.map(|form| calibrated(&simulated, *estimator, form)));
        }
        Ok(Trial { run, calibrations })
    }
}

fn calibrated(
    simulated: &Simulated,
    estimator: Estimator,
    form: InstallationForm,
) -> Result<Calibrated, String> {
    let Simulated { run, truth, .. } = simulated;
    let truth = in_general_form(truth);
    let against_truth = |estimate: &Estimate, converged, rejects_form| {
        let estimate = estimate.in_general_form();
        Calibrated {
            error: to_vector(&truth) - estimate.vector(),
            covariance: estimate.covariance,
            converged,
            rejects_form,
        }
    };
    // The noise stated in a scenario is correct.
    let options = Options::default().noise(NoisePolicy::Stated);
    let problem = Problem::new(run, &options.installation(form));
    match estimator {
        Estimator::ClosedForm => {
            let closed_form = six_position(&problem).map_err(|error| error.to_string())?;
            Ok(against_truth(&closed_form.estimate, true, false))
        }
        Estimator::Filter | Estimator::LongFilter => {
            let outcome = estimate(&problem, UNWATCHED).map_err(|error| error.to_string())?;
            let rejects = outcome.form_test.is_some_and(|test| test.rejects());
            Ok(against_truth(&outcome.estimate, outcome.converged, rejects))
        }
    }
}
