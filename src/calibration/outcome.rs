//! What a calibration says: an estimate with its covariance, and how it was reached.

use nalgebra::Vector3;

use super::coarse::AttitudePrior;
use super::form::FormTest;
use super::further::Further;
use super::linearisation::Linearisation;
use super::observability::Observability;
use super::states::{ParameterMatrix, ParameterVector, parameter, sensor_and_parameter};
use crate::imu::{InstallationForm, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad};

/// Both triads with the covariance of their parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// The estimated triads, normalised (see [`crate::imu::Nominal`]).
    pub triads: PerSensor<Triad>,
    /// Covariance of the parameters of both triads; rows and columns of parameters that were not
    /// estimated are zero.
    pub covariance: ParameterMatrix,
}

impl Estimate {
    /// The parameters of both triads.
    pub fn vector(&self) -> ParameterVector {
        to_vector(&self.triads)
    }

    /// 1σ of each parameter; zero for those that were not estimated.
    pub fn sigma(&self) -> ParameterVector {
        self.covariance.diagonal().map(|v| v.max(0.0).sqrt())
    }

    /// The installation form, one for both triads.
    pub fn form(&self) -> InstallationForm {
        self.triads.gyro.form
    }

    /// Indices of the estimated parameters.
    pub fn estimated(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.covariance.nrows()).filter(|&i| self.covariance[(i, i)] > 0.0)
    }
}

/// The parameters of both triads as one vector.
pub fn to_vector(triads: &PerSensor<Triad>) -> ParameterVector {
    let mut v = ParameterVector::zeros();
    for sensor in Sensor::ALL {
        v.fixed_rows_mut::<PER_TRIAD>(parameter(sensor, 0))
            .copy_from(&triads.get(sensor).to_vector());
    }
    v
}

/// Both triads from one vector of parameters.
pub fn from_vector(form: InstallationForm, v: &ParameterVector) -> PerSensor<Triad> {
    PerSensor::from_fn(|sensor| {
        Triad::from_vector(
            form,
            &v.fixed_rows::<PER_TRIAD>(parameter(sensor, 0)).into_owned(),
        )
    })
}

/// The name of a parameter in files; `None` if the form does not have it.
pub fn parameter_name(form: InstallationForm, index: usize) -> Option<String> {
    let (sensor, of_triad) = sensor_and_parameter(index);
    Triad::parameter_name(sensor, form, of_triad)
}

/// A run has observed a parameter if it leaves less than this part of its prior σ.
pub const OBSERVED_BELOW: f64 = 0.5;

/// χ² by which opposite headings differ where a run observes the heading.
const HEADING_SEEN: f64 = 6.0;

/// The result of the filter on one run.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The estimate after the last pass.
    pub estimate: Estimate,
    /// 1σ of every parameter before the run.
    pub prior_sigma: ParameterVector,
    /// Mean of every parameter before the run.
    pub prior_mean: ParameterVector,
    /// What was known of the initial attitude before the run.
    pub prior_attitude: AttitudePrior,
    /// 1σ of the initial attitude after it, rad about East, North and Up; the last is that of the
    /// heading.
    pub attitude_sigma: Vector3<f64>,
    /// Constants beside the parameters: the table's geometry and the instrument's further terms.
    pub further: Further,
    /// What the run showed of the parameters and what it left as it was.
    pub observability: Observability,
    /// Where the last pass linearised.
    pub linearised_at: Linearisation,
    /// Each pass in order; with a table, the first is the live one.
    pub passes: Vec<Pass>,
    /// Whether the last pass moved no parameter by more than the limit.
    pub converged: bool,
    /// Estimate and σ against time in the last pass, whose σ are the true ones.
    pub history: Vec<Moment>,
    /// Estimate and σ against time in the live pass, as the turntable moved; empty without a table.
    pub live_history: Vec<Moment>,
    /// Innovations of the last pass.
    pub innovations: Vec<Innovation>,
    /// Logarithm of the determinant of the covariance of all innovations let in.
    pub log_determinant: f64,
    /// Consistency of the innovations with their covariance in the last pass.
    pub consistency: Consistency,
    /// Whether the data reject the installation form; none where they cannot.
    pub form_test: Option<FormTest>,
    /// White 1σ of the velocity at standstill that the filter used, m/s.
    pub velocity_sigma: f64,
    /// What a calibration engineer must know before using the figures.
    pub warnings: Vec<String>,
}

impl Outcome {
    /// Whether the run observed the heading: two that are opposite differ by more than 6 in χ² by what
    /// the run alone says.
    pub fn heading_observed(&self) -> bool {
        let information = |sigma: &Vector3<f64>| sigma.z.powi(-2);
        let of_run = information(&self.attitude_sigma) - information(&self.prior_attitude.sigma);
        // Opposite directions of Earth rate differ by twice its level part.
        4.0 * of_run > HEADING_SEEN
    }

    /// Indices of the parameters that the run did not observe.
    pub fn unobserved(&self) -> Vec<usize> {
        let sigma = self.estimate.sigma();
        let hidden = |&i: &usize| sigma[i] > OBSERVED_BELOW * self.prior_sigma[i];
        self.estimate.estimated().filter(hidden).collect()
    }
}

/// One pass over the record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pass {
    /// Whether estimates were fed back as it went (only in the first).
    pub live: bool,
    /// The largest step of any parameter from the linearisation point, in σ.
    pub largest_step: f64,
    /// Whitened innovations squared plus prior, summed.
    pub merit: f64,
    /// Number of scalar observations that entered the merit.
    pub observations: usize,
    /// Number of observations (of three components) that the gate rejected.
    pub rejected: usize,
}

/// Estimate and σ at one moment of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Time, s.
    pub time: f64,
    /// Parameters of both triads.
    pub estimate: ParameterVector,
    /// 1σ of each.
    pub sigma: ParameterVector,
}

/// What was observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Observation {
    /// Zero velocity.
    Velocity,
    /// Attitude of the table.
    Table,
}

/// The innovation of one observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Time, s.
    pub time: f64,
    /// What was observed.
    pub observation: Observation,
    /// East, North and Up in units of their own σ, independent of each other.
    pub whitened: [f64; 3],
    /// Whether the gate let it in.
    pub accepted: bool,
}

impl Innovation {
    /// Squared Mahalanobis distance, χ² with three degrees of freedom.
    pub fn distance(&self) -> f64 {
        self.whitened.iter().map(|w| w * w).sum()
    }
}

/// Normalised innovation squared, apart for each kind of observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Consistency {
    /// All observations.
    pub all: Nis,
    /// Zero velocity.
    pub velocity: Nis,
    /// Attitude of the table.
    pub table: Nis,
}

/// Mean of normalised innovations squared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nis {
    /// Mean per scalar observation; one if σ are true. NaN without observations.
    pub mean: f64,
    /// Number of scalar observations.
    pub count: usize,
    /// 95 % interval of the mean for consistent σ (χ²).
    pub interval: (f64, f64),
    /// Correlation of neighbouring innovations, zero if they are white.
    pub lag_one: f64,
}
