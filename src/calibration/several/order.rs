//! Which orders of the polynomials the data call for.

use super::thermal::{Coefficient, Thermal};
use crate::calibration::checks::finding::Finding;
use crate::calibration::checks::observability::temperature_not_seen;
use crate::calibration::constants::Prior;
use crate::calibration::gauss_newton::Iterated;
use crate::calibration::linearisation::Linearisation;
use crate::calibration::parameters::{OBSERVED_BELOW, parameter_name};
use crate::calibration::problem::Problem;
use crate::imu::{InstallationForm, ParameterKind, RATE, Sensor, ThermalModel, Triad};
use crate::statistics::{FALSE_ALARM, chi_square_limit};

/// What of a model the data call for.
pub struct Selected {
    pub model: ThermalModel,
    /// The estimates under it.
    pub at: Linearisation,
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

/// Takes the highest order of a kind of parameters off while the data do not call for it: where it is zero, the
/// ratio of likelihoods with and without it is χ² of as many degrees as it has coefficients (Wilks).
pub fn select(problem: &Problem, iterated: &Iterated, thermal: &Thermal) -> Selected {
    let held = &iterated.held;
    let reduction = held.reduction.clone().folded();
    let known = Prior::new(&reduction.constants, &problem.model, &held.at);
    let with = |model: &ThermalModel| {
        let mut prior = known.clone();
        for (place, coefficient) in reduction.coefficients() {
            prior.sigma[place] = coefficient.of(&model.sigma);
        }
        reduction.posterior(&prior)
    };
    let mut model = thermal.model.clone();
    let mut now = with(&model);
    loop {
        let of_order = |order: Order| {
            let of = Coefficient::all(problem.model.form, Some(&model)).into_iter();
            of.filter(move |coefficient| Order::of(coefficient) == order)
        };
        let without = |order: Order| {
            let mut without = model.clone();
            of_order(order).for_each(|coefficient| *coefficient.of_mut(&mut without.sigma) = 0.0);
            without
        };
        let candidates = highest(problem.model.form, &model).into_iter();
        let least = candidates.map(|order| {
            let without = without(order);
            let posterior = with(&without);
            let limit = chi_square_limit(of_order(order).count() as f64, FALSE_ALARM);
            ((posterior.cost - now.cost) / limit, without, posterior)
        });
        match least.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((ratio, without, posterior)) if ratio < 1.0 => (model, now) = (without, posterior),
            _ => break,
        }
    }
    Selected {
        model,
        at: reduction.estimate(&held.at, &now),
        unseen: unseen(thermal),
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

impl Selected {
    /// What the recordings do not show, if there is anything.
    pub fn finding(&self, form: InstallationForm) -> Option<Finding> {
        let names = self.unseen.iter();
        let names = names.filter_map(|c| parameter_name(form, c.index()));
        let parameters: Vec<String> = names.collect();
        temperature_not_seen(parameters)
    }
}

/// The highest order of each kind of parameters, and its rate.
fn highest(form: InstallationForm, model: &ThermalModel) -> Vec<Order> {
    let mut orders: Vec<Order> = Coefficient::all(form, Some(model))
        .iter()
        .map(Order::of)
        .collect();
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
