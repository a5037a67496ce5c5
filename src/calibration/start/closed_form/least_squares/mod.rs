//! One triad from positions with known input, by generalised least squares.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix4, SMatrix, Vector3, Vector4};

use super::observed::{NOISELESS, Observed, Position};
use crate::calibration::error::CalibrationError;
use crate::calibration::linearisation::singular;
use crate::calibration::model::Model;
use crate::calibration::parameters::{from_vector, parameter};
use crate::imu::{InstallationForm, PARAMETERS as PER_TRIAD, Sensor, Triad, TriadVector};

/// Least eigenvalue of the correlations of a row's unknowns.
const SMALLEST_EIGENVALUE: f64 = 1e-4;
/// Steps of Gauss–Newton at most; scale factors wrong by percents need three.
const STEPS: usize = 6;
/// A step below this part of the σ before is no step.
const SMALL: f64 = 1e-6;

/// One triad with what its estimate follows.
pub struct Fit {
    pub triad: Triad,
    /// How parameters follow all outputs.
    pub gain: DMatrix<f64>,
    /// Of the parameters.
    pub covariance: DMatrix<f64>,
}

/// One triad from positions; with what is known beforehand where they do not know every parameter better.
pub fn fitted(observed: &Observed, model: &Model, sensor: Sensor) -> Result<Fit, CalibrationError> {
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
pub fn determined(observed: &Observed, form: InstallationForm) -> Option<Fit> {
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
pub fn linear_design(inputs: &[Vector3<f64>], size: f64) -> DMatrix<f64> {
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
pub fn by_position(positions: usize) -> Vec<Vec<usize>> {
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
pub fn across(input: &Vector3<f64>) -> Vector3<f64> {
    input.map(|component| input.norm_squared() - component.powi(2))
}

#[cfg(test)]
mod tests;
