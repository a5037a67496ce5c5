//! Triads from positions with known input, by generalised least squares.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix4, SMatrix, Vector3, Vector4};

use super::super::drift::{Changing, drift};
use super::super::error::CalibrationError;
use super::super::estimate::{Estimate, largest_growth};
use super::super::finding::Finding;
use super::super::linearisation::singular;
use super::super::model::Model;
use super::super::parameters::{ParameterMatrix, from_vector, parameter};
use super::super::prior_distance::{far_from_prior, widened};
use super::super::problem::Problem;
use super::super::residuals::Residuals;
use super::observed::{NOISELESS, Observed, Position};
use crate::imu::{
    InstallationForm, PARAMETERS as PER_TRIAD, ParameterKind, PerSensor, Sensor, Triad, TriadVector,
};
use crate::run::Aiding;

/// Least eigenvalue of the correlations of a row's unknowns.
const SMALLEST_EIGENVALUE: f64 = 1e-4;
/// Steps of Gauss–Newton at most; scale factors wrong by percents need three.
const STEPS: usize = 6;
/// Scale factors further from zero than this many σ are of an axis that senses.
const SENSES: f64 = 5.0;
/// A step below this part of the σ before is no step.
const SMALL: f64 = 1e-6;

/// One triad with what its estimate follows.
pub(super) struct Fit {
    pub triad: Triad,
    /// How parameters follow all outputs.
    pub gain: DMatrix<f64>,
    /// Of the parameters.
    pub covariance: DMatrix<f64>,
}

