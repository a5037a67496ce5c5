//! Triads from positions with known input, by least squares.

use faer::Mat;
use faer::linalg::solvers::SolveLstsq;
use nalgebra::{Matrix3, Matrix4, SMatrix, Vector3, Vector4};

use super::super::coarse::{Equations, gauss_newton};
use super::super::error::CalibrationError;
use super::super::estimate::Estimate;
use super::super::linearisation::singular;
use super::super::parameters::{ParameterMatrix, from_vector, parameter};
use super::super::problem::Problem;
use crate::imu::{
    InstallationForm, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad, TriadVector,
};
use crate::run::Aiding;

/// The mean output of a triad under an input that is known from elsewhere: at a position, or over a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Mean input along body axes, rad/s or m/s².
    pub input: Vector3<f64>,
    /// Mean normalised output, rad/s or m/s².
    pub output: Vector3<f64>,
    /// Variance of each output axis, (rad/s)² or (m/s²)².
    pub variance: Vector3<f64>,
    /// The same, by which it is weighted: the variance itself unless that would trust it too much.
    pub weighted: Vector3<f64>,
}

/// Least eigenvalue of the correlations of a row's unknowns.
const SMALLEST_EIGENVALUE: f64 = 1e-4;

/// Relative σ of an output for which no noise is stated.
const NOISELESS: f64 = 1e-9;

/// Both triads from positions; with what is known beforehand where they do not determine a triad.
pub(super) fn both_triads(
    positions: &PerSensor<Vec<Position>>,
    problem: &Problem,
) -> Result<Estimate, CalibrationError> {
    let form = problem.model.form;
    let mut covariance = ParameterMatrix::zeros();
    let mut triads = PerSensor::from_fn(|_| Triad::ideal(form));
    for sensor in Sensor::ALL {
        let positions = positions.get(sensor);
        let (triad, of_triad) = match six_position_triad(positions, form) {
            Some(determined) if knows_more(problem, sensor, &determined.1) => determined,
            _ => with_prior(problem, sensor, positions)?,
        };
        *triads.get_mut(sensor) = triad;
        let first = parameter(sensor, 0);
        covariance
            .fixed_view_mut::<PER_TRIAD, PER_TRIAD>(first, first)
            .copy_from(&of_triad);
    }
    Ok(Estimate { triads, covariance })
}

/// Whether positions alone know every parameter better than the prior does.
fn knows_more(
    problem: &Problem,
    sensor: Sensor,
    covariance: &SMatrix<f64, PER_TRIAD, PER_TRIAD>,
) -> bool {
    (0..PER_TRIAD).all(|k| {
        let prior = problem.model.prior_sigma[parameter(sensor, k)];
        prior == 0.0 || covariance[(k, k)].sqrt() < prior
    })
}

/// One triad from positions and its prior, with the covariance of its parameters.
fn with_prior(
    problem: &Problem,
    sensor: Sensor,
    positions: &[Position],
) -> Result<(Triad, SMatrix<f64, PER_TRIAD, PER_TRIAD>), CalibrationError> {
    // Inputs are along the axes of table or labels, so that no angle is a choice of the body frame.
    let mut model = problem.model.clone();
    model.aiding = Aiding::Table;
    let model = model.in_form(problem.run(), model.form);
    let equations = |triads: &PerSensor<Triad>| {
        let triad = triads.get(sensor);
        let response = triad.response();
        let mut equations = Equations::new(&model, triads, &[sensor]);
        for position in positions {
            let error = position.output - triad.output(&position.input);
            for axis in 0..3 {
                let input = position.input.push(1.0);
                let row = TriadVector::from_fn(|k, _| (response[k] * input)[axis]);
                equations.add(&[(sensor, row)], error[axis], position.variance[axis]);
            }
        }
        Ok(equations)
    };
    let prior = from_vector(model.form, &model.prior_mean);
    let triads = gauss_newton(prior, equations)?;
    let covariance = equations(&triads)?.covariance();
    let first = parameter(sensor, 0);
    let covariance = covariance.ok_or_else(|| singular(&triads))?;
    let of_triad = covariance.fixed_view::<PER_TRIAD, PER_TRIAD>(first, first);
    Ok((*triads.get(sensor), of_triad.into_owned()))
}

