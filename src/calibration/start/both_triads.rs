//! Both triads from positions, with the evaluation of their residuals with respect to prior, base and positions.

use nalgebra::SMatrix;

use super::judged::Judged;
use super::positions::{BASE, Fit, Observed};
use crate::calibration::checks::prior_distance::{far_from_prior, widened};
use crate::calibration::checks::residuals::Residuals;
use crate::calibration::estimate::largest_growth;
use crate::calibration::{
    CalibrationError, Estimate, Finding, Model, ParameterMatrix, Problem, from_vector, parameter,
};
use crate::imu::{PARAMETERS as PER_TRIAD, ParameterKind, PerSensor, Sensor, Triad};
use crate::run::Aiding;

/// An axis works if its scale factor is farther from zero than this many σ.
const SENSES: f64 = 5.0;

/// Both triads from positions, with the prior for parameters that these do not determine. If residuals exceed their
/// limit, σ are widened until they do not, with a finding. The same applies if the positions alone contradict the
/// prior, which would otherwise hide this.
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
    let stated = PerSensor::try_from_fn(|sensor| Stated::new(observed.get(sensor), &prior))?;
    let bases = [stated.gyro.base, stated.accel.base];
    let base = bases.into_iter().flatten().reduce(f64::max);
    let fits = PerSensor::try_from_fn(|sensor| {
        let stated = stated.get(sensor);
        stated.calibrated(&prior, base, &mut findings)
    })?;
    let mut covariance = ParameterMatrix::zeros();
    let of_all = [&fits.gyro, &fits.accel].map(|fit| fit.by_errors.ncols());
    let shared = of_all[0].min(of_all[1]);
    let by_errors = |sensor| fits.get(sensor).by_errors.columns(0, shared);
    for (one, other) in [(Sensor::Gyro, Sensor::Accel), (Sensor::Accel, Sensor::Gyro)] {
        let (first, second) = (parameter(one, 0), parameter(other, 0));
        set(&mut covariance, (first, first), &fits.get(one).covariance);
        // Both triads stand on one table, where there is one.
        if observed.gyro.base_sigma.is_some() {
            let across = by_errors(one) * by_errors(other).transpose();
            let across = SMatrix::from_fn(|i, j| across[(i, j)]);
            set(&mut covariance, (first, second), &across);
        }
    }
    let triads = PerSensor::from_fn(|sensor| fits.get(sensor).triad);
    Ok((Estimate { triads, covariance }, findings))
}

fn set(
    covariance: &mut ParameterMatrix,
    place: (usize, usize),
    part: &SMatrix<f64, PER_TRIAD, PER_TRIAD>,
) {
    let mut of_triad = covariance.fixed_view_mut::<PER_TRIAD, PER_TRIAD>(place.0, place.1);
    of_triad.copy_from(part);
}

/// One triad from its positions as stated.
struct Stated<'a> {
    observed: &'a Observed,
    fit: Fit,
    drift: Option<Finding>,
    /// Evaluation of residuals that exceed their limit.
    rings: Option<Judged>,
    /// 1σ of the table's base, rad, if that explains the residuals.
    base: Option<f64>,
}

impl<'a> Stated<'a> {
    fn new(observed: &'a Observed, prior: &Model) -> Result<Self, CalibrationError> {
        let fit = observed.fitted(prior)?;
        // Among the entries of `A` and `D`.
        let places = [
            (ParameterKind::Scale, [0, 5, 10]),
            (ParameterKind::Bias, [3, 7, 11]),
        ];
        let judged = Judged::new(&observed.about(&fit.triad), &[observed.sensor], places);
        let drift = judged.as_ref().and_then(Judged::drift);
        let rings = judged.filter(|judged| judged.residuals.growth().is_some());
        let residuals = rings.as_ref().map(|judged| &judged.residuals);
        Ok(Self {
            base: residuals.and_then(|residuals| base_off(residuals, observed, &fit.triad)),
            observed,
            fit,
            drift,
            rings,
        })
    }

