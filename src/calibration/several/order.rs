//! Which orders of the polynomials the data call for.

use nalgebra::{DMatrix, DVector};

use super::thermal::{Coefficient, Thermal};
use crate::calibration::checks::finding::Finding;
use crate::calibration::checks::observability::temperature_not_seen;
use crate::calibration::linearisation::Linearisation;
use crate::calibration::parameters::{OBSERVED_BELOW, ParameterMatrix, parameter_name};
use crate::imu::{InstallationForm, ParameterKind, RATE, Sensor, ThermalModel, Triad};
use crate::statistics::{FALSE_ALARM, chi_square_limit};

/// What of a model the data call for.
pub struct Selected {
    pub model: ThermalModel,
    /// The estimates under it.
    pub conditioned: Conditioned,
    /// Coefficients of first order that the recordings did not show.
    unseen: Vec<Coefficient>,
}

/// The highest order that is kept of one kind of parameters of a triad.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Order {
    accel: bool,
    kind: usize,
    function: usize,
}

/// Estimates where others are known to be zero.
pub struct Conditioned {
    coefficients: Vec<Coefficient>,
    values: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Change of the parameters of both triads.
    change: DVector<f64>,
    cross: DMatrix<f64>,
}

/// Takes the highest order of a kind of parameters off while the data do not call for it: where it is zero, the
/// ratio of likelihoods with and without it is χ² of as many degrees as it has coefficients (Wilks).
pub fn select(thermal: &Thermal, parameters: &ParameterMatrix) -> Selected {
    let mut left = Conditioned::new(thermal, parameters);
    let mut model = thermal.model.clone();
    let unseen = unseen(thermal);
    loop {
        let least = left
            .highest()
            .into_iter()
            .filter_map(|order| {
                let places = left.places(order);
                let gain = left.gain(&places)?;
                let limit = chi_square_limit(places.len() as f64, FALSE_ALARM);
                Some((gain / limit, order))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match least {
            Some((ratio, order)) if ratio < 1.0 => {
                for coefficient in left.without(order) {
                    let sigma = model.sigma.get_mut(coefficient.sensor);
                    sigma[(coefficient.parameter, coefficient.function)] = 0.0;
                }
            }
            _ => break,
        }
    }
    Selected {
        model,
        conditioned: left,
        unseen,
    }
}

/// Coefficients of first order of which little more is known than before.
fn unseen(thermal: &Thermal) -> Vec<Coefficient> {
    let all = thermal.coefficients.iter().enumerate();
    all.filter(|(k, c)| {
        let prior = thermal.model.sigma.get(c.sensor)[(c.parameter, c.function)];
        c.function == 0 && thermal.covariance[(*k, *k)].sqrt() > OBSERVED_BELOW * prior
    })
    .map(|(_, c)| *c)
    .collect()
}

/// Takes these estimates of the coefficients, and of the parameters what goes with them.
pub fn move_to(conditioned: &Conditioned, at: &mut Linearisation) {
    at.thermal = Default::default();
    for (coefficient, value) in conditioned.coefficients.iter().zip(&conditioned.values) {
        *coefficient.of_mut(&mut at.thermal) = *value;
    }
    let moved = crate::calibration::parameters::to_vector(&at.triads) + change(conditioned);
    at.triads = crate::calibration::parameters::from_vector(at.triads.gyro.form, &moved);
}

fn change(conditioned: &Conditioned) -> crate::calibration::parameters::ParameterVector {
    crate::calibration::parameters::ParameterVector::from_fn(|i, _| conditioned.change[i])
}

impl Selected {
    /// What the recordings do not show, if there is anything.
    pub fn finding(&self, form: InstallationForm) -> Option<Finding> {
        let names = self.unseen.iter();
        let names = names.filter_map(|c| parameter_name(form, c.index()));
        let parameters: Vec<String> = names.collect();
        temperature_not_seen(parameters)
    }
}

impl Conditioned {
    fn new(thermal: &Thermal, parameters: &ParameterMatrix) -> Self {
        Self {
            coefficients: thermal.coefficients.clone(),
            values: thermal.values.clone(),
            covariance: thermal.covariance.clone(),
            change: DVector::zeros(parameters.nrows()),
            cross: thermal.cross.clone(),
        }
    }

    /// The highest order of each kind of parameters, and its rate.
    fn highest(&self) -> Vec<Order> {
        let mut orders: Vec<Order> = self.coefficients.iter().map(Order::of).collect();
        orders.sort();
        orders.dedup();
        let top = |order: &Order| {
            order.function == RATE
                || !orders.iter().any(|other| {
                    (other.accel, other.kind) == (order.accel, order.kind)
                        && other.function > order.function
                        && other.function < RATE
                })
        };
        orders.iter().copied().filter(top).collect()
    }

    fn places(&self, order: Order) -> Vec<usize> {
        let all = self.coefficients.iter().enumerate();
        all.filter(|(_, c)| Order::of(c) == order)
            .map(|(k, _)| k)
            .collect()
    }

    /// By how much −2 ln of the likelihood rises where these are zero.
    fn gain(&self, places: &[usize]) -> Option<f64> {
        let n = places.len();
        let values = DVector::from_fn(n, |i, _| self.values[places[i]]);
        let covariance = DMatrix::from_fn(n, n, |i, j| self.covariance[(places[i], places[j])]);
        Some(values.dot(&covariance.cholesky()?.solve(&values)))
    }

    /// Takes an order off, which is known to be zero then; its coefficients.
    fn without(&mut self, order: Order) -> Vec<Coefficient> {
        let off = self.places(order);
        let taken = off.iter().map(|&k| self.coefficients[k]).collect();
        let n = off.len();
        let inner = DMatrix::from_fn(n, n, |i, j| self.covariance[(off[i], off[j])]);
        let values = DVector::from_fn(n, |i, _| self.values[off[i]]);
        if let Some(factor) = inner.cholesky() {
            let across = self.covariance.select_columns(&off);
            let with_parameters = self.cross.select_columns(&off);
            let solved = factor.solve(&values);
            let back = factor.solve(&across.transpose());
            self.values -= &across * &solved;
            self.change -= &with_parameters * &solved;
            self.cross -= &with_parameters * &back;
            self.covariance -= &across * &back;
        }
        let left: Vec<usize> = (0..self.coefficients.len())
            .filter(|k| !off.contains(k))
            .collect();
        self.coefficients = left.iter().map(|&k| self.coefficients[k]).collect();
        self.values = self.values.select_rows(&left);
        self.covariance = self.covariance.select_rows(&left).select_columns(&left);
        self.cross = self.cross.select_columns(&left);
        taken
    }
}

impl Order {
    fn of(coefficient: &Coefficient) -> Self {
        let kind = Triad::kind(coefficient.parameter);
        Self {
            accel: coefficient.sensor == Sensor::Accel,
            kind: ParameterKind::ALL
                .iter()
                .position(|&k| k == kind)
                .unwrap_or(0),
            function: coefficient.function,
        }
    }
}
