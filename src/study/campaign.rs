//! Accuracy of the calibration of a campaign and consistency of its σ over many simulated campaigns: parameters at
//! the reference temperature, their coefficients, and the selected orders.

use nalgebra::{DMatrix, DVector};

use super::accuracy::{Figures, Squares};
use super::{Study, StudyError};
use crate::calibration::{
    CalibrationError, Coefficient, Group, Nees, NoisePolicy, Options, Outcome, PARAMETERS, Problem,
    UNWATCHED, estimate, mean_square_interval, nees, thermal_bound, to_vector,
};
use crate::imu::{InstallationForm, ParameterKind, PerSensor, ThermalCoefficients, Triad};
use crate::run::Run;
use crate::simulation::{Simulated, SimulatedCampaign, ThermalTruth};

/// Configuration of the study.
#[derive(Debug, Clone)]
pub struct CampaignStudy {
    /// The simulated campaign.
    pub campaign: SimulatedCampaign,
    /// The filter's installation form, to which the truth is converted.
    pub form: InstallationForm,
    /// Noise policy of the filter.
    pub noise: NoisePolicy,
    /// Number of campaigns.
    pub runs: u64,
    /// Seed; each campaign has its own random streams.
    pub seed: u64,
    /// Whether biases may depend on the temperature rate.
    pub rate: bool,
}

/// Result of the study.
#[derive(Debug, Clone)]
pub struct CampaignAccuracy {
    /// The configuration.
    pub study: CampaignStudy,
    /// Every campaign that gave a calibration, in order.
    pub trials: Vec<CampaignTrial>,
    /// Number of campaigns without a calibration.
    pub failures: usize,
}

/// One campaign.
#[derive(Debug, Clone)]
pub struct CampaignTrial {
    /// NEES of all parameters and coefficients, with the full covariance.
    pub nees: Nees,
    /// Errors of the parameters at the reference, and of their coefficients.
    pub errors: Vec<ErrorOf>,
    /// Whether the true order of each of [`Group::all`] was selected, the rate term included.
    pub order_is_right: Vec<bool>,
}

/// An error of one campaign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorOf {
    /// The parameter's group.
    pub group: Group,
    /// Index among the functions of temperature; `None` for the parameter at the reference.
    pub function: Option<usize>,
    /// Squared error, stated σ² and squared bound, normalised.
    pub squares: [f64; 3],
}

impl Study for CampaignStudy {
    type Trial = Option<CampaignTrial>;
    type Outcome = CampaignAccuracy;

    fn runs(&self) -> u64 {
        self.runs
    }

    fn maker(&self) -> Result<impl Fn(u64) -> Result<Self::Trial, StudyError> + Sync, StudyError> {
        Ok(|stream| self.trial(stream))
    }

    fn outcome(&self, trials: Vec<Self::Trial>) -> Result<CampaignAccuracy, StudyError> {
        Ok(CampaignAccuracy {
            study: self.clone(),
            failures: trials.iter().filter(|trial| trial.is_none()).count(),
            trials: trials.into_iter().flatten().collect(),
        })
    }
}

impl CampaignStudy {
    fn trial(&self, stream: u64) -> Result<Option<CampaignTrial>, StudyError> {
        let simulated = self.campaign.simulate(self.seed, stream)?;
        let runs: Vec<&Run> = simulated.iter().map(|one| &one.run).collect();
        let options = Options::default().noise(self.noise).installation(self.form);
        let mut together = self.campaign.together();
        if let Some(temperature) = &mut together.temperature {
            temperature.rate = self.rate;
        }
        let at_bound = |source: CalibrationError| StudyError::Bound {
            run: stream,
            source,
        };
        let problem = Problem::together(&runs, &options, &together).map_err(at_bound)?;
        let Ok(outcome) = estimate(&problem, UNWATCHED) else {
            return Ok(None);
        };
        if !outcome.converged {
            return Ok(None);
        }
        let bound = self
            .bound(&problem, &outcome, &simulated)
            .map_err(at_bound)?;
        Ok(compare(&outcome, &simulated, &bound))
    }

    /// Bound for the covariance of the parameters and of the outcome's coefficients, linearised at the truth.
    fn bound(
        &self,
        problem: &Problem,
        outcome: &Outcome,
        simulated: &[Simulated],
    ) -> Result<DVector<f64>, CalibrationError> {
        let mut model = problem.model.clone();
        model.thermal = outcome.model.thermal.clone();
        let problem = problem.with_model(model);
        let truth = truth(outcome, simulated);
        let coefficients = truth_coefficients(outcome, simulated);
        thermal_bound(&problem, &truth, &coefficients)
    }
}

/// The true triads at the reference temperature of an outcome, averaged over all recordings.
fn truth(outcome: &Outcome, simulated: &[Simulated]) -> PerSensor<Triad> {
    let form = outcome.estimate.form();
    let base = simulated
        .first()
        .map(|one| (one.common, one.thermal.as_ref()));
    let (common, thermal) = base.unwrap_or((outcome.estimate.triads, None));
    PerSensor::from_fn(|sensor| {
        let at = match (thermal, &outcome.thermal) {
            (Some(truth), Some(of)) => truth.at(&common, of.model.range.get(sensor).reference, 0.0),
            (Some(truth), None) => truth.at(&common, mean_temperature(simulated), 0.0),
            _ => common,
        };
        at.get(sensor).in_form(form)
    })
}

fn mean_temperature(simulated: &[Simulated]) -> f64 {
    let all = simulated.iter().filter_map(|one| {
        let imu = &one.run.recording.imu;
        let middle = 0.5 * (imu.start() + imu.end());
        Some(imu.temperature.as_ref()?.at(middle).gyro[0])
    });
    let all: Vec<f64> = all.collect();
    all.iter().sum::<f64>() / all.len().max(1) as f64
}

