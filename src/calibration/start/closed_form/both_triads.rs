//! Both triads of one table, and what their residuals say of prior, base and positions.

use nalgebra::{DVector, Vector3};

use super::least_squares::{Fit, by_position, determined, fitted, linear_design};
use super::observed::Observed;
use crate::calibration::checks::drift::{Changing, drift};
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
/// contradict the prior, which would else hide what they say.
pub fn both_triads(
    observed: &PerSensor<Observed>,
    problem: &Problem,
) -> Result<(Estimate, Vec<Finding>), CalibrationError> {
    let form = problem.model.form;
    let mut covariance = ParameterMatrix::zeros();
    let mut triads = PerSensor::from_fn(|_| Triad::ideal(form));
    let mut prior = along_table_axes(problem);
    let of_positions = without_prior(observed, &prior);
    let mut findings = Vec::from_iter(far_from_prior(&prior, &of_positions));
    if !findings.is_empty() {
        prior = widened(&prior, &of_positions).unwrap_or(prior);
    }
    let base = base_of_both(observed, &prior)?;
    let mut common = Vec::new();
    for sensor in Sensor::ALL {
        let stated = observed.get(sensor);
        let known = match base {
            Some(sigma) => stated.on_base_within(sigma),
            None => stated.clone(),
        };
        let fit = fitted(stated, &prior, sensor)?;
        let residuals = left_by(stated, &fit.triad);
        findings.extend(
            residuals
                .as_ref()
                .and_then(|residuals| changing_in_time(residuals, stated, sensor)),
        );
        let rings = residuals
            .as_ref()
            .filter(|residuals| residuals.growth().is_some());
        let fit = match rings {
            None if base.is_some() => fitted(&known, &prior, sensor)?,
            None => fit,
            Some(residuals) => {
                let all: Vec<usize> = (0..stated.positions.len()).collect();
                let worst = residuals.worst(&by_position(all.len()));
                // Where one position explains it, the others are as good as stated.
                let places = if residuals.would_hold(worst.without, 3) {
                    &worst.groups
                } else {
                    &all
                };
                // Nor are they where the base explains it: they may agree with each other on what this one alone tells.
                let base = base_off(residuals, stated, &fit.triad).and(base);
                let wider = match base {
                    Some(_) => known.clone(),
                    None => known.widened(unexplained(&known, &fit.triad, places), places),
                };
                let wider = fitted(&wider, &prior, sensor)?;
                let times = worst.groups.iter().map(|&k| stated.times[k]);
                let variances = [&fit, &wider].map(|fit| fit.covariance.diagonal());
                let growth = largest_growth(variances[0].as_slice(), variances[1].as_slice());
                let worst = (times.collect(), worst.without);
                findings.push(residuals.large(sensor.name(), growth, worst, base));
                wider
            }
        };
        *triads.get_mut(sensor) = fit.triad;
        let first = parameter(sensor, 0);
        covariance
            .view_mut((first, first), (PER_TRIAD, PER_TRIAD))
            .copy_from(&fit.covariance);
        common.push(fit.gain * known.output_errors(&fit.triad.sensitivity()));
    }
    // Both triads stand on one table.
    if let [of_gyro, of_accel] = &common[..]
        && !observed.gyro.base.is_empty()
        && of_gyro.ncols() == of_accel.ncols()
    {
        let across = of_gyro * of_accel.transpose();
        let (gyro, accel) = (parameter(Sensor::Gyro, 0), parameter(Sensor::Accel, 0));
        let size = (PER_TRIAD, PER_TRIAD);
        covariance.view_mut((gyro, accel), size).copy_from(&across);
        covariance
            .view_mut((accel, gyro), size)
            .copy_from(&across.transpose());
    }
    Ok((Estimate { triads, covariance }, findings))
}

