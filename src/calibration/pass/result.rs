//! What a pass gives.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::earlier::Earlier;
use crate::attitude::from_tilt_and_heading;
use crate::calibration::budget::curvature::curvature;
use crate::calibration::checks::innovation::Innovation;
use crate::calibration::checks::observability::AttitudeCovariance;
use crate::calibration::estimate::Estimate;
use crate::calibration::filter::{DwellFilters, Filter};
use crate::calibration::layout::{Constant, Layout};
use crate::calibration::linearisation::Linearisation;
use crate::calibration::model::Model;
use crate::calibration::parameters::auxiliary::{Auxiliary, auxiliary_vector};
use crate::calibration::parameters::{
    PARAMETERS, ParameterMatrix, ParameterVector, from_vector, to_vector,
};
use crate::calibration::several::day_to_day::Difference;
use crate::calibration::several::thermal::{Coefficient, Thermal};
use crate::imu::{PerSensor, TermVector, ThermalCoefficients};
use crate::turntable::TABLE_GEOMETRY;

/// Estimate and σ at one time of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Epoch {
    /// Time, s.
    pub time: f64,
    /// Parameters of both triads.
    pub estimate: ParameterVector,
    /// 1σ of each.
    pub sigma: ParameterVector,
}

/// What a pass gives.
#[derive(Debug, Clone)]
pub struct PassResult {
    /// Where it linearised; in a pass with feedback, at its end.
    pub at: Linearisation,
    /// The estimate: where the next pass linearises.
    pub estimate: Linearisation,
    pub covariance: ParameterMatrix,
    /// Parameters of error terms and table.
    pub auxiliary: Auxiliary,
    /// How parameters change with temperature, where they do.
    pub thermal: Option<Thermal>,
    /// By how much each recording differs from what all have in common; none where nothing does.
    pub own: Vec<Own>,
    /// Mean and 1σ of the error of gravity, true − stated, m/s².
    pub gravity: (f64, f64),
    /// Of the initial attitude of the last stretch.
    pub attitude_covariance: AttitudeCovariance,
    /// 1σ of the initial attitude of the last stretch, East, North and Up.
    pub attitude_sigma: Vector3<f64>,
    /// Cost: whitened innovations squared, summed; the prior is in it, since the filter starts from it.
    /// A rejected observation counts as much as the gate lets pass.
    pub cost: f64,
    /// Logarithm of the determinant of the covariance of all innovations let in: with the cost, −2 ln
    /// of the likelihood.
    pub log_determinant: f64,
    pub innovations: Vec<Innovation>,
    pub history: Vec<Epoch>,
}

impl PassResult {
    /// −2 ln of the likelihood, but for a constant.
    pub fn deviance(&self) -> f64 {
        self.cost + self.log_determinant
    }

    /// What it makes of both triads.
    pub fn both_triads(&self) -> Estimate {
        let triads = self.estimate.triads;
        Estimate {
            covariance: self.covariance + curvature(&triads, &self.covariance),
            triads,
        }
    }
}

/// By how much a recording differs from what all recordings have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Own {
    /// The estimate.
    pub values: Difference,
    /// 1σ; zero of what is common to all.
    pub sigma: Difference,
}

/// What a pass has come to so far.
pub struct Sums {
    pub at: Linearisation,
    pub filter: Filter,
    pub dwells: DwellFilters,
    pub innovations: Vec<Innovation>,
    pub history: Vec<Epoch>,
    /// Number of dwells that have ended.
    pub dwells_done: usize,
    pub cost: f64,
    pub log_determinant: f64,
    /// What is of each recording that has ended.
    pub own: Vec<Earlier>,
    /// Initial attitude of each stretch that has ended.
    pub attitudes: Vec<Earlier>,
}

impl Sums {
    pub fn epoch(&self, time: f64) -> Epoch {
        Epoch {
            time,
            estimate: to_vector(&self.at.triads) + self.filter.parameters(),
            sigma: self.filter.parameter_sigma(),
        }
    }

    /// By how much each recording differs, smoothed by those after it.
    fn own(&self) -> Vec<Own> {
        let of_recording = |(recording, own): (usize, &Earlier)| {
            let (mean, covariance) = own.smoothed(&self.filter);
            let mut own = Own {
                values: self.at.own(recording),
                sigma: Difference::default(),
            };
            for (k, (_, of)) in self.filter.layout.own().enumerate() {
                *own.values.get_mut(of) += mean[k];
                *own.sigma.get_mut(of) = covariance[(k, k)].max(0.0).sqrt();
            }
            own
        };
        self.own.iter().enumerate().map(of_recording).collect()
    }

    /// Where the next pass linearises.
    fn estimate(&self, own: &[Own]) -> Linearisation {
        let (at, filter) = (&self.at, &self.filter);
        let initial_attitude = |(at, error): (&Matrix3<f64>, &Earlier)| {
            let (mean, _) = error.smoothed(filter);
            from_tilt_and_heading(&Vector3::from_column_slice(mean.as_slice())) * at
        };
        let attitudes = at.initial_attitudes.iter().zip(&self.attitudes);
        let parameters = to_vector(&at.triads) + filter.parameters();
        Linearisation {
            triads: from_vector(at.triads.gyro.form, &parameters),
            terms: at.terms + filter.terms(),
            thermal: PerSensor::from_fn(|sensor| {
                at.thermal.get(sensor) + filter.thermal().get(sensor)
            }),
            own: own.iter().map(|own| own.values).collect(),
            initial_attitudes: attitudes.map(initial_attitude).collect(),
        }
    }

