//! Estimation of both triads from positions.

use super::positions::{Fit, Observed};
use crate::calibration::checks::prior_distance::{far_from_prior, widened};
use crate::calibration::{
    CalibrationError, Estimate, Finding, Model, ParameterMatrix, Problem, from_vector, parameter,
};
use crate::imu::{PARAMETERS as PER_TRIAD, PerSensor, Sensor};
use crate::run::Aiding;

/// An axis counts as working if its scale factor is farther from zero than this many σ.
const SENSES: f64 = 5.0;

/// Estimates both triads from positions, with the prior for parameters that the positions do not determine. If the
/// positions alone contradict the prior, the prior is widened, with a finding.
pub fn both_triads(
    observed: &PerSensor<Observed>,
    problem: &Problem,
) -> Result<(Estimate, Vec<Finding>), CalibrationError> {
    let prior = along_table_axes(problem);
    let of_positions = without_prior(observed, &prior);
    let mut findings = Vec::from_iter(far_from_prior(&prior, &of_positions));
    let wide = widened(&prior, &of_positions).filter(|_| !findings.is_empty());
    let prior = wide.unwrap_or(prior);
    let fits = PerSensor::try_from_fn(|sensor| observed.get(sensor).fitted(&prior))?;
    let mut covariance = ParameterMatrix::zeros();
    for sensor in Sensor::ALL {
        set_covariance(&mut covariance, sensor, fits.get(sensor));
        findings.extend(fits.get(sensor).residuals.finding(sensor.name()));
    }
    // If there is a table, both triads are on it.
    let [gyro, accel] = Sensor::ALL.map(|sensor| parameter(sensor, 0));
    for (number, by_gyro) in &fits.gyro.by_table {
        let Some(by_accel) = fits.accel.by_table.get(number) else {
            continue;
        };
        let across = by_gyro * by_accel.transpose();
        let mut of_triads = covariance.fixed_view_mut::<PER_TRIAD, PER_TRIAD>(gyro, accel);
        of_triads += across;
        let mut of_triads = covariance.fixed_view_mut::<PER_TRIAD, PER_TRIAD>(accel, gyro);
        of_triads += across.transpose();
    }
    let triads = PerSensor::from_fn(|sensor| fits.get(sensor).triad);
    Ok((Estimate { triads, covariance }, findings))
}

fn set_covariance(covariance: &mut ParameterMatrix, sensor: Sensor, fit: &Fit) {
    let first = parameter(sensor, 0);
    let mut of_triad = covariance.fixed_view_mut::<PER_TRIAD, PER_TRIAD>(first, first);
    of_triad.copy_from(&fit.covariance);
}

/// The model of a problem, with its prior along the axes of table or labels, so that no angle is fixed by the
/// choice of the body frame.
fn along_table_axes(problem: &Problem) -> Model {
    let mut model = problem.model.clone();
    model.aiding = Aiding::Table;
    model.in_form(problem.run(), model.form)
}

/// Both triads from positions alone; triads that the positions do not determine keep the prior.
fn without_prior(observed: &PerSensor<Observed>, model: &Model) -> Estimate {
    let mut estimate = Estimate {
        triads: from_vector(model.form, &model.prior_mean),
        covariance: ParameterMatrix::zeros(),
    };
    // An axis that may sense nothing has no direction, and the linearised σ are valid only for small errors.
    let senses = |fit: &Fit| {
        let sigma = |k: usize| fit.covariance[(k, k)].sqrt();
        (0..3).all(|k| fit.triad.scale[k].abs() > SENSES * sigma(k))
    };
    for sensor in Sensor::ALL {
        let fit = observed.get(sensor).determined(model.form);
        if let Some(fit) = fit.filter(senses) {
            *estimate.triads.get_mut(sensor) = fit.triad;
            set_covariance(&mut estimate.covariance, sensor, &fit);
        }
    }
    estimate
}