/// Both triads from positions; with what is known beforehand where they do not determine a triad. Where
/// residuals ring, σ are widened until they do not, and a finding says so. The same where positions alone
/// contradict the prior, which would else hide what they say.
pub(super) fn both_triads(
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
                findings.push(Finding::ResidualsLarge {
                    of: sensor.name(),
                    chi_square: residuals.chi_square(),
                    degrees: residuals.degrees(),
                    limit: residuals.limit(),
                    growth: largest_growth(variances[0].as_slice(), variances[1].as_slice()),
                    worst: times.collect(),
                    without: worst.without,
                    base,
                });
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

fn fitted(observed: &Observed, model: &Model, sensor: Sensor) -> Result<Fit, CalibrationError> {
    match determined(observed, model.form) {
        Some(fit) if knows_more(model, sensor, &fit.covariance) => Ok(fit),
        _ => with_prior(model, sensor, observed),
    }
}

/// Whether positions alone know every parameter better than the prior does.
fn knows_more(model: &Model, sensor: Sensor, covariance: &DMatrix<f64>) -> bool {
    (0..PER_TRIAD).all(|k| {
        let prior = model.prior_sigma[parameter(sensor, k)];
        prior == 0.0 || covariance[(k, k)].sqrt() < prior
    })
}

/// One triad from positions and its prior.
fn with_prior(model: &Model, sensor: Sensor, observed: &Observed) -> Result<Fit, CalibrationError> {
    let prior = from_vector(model.form, &model.prior_mean);
    let mean = prior.get(sensor).to_vector();
    let sigma = TriadVector::from_fn(|k, _| model.prior_sigma[parameter(sensor, k)]);
    let rows = 3 * observed.positions.len();
    let mut triad = *prior.get(sensor);
    let step_to = |triad: &Triad| -> Option<(TriadVector, Fit)> {
        let response = triad.response();
        let mut design = DMatrix::zeros(rows, PER_TRIAD);
        let mut errors = DVector::zeros(rows);
        for (i, position) in observed.positions.iter().enumerate() {
            let input = position.input.push(1.0);
            for (k, response) in response.iter().enumerate() {
                let column = (response * input) * sigma[k];
                design.fixed_view_mut::<3, 1>(3 * i, k).copy_from(&column);
            }
            let error = position.output - triad.output(&position.input);
            errors.fixed_rows_mut::<3>(3 * i).copy_from(&error);
        }
        // In units of the prior's σ.
        let sensitivity = triad.sensitivity();
        let weighted = observed.weights(&sensitivity).cholesky()?.solve(&design);
        let information = DMatrix::identity(PER_TRIAD, PER_TRIAD) + weighted.tr_mul(&design);
        let inverse = information.cholesky()?.inverse();
        let gain = &inverse * weighted.transpose();
        let off = DVector::from_fn(PER_TRIAD, |k, _| match sigma[k] > 0.0 {
            true => (mean[k] - triad.to_vector()[k]) / sigma[k],
            false => 0.0,
        });
        let step = &gain * errors + &inverse * off;
        let covariance = &gain * observed.covariance(&sensitivity) * gain.transpose()
            + &inverse * inverse.transpose();
        let unscale = DMatrix::from_diagonal(&DVector::from_column_slice(sigma.as_slice()));
        let fit = Fit {
            triad: *triad,
            gain: &unscale * gain,
            covariance: &unscale * covariance * &unscale,
        };
        Some((TriadVector::from_fn(|k, _| step[k]), fit))
    };
    for _ in 0..STEPS {
        let (step, _) = step_to(&triad).ok_or_else(|| singular(&prior))?;
        if !step.iter().all(|v| v.is_finite()) {
            return Err(singular(&prior));
        }
        triad = Triad::from_vector(
            model.form,
            &(triad.to_vector() + step.component_mul(&sigma)),
        );
        if step.amax() < SMALL {
            break;
        }
    }
    let (_, fit) = step_to(&triad).ok_or_else(|| singular(&prior))?;
    Ok(fit)
}

/// One triad from positions: least squares for `A = K C` and `D` row by row, then the form's split.
/// Gives the triad and the covariance of its parameters; `None` if fewer than four positions or
/// positions that leave a row undetermined.
pub fn six_position_triad(
    positions: &[Position],
    form: InstallationForm,
) -> Option<(Triad, SMatrix<f64, PER_TRIAD, PER_TRIAD>)> {
    let fit = determined(&Observed::independent(positions), form)?;
    let covariance = SMatrix::from_fn(|i, j| fit.covariance[(i, j)]);
    Some((fit.triad, covariance))
}

/// The same with all that the positions have in common.
pub(super) fn determined(observed: &Observed, form: InstallationForm) -> Option<Fit> {
    let positions = &observed.positions;
    let size = observed.size();
    if positions.len() < 4 || size <= 0.0 || in_a_plane(positions, size) {
        return None;
    }
    let inputs: Vec<Vector3<f64>> = positions.iter().map(|p| p.input).collect();
    let design = linear_design(&inputs, size);
    let outputs = positions.iter().flat_map(|p| <[f64; 3]>::from(p.output));
    let outputs = DVector::from_iterator(design.nrows(), outputs);
    let mut sensitivity = Matrix3::identity();
    let mut found = None;
    // What an error of the inputs does to the outputs takes the triad itself.
    let rounds = if observed.errors.ncols() == 0 { 1 } else { 2 };
    for _ in 0..rounds {
        let factor = observed.weights(&sensitivity).cholesky()?.l();
        let qr = factor.solve_lower_triangular(&design)?.qr();
        // x = R⁻¹ Qᵀ L⁻¹ y: not by way of the squares of its equations.
        let gain = qr.r().solve_upper_triangular(&qr.q().transpose())?;
        let gain = factor
            .tr_solve_lower_triangular(&gain.transpose())?
            .transpose();
        let unknowns = &gain * &outputs;
        sensitivity = Matrix3::from_fn(|i, j| unknowns[4 * i + j] / size);
        let bias = Vector3::from_fn(|i, _| unknowns[4 * i + 3]);
        found = Some((gain, bias));
    }
    let (gain, bias) = found?;
    let triad = Triad::from_sensitivity(form, &sensitivity, bias);
    triad.correction()?;
    let gain = split_jacobian(form, &sensitivity, &bias, size) * gain;
    let covariance = &gain * observed.covariance(&sensitivity) * gain.transpose();
    Some(Fit {
        triad,
        gain,
        covariance,
    })
}

/// Whether positions leave a row undetermined: in a plane they leave an eigenvalue of nothing but rounding
/// and table error, whatever the weights.
fn in_a_plane(positions: &[Position], size: f64) -> bool {
    (0..3).any(|axis| {
        let mut information = Matrix4::zeros();
        for position in positions {
            let row: Vector4<f64> = (position.input / size).push(1.0);
            let variance = position.weighted[axis].max((NOISELESS * size).powi(2));
            information += row * row.transpose() / variance;
        }
        let diagonal = information.diagonal();
        if diagonal.min() <= 0.0 {
            return true;
        }
        let weight = Matrix4::from_diagonal(&diagonal.map(|v: f64| v.sqrt().recip()));
        let correlations = weight * information * weight;
        correlations.symmetric_eigenvalues().min() < SMALLEST_EIGENVALUE
    })
}

/// Equations of a triad's outputs by `A` and `D`: three a position, twelve unknowns.
pub(in crate::calibration) fn linear_design(inputs: &[Vector3<f64>], size: f64) -> DMatrix<f64> {
    let mut design = DMatrix::zeros(3 * inputs.len(), 12);
    for (k, input) in inputs.iter().enumerate() {
        let row = (input / size).push(1.0).transpose();
        for axis in 0..3 {
            design
                .fixed_view_mut::<1, 4>(3 * k + axis, 4 * axis)
                .copy_from(&row);
        }
    }
    design
}

/// The equations of each position.
pub(in crate::calibration) fn by_position(positions: usize) -> Vec<Vec<usize>> {
    (0..positions)
        .map(|k| (3 * k..3 * k + 3).collect())
        .collect()
}

/// How the parameters follow `A`, its inputs over their size, and `D`, row by row, through the form's split.
fn split_jacobian(
    form: InstallationForm,
    a: &Matrix3<f64>,
    bias: &Vector3<f64>,
    size: f64,
) -> DMatrix<f64> {
    /// The split is smooth at unit scale; central differences leave 1e-10 of relative error.
    const STEP: f64 = 1e-5;
    let mut jacobian = DMatrix::zeros(PER_TRIAD, 12);
    for axis in 0..3 {
        for k in 0..4 {
            let shifted = |by: f64| -> TriadVector {
                let (mut a, mut bias) = (*a, *bias);
                if k < 3 {
                    a[(axis, k)] += by;
                } else {
                    bias[axis] += by;
                }
                Triad::from_sensitivity(form, &a, bias).to_vector()
            };
            let slope = (shifted(STEP) - shifted(-STEP)) / (2.0 * STEP);
            let slope = if k < 3 { slope / size } else { slope };
            jacobian.set_column(4 * axis + k, &slope);
        }
    }
    jacobian
}

/// How much of a small turn about any axis each component of an input sees, squared: the magnitude of the
/// other two components.
pub(super) fn across(input: &Vector3<f64>) -> Vector3<f64> {
    input.map(|component| input.norm_squared() - component.powi(2))
}

#[cfg(test)]
mod tests;