/// One triad from positions: least squares for `A = K C` and `D` row by row, then the form's split.
/// Gives the triad and the covariance of its parameters; `None` if fewer than four positions or
/// positions that leave a row undetermined.
pub fn six_position_triad(
    positions: &[Position],
    form: InstallationForm,
) -> Option<(Triad, SMatrix<f64, PER_TRIAD, PER_TRIAD>)> {
    let size = positions.iter().map(|p| p.input.norm()).fold(0.0, f64::max);
    if positions.len() < 4 || size <= 0.0 {
        return None;
    }
    let mut a = Matrix3::zeros();
    let mut bias = Vector3::zeros();
    // Of the rows of A and of D, four numbers a row.
    let mut covariance = [Matrix4::zeros(); 3];
    // One scale for the inputs, so that columns are alike.
    let unscale = Matrix4::from_diagonal(&Vector4::new(1.0 / size, 1.0 / size, 1.0 / size, 1.0));
    for axis in 0..3 {
        let sigma = |p: &Position| p.weighted[axis].sqrt().max(NOISELESS * size);
        let design = Mat::from_fn(positions.len(), 4, |i, j| {
            let p = &positions[i];
            (if j < 3 { p.input[j] / size } else { 1.0 }) / sigma(p)
        });
        let outputs = Mat::from_fn(positions.len(), 1, |i, _| {
            positions[i].output[axis] / sigma(&positions[i])
        });
        let information = Matrix4::from_fn(|i, j| {
            (0..positions.len())
                .map(|k| design[(k, i)] * design[(k, j)])
                .sum()
        });
        // Positions in a plane leave an eigenvalue of nothing but rounding and table error, whatever the
        // weights.
        let diagonal = information.diagonal();
        if diagonal.min() <= 0.0 {
            return None;
        }
        let weight = Matrix4::from_diagonal(&diagonal.map(|v: f64| v.sqrt().recip()));
        let correlations = weight * information * weight;
        if correlations.symmetric_eigenvalues().min() < SMALLEST_EIGENVALUE {
            return None;
        }
        let solution = design.qr().solve_lstsq(&outputs);
        for column in 0..3 {
            a[(axis, column)] = solution[(column, 0)] / size;
        }
        bias[axis] = solution[(3, 0)];
        // By weights that need not be the inverse variances.
        let inverse = unscale * information.try_inverse()?;
        for (k, position) in positions.iter().enumerate() {
            let of_output = inverse * Vector4::from_fn(|j, _| design[(k, j)]) / sigma(position);
            let variance = position.variance[axis].max((NOISELESS * size).powi(2));
            covariance[axis] += of_output * variance * of_output.transpose();
        }
    }
    let triad = Triad::from_sensitivity(form, &a, bias);
    triad.correction()?;
    Some((triad, split_covariance(form, &a, &bias, &covariance)))
}

/// The covariance of `A` and `D` carried through the form's split.
fn split_covariance(
    form: InstallationForm,
    a: &Matrix3<f64>,
    bias: &Vector3<f64>,
    covariance: &[Matrix4<f64>; 3],
) -> SMatrix<f64, PER_TRIAD, PER_TRIAD> {
    /// The split is smooth at unit scale; central differences leave 1e-10 of relative error.
    const STEP: f64 = 1e-5;
    let mut result = SMatrix::zeros();
    for (axis, of_row) in covariance.iter().enumerate() {
        let jacobian = SMatrix::<f64, PER_TRIAD, 4>::from_columns(&[0, 1, 2, 3].map(|k| {
            let shifted = |by: f64| -> TriadVector {
                let (mut a, mut bias) = (*a, *bias);
                if k < 3 {
                    a[(axis, k)] += by;
                } else {
                    bias[axis] += by;
                }
                Triad::from_sensitivity(form, &a, bias).to_vector()
            };
            (shifted(STEP) - shifted(-STEP)) / (2.0 * STEP)
        }));
        result += jacobian * of_row * jacobian.transpose();
    }
    result
}

/// How much of a small turn about any axis each component of an input sees, squared: the magnitude of the
/// other two components.
pub(super) fn across(input: &Vector3<f64>) -> Vector3<f64> {
    input.map(|component| input.norm_squared() - component.powi(2))
}

#[cfg(test)]
mod tests;