fn truth_coefficients(
    outcome: &Outcome,
    simulated: &[Simulated],
) -> PerSensor<ThermalCoefficients> {
    let truth: Option<&ThermalTruth> = simulated.first().and_then(|one| one.thermal.as_ref());
    let all = truth.zip(outcome.thermal.as_ref());
    all.map(|(truth, of)| truth.coefficients(&of.model.range))
        .unwrap_or_default()
}

fn compare(
    outcome: &Outcome,
    simulated: &[Simulated],
    bound: &DVector<f64>,
) -> Option<CampaignTrial> {
    let (estimate, thermal) = (&outcome.estimate, outcome.thermal.as_ref());
    let none = (DMatrix::zeros(PARAMETERS, 0), DMatrix::zeros(0, 0));
    let (cross, own) = thermal.map_or((&none.0, &none.1), |t| (&t.cross, &t.covariance));
    let covariance = estimate.covariance_with(cross, own);
    let coefficients = thermal.map_or(&[][..], |t| &t.coefficients);
    let off = to_vector(&truth(outcome, simulated)) - estimate.vector();
    let true_coefficients = truth_coefficients(outcome, simulated);
    let of_coefficient = |(k, c): (usize, &Coefficient)| {
        let value = thermal.map_or(0.0, |t| t.values[k]);
        true_coefficients.get(c.sensor)[(c.parameter, c.function)] - value
    };
    let of_coefficients = coefficients.iter().enumerate().map(of_coefficient);
    let error = off.iter().copied().chain(of_coefficients);
    let error = DVector::from_vec(error.collect());
    let places: Vec<usize> = estimate
        .estimated()
        .chain(PARAMETERS..error.len())
        .collect();
    let nees = nees(&error, &covariance, &places)?;
    let errors = places.iter().map(|&k| {
        let coefficient = k.checked_sub(PARAMETERS).map(|c| coefficients[c]);
        ErrorOf {
            group: Group::of(coefficient.map_or(k, |c| c.index())),
            function: coefficient.map(|c| c.function),
            squares: [
                error[k].powi(2),
                covariance[(k, k)],
                bound.get(k).copied().unwrap_or(f64::NAN),
            ],
        }
    });
    Some(CampaignTrial {
        nees,
        errors: errors.collect(),
        order_is_right: Group::all()
            .map(|group| order(outcome, group) == true_order(simulated, group))
            .collect(),
    })
}

/// The selected order of a group, and whether its biases have a rate term.
fn order(outcome: &Outcome, group: Group) -> (usize, bool) {
    let parameters = group.parameters(outcome.estimate.form());
    let first = parameters.first().copied().unwrap_or(0);
    let thermal = outcome.thermal.as_ref();
    thermal.map_or((0, false), |thermal| thermal.order(first))
}

/// The same of the truth.
fn true_order(simulated: &[Simulated], group: Group) -> (usize, bool) {
    let truth = simulated.first().and_then(|one| one.thermal.as_ref());
    let first = match group.kind() {
        ParameterKind::Scale => 0,
        ParameterKind::Installation => 3,
        ParameterKind::Bias => Triad::ideal(InstallationForm::General).to_vector().len() - 3,
    };
    truth.map_or((0, false), |truth| {
        let there = |k: usize| truth.by.get(group.sensor())[k][first] != 0.0;
        let order = if there(1) { 2 } else { usize::from(there(0)) };
        (order, there(2))
    })
}

impl CampaignAccuracy {
    /// NEES/n over all campaigns with its 99 % interval; `None` without campaigns.
    pub fn anees(&self) -> Option<(f64, (f64, f64))> {
        let all = || self.trials.iter().map(|trial| trial.nees);
        let count = all().map(|nees| nees.count).sum();
        let sum: f64 = all().map(|nees| nees.mean * nees.count as f64).sum();
        (count > 0).then(|| (sum / count as f64, mean_square_interval(count, 0.01)))
    }

    /// Figures of the parameters of a group at the reference, or of their coefficients of one function, normalised, and
    /// the number of campaigns that have them.
    pub fn figures(&self, group: Group, function: Option<usize>) -> Option<(Figures, usize)> {
        let of = |trial: &CampaignTrial| {
            let of_group = |e: &&ErrorOf| e.group == group && e.function == function;
            let errors: Vec<&ErrorOf> = trial.errors.iter().filter(of_group).collect();
            let mean =
                |k: usize| errors.iter().map(|e| e.squares[k]).sum::<f64>() / errors.len() as f64;
            (!errors.is_empty()).then(|| Squares {
                filter: Some(mean(0)),
                claimed: Some(mean(1)),
                bound: mean(2),
                ..Squares::default()
            })
        };
        let all: Vec<Squares> = self.trials.iter().filter_map(of).collect();
        let count = all.len();
        (count > 0).then(|| (Figures::new(all.into_iter()), count))
    }

    /// Number of campaigns in which the true order of a group was selected, and number of all campaigns.
    pub fn right_orders(&self, group: Group) -> (usize, usize) {
        let place = Group::all().position(|g| g == group).unwrap_or(0);
        let right = |trial: &&CampaignTrial| trial.order_is_right[place];
        (self.trials.iter().filter(right).count(), self.trials.len())
    }

    /// `None`, for parameters at the reference, followed by the temperature functions of any campaign.
    pub fn functions(&self) -> Vec<Option<usize>> {
        let all = self.trials.iter().flat_map(|trial| &trial.errors);
        let mut functions: Vec<Option<usize>> = all.map(|error| error.function).collect();
        functions.sort();
        functions.dedup();
        functions
    }
}
