//! Both triads from positions, and what their residuals show of prior, base and positions.

use nalgebra::Vector3;

use super::positions::{Fit, Observed};
use crate::calibration::checks::drift::drift;
use crate::calibration::checks::finding::Finding;
use crate::calibration::checks::prior_distance::{far_from_prior, widened};
use crate::calibration::checks::residuals::Residuals;
use crate::calibration::error::CalibrationError;
use crate::calibration::estimate::{Estimate, largest_growth};
use crate::calibration::model::Model;
use crate::calibration::parameters::{ParameterMatrix, from_vector, parameter};
use crate::calibration::problem::Problem;
use crate::imu::{PARAMETERS as PER_TRIAD, ParameterKind, PerSensor, Sensor, Triad};
use crate::run::Aiding;

/// Scale factors further from zero than this many σ are of an axis that senses.
const SENSES: f64 = 5.0;

/// Both triads from positions; with what is known beforehand where they do not determine a triad. Where
/// residuals ring, σ are widened until they do not, and a finding says so. The same where positions alone
/// contradict the prior, which would else hide what they show.
pub fn both_triads(
    observed: &PerSensor<Observed>,
    problem: &Problem,
) -> Result<(Estimate, Vec<Finding>), CalibrationError> {
    let mut prior = along_table_axes(problem);
    let of_positions = without_prior(observed, &prior);
    let mut findings = Vec::from_iter(far_from_prior(&prior, &of_positions));
    if !findings.is_empty() {
        prior = widened(&prior, &of_positions).unwrap_or(prior);
    }
    let base = base_of_both(observed, &prior)?;
    let mut one_triad = |sensor| one_triad(observed.get(sensor), &prior, base, &mut findings);
    let fits = PerSensor {
        gyro: one_triad(Sensor::Gyro)?,
        accel: one_triad(Sensor::Accel)?,
    };
    let mut covariance = ParameterMatrix::zeros();
    // Both triads stand on one table, where there is one.
    let of_one_table = observed.gyro.known.iter().any(|known| known.base.is_some());
    let columns = fits
        .gyro
        .by_errors
        .ncols()
        .max(fits.accel.by_errors.ncols());
    let by_errors = |sensor| {
        fits.get(sensor)
            .by_errors
            .clone()
            .resize_horizontally(columns, 0.0)
    };
    for (one, other) in [(Sensor::Gyro, Sensor::Accel), (Sensor::Accel, Sensor::Gyro)] {
        let first = parameter(one, 0);
        let mut of_triad = covariance.fixed_view_mut::<PER_TRIAD, PER_TRIAD>(first, first);
        of_triad.copy_from(&fits.get(one).covariance);
        if of_one_table {
            let place = (first, parameter(other, 0));
            let mut across = covariance.view_mut(place, (PER_TRIAD, PER_TRIAD));
            across.copy_from(&(by_errors(one) * by_errors(other).transpose()));
        }
    }
    let triads = PerSensor::from_fn(|sensor| fits.get(sensor).triad);
    Ok((Estimate { triads, covariance }, findings))
}

/// One triad on a base whose level and north are as stated, or known to this σ only, rad.
fn one_triad(
    stated: &Observed,
    prior: &Model,
    base: Option<f64>,
    findings: &mut Vec<Finding>,
) -> Result<Fit, CalibrationError> {
    let on_base = Observed {
        base_sigma: base.map_or(stated.base_sigma, Vector3::repeat),
        ..stated.clone()
    };
    let fit = stated.fitted(prior)?;
    let on_base_fitted = |fit| match base {
        Some(_) => on_base.fitted(prior),
        None => Ok(fit),
    };
    let Some(residuals) = stated.residuals(&fit.triad) else {
        return on_base_fitted(fit);
    };
    let all: Vec<usize> = (0..stated.known.len()).collect();
    let of_each: Vec<Vec<usize>> = all.iter().map(|k| (3 * k..3 * k + 3).collect()).collect();
    let worst = residuals.worst(&of_each);
    findings.extend(changing_in_time(
        &residuals,
        stated,
        &fit.triad,
        worst.without,
    ));
    if residuals.growth().is_none() {
        return on_base_fitted(fit);
    }
    // Where one position explains it, the others are as good as stated. Nor are they where the base explains it: they
    // may agree with each other on what this one alone tells.
    let base = base_off(&residuals, stated, &fit.triad).and(base);
    let places = match residuals.would_hold(worst.without, 3) {
        true => &worst.groups,
        false => &all,
    };
    let wider = match base {
        Some(_) => on_base,
        None => on_base.widened(unexplained(&on_base, &fit.triad, places), places),
    };
    let wider = wider.fitted(prior)?;
    let variances = [&fit, &wider].map(|fit| fit.covariance.diagonal());
    findings.push(Finding::ResidualsLarge {
        of: stated.sensor.name(),
        chi_square: residuals.chi_square(),
        degrees: residuals.degrees(),
        limit: residuals.limit(),
        growth: largest_growth(variances[0].as_slice(), variances[1].as_slice()),
        worst: worst
            .groups
            .iter()
            .map(|&k| stated.known[k].times)
            .collect(),
        without: worst.without,
        base,
    });
    Ok(wider)
}