    pub fn result(self, model: &Model) -> PassResult {
        let own = self.own();
        let estimate = self.estimate(&own);
        let filter = &self.filter;
        let initial = filter.layout.initial_attitude();
        let attitude_sigma = filter.initial_attitude_sigma();
        let mut attitude_covariance = AttitudeCovariance::zeros();
        for (state, index) in filter.layout.parameters() {
            for axis in 0..3 {
                attitude_covariance[(index, axis)] =
                    filter.covariance(state, initial + axis) / attitude_sigma[axis];
            }
        }
        PassResult {
            estimate,
            covariance: filter.parameter_covariance(),
            auxiliary: auxiliary(filter, &self.at.terms, model),
            thermal: thermal(filter, &self.at.thermal, model),
            own,
            gravity: filter.gravity(),
            attitude_covariance,
            attitude_sigma,
            cost: self.cost,
            log_determinant: self.log_determinant,
            innovations: self.innovations,
            history: self.history,
            at: self.at,
        }
    }
}

impl PassResult {
    /// Takes another covariance of these constants.
    pub fn widen(&mut self, constants: &[Constant], covariance: &DMatrix<f64>) {
        let places = || constants.iter().copied().enumerate();
        for ((i, one), (j, other)) in places().flat_map(|of| places().map(move |by| (of, by))) {
            let value = covariance[(i, j)];
            let thermal = |of| {
                let thermal = self.thermal.as_ref()?;
                thermal.coefficients.iter().position(|&one| one == of)
            };
            match (one, other) {
                (Constant::Parameter(i), Constant::Parameter(j)) => self.covariance[(i, j)] = value,
                (Constant::Gravity, Constant::Gravity) => self.gravity.1 = value.sqrt(),
                (Constant::Parameter(i), Constant::Thermal(of)) => {
                    let place = thermal(of);
                    if let Some((thermal, k)) = self.thermal.as_mut().zip(place) {
                        thermal.cross[(i, k)] = value;
                    }
                }
                (Constant::Thermal(of), Constant::Thermal(by)) => {
                    let places = thermal(of).zip(thermal(by));
                    if let Some((thermal, place)) = self.thermal.as_mut().zip(places) {
                        thermal.covariance[place] = value;
                    }
                }
                (Constant::Parameter(i), other) => {
                    if let Some(k) = other.auxiliary() {
                        self.auxiliary.cross[(i, k)] = value;
                    }
                }
                (one, other) => {
                    if let Some(place) = one.auxiliary().zip(other.auxiliary()) {
                        self.auxiliary.covariance[place] = value;
                    }
                }
            }
        }
    }
}

/// Estimates of error terms and table, those of terms off `at` where the pass linearises.
fn auxiliary(filter: &Filter, at: &TermVector, model: &Model) -> Auxiliary {
    let layout = &filter.layout;
    let mut auxiliary = Auxiliary {
        prior_sigma: auxiliary_vector(&model.geometry.vector(), &model.term_sigma),
        ..Auxiliary::default()
    };
    let states = auxiliary_states(layout);
    for &(state, k) in &states {
        auxiliary.values[k] =
            filter.mean(state) + Auxiliary::of_terms(k).map_or(0.0, |term| at[term]);
        for &(other, j) in &states {
            auxiliary.covariance[(k, j)] = filter.covariance(state, other);
        }
        for (parameter, index) in layout.parameters() {
            auxiliary.cross[(index, k)] = filter.covariance(parameter, state);
        }
    }
    auxiliary
}

/// Estimates of the coefficients of temperature, where there are any.
fn thermal(filter: &Filter, at: &PerSensor<ThermalCoefficients>, model: &Model) -> Option<Thermal> {
    let of_model = model.thermal.as_deref()?;
    let (states, coefficients): (Vec<usize>, Vec<Coefficient>) = filter.layout.thermal().unzip();
    let n = states.len();
    let mut cross = DMatrix::zeros(PARAMETERS, n);
    for (parameter, index) in filter.layout.parameters() {
        for (k, &state) in states.iter().enumerate() {
            cross[(index, k)] = filter.covariance(parameter, state);
        }
    }
    Some(Thermal {
        model: of_model.clone(),
        values: DVector::from_fn(n, |k, _| coefficients[k].of(at) + filter.mean(states[k])),
        covariance: DMatrix::from_fn(n, n, |i, j| filter.covariance(states[i], states[j])),
        cross,
        coefficients,
    })
}

/// State and index among the auxiliary parameters of each that is on.
fn auxiliary_states(layout: &Layout) -> Vec<(usize, usize)> {
    let base = layout.table_base();
    let axes = layout.table_axes().map(|(state, k)| (state, 3 + k));
    let terms = layout.terms();
    let terms = terms.map(|(state, k)| (state, TABLE_GEOMETRY + k));
    base.chain(axes).chain(terms).collect()
}
