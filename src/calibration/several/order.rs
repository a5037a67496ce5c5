//! Selection of the orders of the temperature polynomials.

use super::thermal::{Coefficient, Thermal};
use crate::calibration::checks::observability::temperature_not_seen;
use crate::calibration::constants::{Prior, coefficients};
use crate::calibration::{
    Finding, Group, Linearisation, Model, OBSERVED_BELOW, Reduction, parameter_name,
};
use crate::imu::{InstallationForm, RATE, ThermalModel};
use crate::statistics::{FALSE_ALARM, chi_square_limit};

/// The selected model.
pub struct Selected {
    pub model: ThermalModel,
    /// The estimates under it.
    pub at: Linearisation,
    /// The finding on unobserved temperature dependence.
    pub finding: Option<Finding>,
}

/// Removes the highest order of a group of parameters while it is not significant: if its coefficients are zero,
/// −2 ln of the likelihood ratio is χ² with as many degrees of freedom as there are coefficients (Wilks).
pub fn select(
    reduction: &Reduction,
    (at, model): (&Linearisation, &Model),
    thermal: &Thermal,
) -> Selected {
    let known = Prior::new(&reduction.constants, model, at);
    let with = |model: &ThermalModel| {
        let mut prior = known.clone();
        for (place, coefficient) in coefficients(&reduction.constants) {
            prior.sigma[place] = coefficient.of(&model.sigma);
        }
        reduction.posterior(&prior)
    };
    let form = model.form;
    let mut model = thermal.model.clone();
    let mut now = with(&model);
    loop {
        let of_order = |(group, function): (Group, usize)| {
            let of = Coefficient::all(form, Some(&model)).into_iter();
            of.filter(move |c| Group::of(c.index()) == group && c.function == function)
        };
        let candidates = Group::all().flat_map(|group| {
            let orders = (0..RATE).rev();
            let there = |function: &usize| of_order((group, *function)).next().is_some();
            let highest = orders
                .filter(&there)
                .take(1)
                .chain([RATE].into_iter().filter(&there));
            highest
                .map(|function| (group, function))
                .collect::<Vec<_>>()
        });
        let least = candidates.map(|order| {
            let mut without = model.clone();
            of_order(order).for_each(|c| *c.of_mut(&mut without.sigma) = 0.0);
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
        at: reduction.estimate(at, &now),
        finding: unseen(form, thermal),
    }
}

/// The finding on parameters whose first order is hardly determined beyond its prior, if any.
fn unseen(form: InstallationForm, thermal: &Thermal) -> Option<Finding> {
    let all = thermal.coefficients.iter().enumerate();
    let unseen = all.filter(|(k, c)| {
        let limit = OBSERVED_BELOW * c.of(&thermal.model.sigma);
        c.function == 0 && thermal.covariance[(*k, *k)].sqrt() > limit
    });
    temperature_not_seen(
        unseen
            .filter_map(|(_, c)| parameter_name(form, c.index()))
            .collect(),
    )
}