/// A drift of biases or scale factors that residuals of positions follow.
fn changing_in_time(
    residuals: &Residuals,
    observed: &Observed,
    triad: &Triad,
    without_worst: f64,
) -> Option<Finding> {
    let equations = observed.of_sensitivity(&triad.sensitivity(), &triad.bias);
    let of = |kind, of_axes| equations.changing(observed.sensor, kind, of_axes);
    let changing = [
        of(ParameterKind::Scale, [0, 5, 10]),
        of(ParameterKind::Bias, [3, 7, 11]),
    ];
    let times = observed
        .known
        .iter()
        .flat_map(|of| [0.5 * (of.times[0] + of.times[1]); 3]);
    drift(
        residuals,
        &changing,
        &times.collect::<Vec<_>>(),
        without_worst,
    )
}

/// 1σ of the base's level and north, rad, on which both triads stand, if it explains why residuals of one ring.
fn base_of_both(
    observed: &PerSensor<Observed>,
    prior: &Model,
) -> Result<Option<f64>, CalibrationError> {
    let mut base: Option<f64> = None;
    for sensor in Sensor::ALL {
        let stated = observed.get(sensor);
        let triad = stated.fitted(prior)?.triad;
        let residuals = stated
            .residuals(&triad)
            .filter(|left| left.growth().is_some());
        let off = residuals.and_then(|left| base_off(&left, stated, &triad));
        base = base.into_iter().chain(off).reduce(f64::max);
    }
    Ok(base)
}

/// The same of one triad.
fn base_off(residuals: &Residuals, observed: &Observed, triad: &Triad) -> Option<f64> {
    let of_base = observed.by_base(triad)?;
    let explained = residuals.explained_by(&of_base);
    let left = residuals.chi_square() - explained.fall;
    let squares: f64 = explained.coefficients.iter().map(|c| c * c).sum();
    (explained.degrees > 0 && residuals.would_hold(left, explained.degrees))
        .then(|| (squares / explained.degrees as f64).sqrt())
}

/// The variance that every axis of these positions must have more for χ² of the residuals to be what is
/// expected of it.
///
/// It is added, not multiplied: residuals may all be of axes across the input, where a table's attitude
/// makes stated σ large, and show nothing of how far those along it are off, by which scale factors are found.
fn unexplained(observed: &Observed, triad: &Triad, places: &[usize]) -> f64 {
    /// A factor of two a step, down to rounding.
    const HALVINGS: i32 = 60;
    let errors = observed.known.iter().map(|known| &known.position);
    let errors = errors.map(|p| (p.output - triad.output(&p.input)).norm_squared());
    let most: f64 = errors.sum();
    let is_enough = |variance: f64| {
        let residuals = observed.widened(variance, places).residuals(triad);
        residuals.is_none_or(|left| left.chi_square() <= left.degrees() as f64)
    };
    let halved = |times: i32| most * 0.5f64.powi(times);
    let last = (0..HALVINGS).find(|&times| !is_enough(halved(times)));
    let (mut low, mut high) = match last {
        None => return halved(HALVINGS),
        Some(times) => (halved(times), halved(times - 1)),
    };
    // χ² over its degrees of freedom scatters by far more than these leave.
    for _ in 0..6 {
        let middle = 0.5 * (low + high);
        *if is_enough(middle) {
            &mut high
        } else {
            &mut low
        } = middle;
    }
    high
}

/// The model of a problem, its prior along the axes of table or labels, so that no angle is a choice of the
/// body frame.
fn along_table_axes(problem: &Problem) -> Model {
    let mut model = problem.model.clone();
    model.aiding = Aiding::Table;
    model.in_form(problem.run(), model.form)
}

/// Both triads by positions alone; what they do not determine, or what no triad explains, is as in the prior.
fn without_prior(observed: &PerSensor<Observed>, model: &Model) -> Estimate {
    let mut estimate = Estimate {
        triads: from_vector(model.form, &model.prior_mean),
        covariance: ParameterMatrix::zeros(),
    };
    for sensor in Sensor::ALL {
        let observed = observed.get(sensor);
        // An axis that may sense nothing has no direction, and σ of what is not linear are for small errors.
        let senses = |fit: &Fit| {
            let known =
                |k: usize| fit.triad.scale[k].abs() > SENSES * fit.covariance[(k, k)].sqrt();
            (0..3).all(known)
        };
        let rings = |fit: &Fit| {
            let residuals = observed.residuals(&fit.triad);
            residuals.is_some_and(|residuals| residuals.growth().is_some())
        };
        let fit = observed.determined(model.form);
        if let Some(fit) = fit.filter(|fit| senses(fit) && !rings(fit)) {
            *estimate.triads.get_mut(sensor) = fit.triad;
            let first = parameter(sensor, 0);
            let mut of_triad = estimate
                .covariance
                .fixed_view_mut::<PER_TRIAD, PER_TRIAD>(first, first);
            of_triad.copy_from(&fit.covariance);
        }
    }
    estimate
}