    /// Calibrates with the stated level and north of the base, or with this σ, rad; σ are widened if residuals exceed
    /// their limit.
    fn calibrated(
        &self,
        prior: &Model,
        base: Option<f64>,
        findings: &mut Vec<Finding>,
    ) -> Result<Fit, CalibrationError> {
        let observed = self.observed;
        let on_base = base.map(|sigma| observed.on_base(sigma));
        findings.extend(self.drift.clone());
        let Some(judged) = &self.rings else {
            return on_base.map_or_else(|| Ok(self.fit.clone()), |on_base| on_base.fitted(prior));
        };
        let (residuals, worst) = (&judged.residuals, &judged.worst);
        // Where one position explains it, the others are as good as stated. Nor are they where the base explains it: they
        // may agree with each other on what this one alone tells.
        let all: Vec<usize> = (0..observed.known.len()).collect();
        let places = match residuals.would_hold(worst.without, 3) {
            true => &worst.groups,
            false => &all,
        };
        let known = on_base.as_ref().unwrap_or(observed);
        let base = self.base.and(base);
        let wider = match base {
            Some(_) => known.fitted(prior)?,
            None => {
                let variance = unexplained(known, &self.fit.triad, places);
                known.widened(variance, places).fitted(prior)?
            }
        };
        let variances = [&self.fit, &wider].map(|fit| fit.covariance.diagonal());
        let growth = largest_growth(variances[0].as_slice(), variances[1].as_slice());
        findings.push(judged.large(observed.sensor.name(), growth, base));
        Ok(wider)
    }
}

/// 1σ of the base's level and north, rad, if it explains the residuals of a triad.
fn base_off(residuals: &Residuals, observed: &Observed, triad: &Triad) -> Option<f64> {
    observed.base_sigma?;
    // By a turn of 1 rad.
    let explained = residuals.explained_by(&observed.on_base(1.0).about(triad).by_unit(BASE));
    let left = residuals.chi_square() - explained.fall;
    let squares: f64 = explained.coefficients.iter().map(|c| c * c).sum();
    (explained.degrees > 0 && residuals.would_hold(left, explained.degrees))
        .then(|| (squares / explained.degrees as f64).sqrt())
}

/// Additional variance on every axis of these positions for which χ² of the residuals equals its expectation.
///
/// It is added, not multiplied: all residuals may belong to axes perpendicular to the input, where the table attitude
/// makes stated σ large, and do not show the errors along the input, which determine the scale factors.
fn unexplained(observed: &Observed, triad: &Triad, places: &[usize]) -> f64 {
    /// A factor of two per step, down to rounding.
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

/// The model of a problem, with its prior along the axes of table or labels, so that no angle is fixed by the
/// choice of the body frame.
fn along_table_axes(problem: &Problem) -> Model {
    let mut model = problem.model.clone();
    model.aiding = Aiding::Table;
    model.in_form(problem.run(), model.form)
}

/// Both triads from positions alone; undetermined parameters, and triads that do not fit, keep the prior.
fn without_prior(observed: &PerSensor<Observed>, model: &Model) -> Estimate {
    let mut estimate = Estimate {
        triads: from_vector(model.form, &model.prior_mean),
        covariance: ParameterMatrix::zeros(),
    };
    for sensor in Sensor::ALL {
        let observed = observed.get(sensor);
        // An axis that may sense nothing has no direction, and σ of what is not linear are for small errors.
        let senses = |fit: &Fit| {
            let sigma = |k: usize| fit.covariance[(k, k)].sqrt();
            (0..3).all(|k| fit.triad.scale[k].abs() > SENSES * sigma(k))
        };
        let rings = |fit: &Fit| {
            let residuals = observed.residuals(&fit.triad);
            residuals.is_some_and(|residuals| residuals.growth().is_some())
        };
        let fit = observed.determined(model.form);
        if let Some(fit) = fit.filter(|fit| senses(fit) && !rings(fit)) {
            *estimate.triads.get_mut(sensor) = fit.triad;
            let first = parameter(sensor, 0);
            set(&mut estimate.covariance, (first, first), &fit.covariance);
        }
    }
    estimate
}