/// What positions leave of any triad, their inputs' errors taken through this one.
fn left_by(observed: &Observed, triad: &Triad) -> Option<Residuals> {
    let inputs: Vec<Vector3<f64>> = observed.positions.iter().map(|p| p.input).collect();
    let errors = observed
        .positions
        .iter()
        .flat_map(|p| <[f64; 3]>::from(p.output - triad.output(&p.input)));
    let errors = DVector::from_iterator(3 * inputs.len(), errors);
    let covariance = observed.covariance(&triad.sensitivity());
    let design = linear_design(&inputs, observed.size());
    Residuals::new(&design, &errors, &covariance)
}

/// A drift of biases or scale factors that residuals of positions follow.
fn changing_in_time(residuals: &Residuals, observed: &Observed, sensor: Sensor) -> Option<Finding> {
    let inputs: Vec<Vector3<f64>> = observed.positions.iter().map(|p| p.input).collect();
    let design = linear_design(&inputs, 1.0);
    let of = |kind, columns: [usize; 3]| Changing {
        sensor,
        kind,
        columns: design.select_columns(&columns),
        axes: vec![0, 1, 2],
    };
    let changing = [
        of(ParameterKind::Scale, [0, 5, 10]),
        of(ParameterKind::Bias, [3, 7, 11]),
    ];
    let times = observed.times.iter().flat_map(|t| [0.5 * (t[0] + t[1]); 3]);
    let times: Vec<f64> = times.collect();
    let worst = residuals.worst(&by_position(inputs.len()));
    drift(residuals, &changing, &times, worst.without)
}

/// 1σ of the base's level and north, rad, on which both triads stand, if it explains what residuals of one ring for.
fn base_of_both(
    observed: &PerSensor<Observed>,
    prior: &Model,
) -> Result<Option<f64>, CalibrationError> {
    let mut base: Option<f64> = None;
    for sensor in Sensor::ALL {
        let stated = observed.get(sensor);
        let fit = fitted(stated, prior, sensor)?;
        let residuals = left_by(stated, &fit.triad).filter(|left| left.growth().is_some());
        let off = residuals.and_then(|left| base_off(&left, stated, &fit.triad));
        base = base.into_iter().chain(off).reduce(f64::max);
    }
    Ok(base)
}

/// The same of one triad.
fn base_off(residuals: &Residuals, observed: &Observed, triad: &Triad) -> Option<f64> {
    if observed.base.is_empty() {
        return None;
    }
    let of_base = observed.output_errors_of_base(&triad.sensitivity());
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
/// makes stated σ large, and say nothing of how far those along it, which tell scale factors, are off.
fn unexplained(observed: &Observed, triad: &Triad, places: &[usize]) -> f64 {
    /// A factor of two a step, down to rounding.
    const HALVINGS: i32 = 60;
    let errors = observed.positions.iter();
    let errors = errors.map(|p| (p.output - triad.output(&p.input)).norm_squared());
    let most: f64 = errors.sum();
    let is_enough = |variance: f64| {
        let residuals = left_by(&observed.widened(variance, places), triad);
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
        let rings = |fit: &Fit| {
            let residuals = left_by(observed, &fit.triad);
            residuals.is_some_and(|residuals| residuals.growth().is_some())
        };
        // An axis that may sense nothing has no direction, and σ of what is not linear hold for small errors.
        let senses = |fit: &Fit| {
            let known =
                |k: usize| fit.triad.scale[k].abs() > SENSES * fit.covariance[(k, k)].sqrt();
            (0..3).all(known)
        };
        let fit = determined(observed, model.form);
        if let Some(fit) = fit.filter(|fit| senses(fit) && !rings(fit)) {
            *estimate.triads.get_mut(sensor) = fit.triad;
            let first = parameter(sensor, 0);
            let mut of_triad = estimate
                .covariance
                .view_mut((first, first), (PER_TRIAD, PER_TRIAD));
            of_triad.copy_from(&fit.covariance);
        }
    }
    estimate
}
