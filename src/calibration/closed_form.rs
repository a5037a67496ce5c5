//! The closed form: static positions with known attitude (Zhao, Jiang, Li 2016, Eqs. 14 and 15; the
//! second line of the printed Eq. 15 says `N_g` where the accelerometer is meant).

use faer::Mat;
use faer::linalg::solvers::SolveLstsq;
use nalgebra::{Matrix3, Matrix4, SMatrix, Vector3};

use super::error::CalibrationError;
use super::outcome::Estimate;
use super::states::{ParameterMatrix, parameter};
use crate::imu::{
    InstallationForm, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad, TriadVector,
};
use crate::run::{Dwell, MeanOutput, Run};

/// The mean output of a triad at one position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Input along body axes that the table's attitude gives, rad/s or m/s².
    pub input: Vector3<f64>,
    /// Mean normalised output, rad/s or m/s².
    pub output: Vector3<f64>,
    /// Variance of each output axis, (rad/s)² or (m/s²)².
    pub variance: Vector3<f64>,
}

/// A closed-form calibration of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedForm {
    /// The estimate; its σ follow from random walk, pulses and the table's position error.
    pub estimate: Estimate,
    /// Dwells used for each triad.
    pub positions: PerSensor<usize>,
    /// Total time of all dwells used, s.
    pub standing_time: f64,
}

/// A reference vector within this cosine of a body axis makes a position of the six.
const ALONG_AXIS: f64 = 0.9998;

/// Relative σ of an output for which no noise is stated.
const NOISELESS: f64 = 1e-9;

/// Calibrates both triads from the dwells of a run.
///
/// Where the dwells hold the paper's six positions of a triad (Earth rate or gravity along each body
/// axis, both ways) those are used, else all dwells. Least squares over them is the paper's half
/// sums and half differences where positions are exactly opposite.
///
/// # Errors
/// [`CalibrationError`] without a table, or if the positions do not determine the twelve numbers of
/// a triad.
pub fn six_position(run: &Run, form: InstallationForm) -> Result<ClosedForm, CalibrationError> {
    six_position_of(run, &run.dwells(), form)
}

/// The same from some dwells, or parts of them.
///
/// # Errors
/// As [`six_position`].
pub fn six_position_of(
    run: &Run,
    dwells: &[Dwell],
    form: InstallationForm,
) -> Result<ClosedForm, CalibrationError> {
    let mut covariance = ParameterMatrix::zeros();
    let mut positions = PerSensor::default();
    let mut used = vec![false; dwells.len()];
    let mut triads = PerSensor::from_fn(|_| Triad::ideal(form));
    for sensor in Sensor::ALL {
        let all: Vec<Position> = dwells
            .iter()
            .map(|dwell| position(run, dwell, sensor))
            .collect::<Option<_>>()
            .ok_or(CalibrationError::NoTable)?;
        let chosen = six_of(&all);
        let chosen_positions: Vec<Position> = chosen.iter().map(|&k| all[k]).collect();
        let (triad, of_triad) =
            six_position_triad(&chosen_positions, form).ok_or(CalibrationError::Degenerate {
                sensor,
                dwells: chosen.len(),
            })?;
        chosen.iter().for_each(|&k| used[k] = true);
        *triads.get_mut(sensor) = triad;
        *positions.get_mut(sensor) = chosen.len();
        let first = parameter(sensor, 0);
        covariance
            .fixed_view_mut::<PER_TRIAD, PER_TRIAD>(first, first)
            .copy_from(&of_triad);
    }
    let standing_time = dwells
        .iter()
        .zip(used)
        .filter(|(_, used)| *used)
        .map(|(dwell, _)| dwell.samples.len() as f64 * run.imu.period)
        .sum();
    Ok(ClosedForm {
        estimate: Estimate { triads, covariance },
        positions,
        standing_time,
    })
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
    for axis in 0..3 {
        let sigma = |p: &Position| p.variance[axis].sqrt().max(NOISELESS * size);
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
        // Positions in a plane leave an eigenvalue of nothing but rounding and table error.
        let eigenvalues = information.symmetric_eigenvalues();
        if eigenvalues.min() < 1e-4 * eigenvalues.max() {
            return None;
        }
        let solution = design.qr().solve_lstsq(&outputs);
        for column in 0..3 {
            a[(axis, column)] = solution[(column, 0)] / size;
        }
        bias[axis] = solution[(3, 0)];
        let unscale = Matrix4::from_diagonal(&nalgebra::Vector4::new(
            1.0 / size,
            1.0 / size,
            1.0 / size,
            1.0,
        ));
        covariance[axis] = unscale * information.try_inverse()? * unscale;
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

/// Mean output and known input over one dwell; `None` without a table.
fn position(run: &Run, dwell: &Dwell, sensor: Sensor) -> Option<Position> {
    let table = run.table.as_ref()?;
    let position = dwell.position.as_ref()?;
    let known = match sensor {
        Sensor::Gyro => run.site.earth_rate_n(),
        Sensor::Accel => -run.site.gravity_n(),
    };
    let MeanOutput {
        output,
        variance: noise,
    } = dwell.mean(sensor, run);
    let input = position.attitude.tr_mul(&known);
    let attitude =
        table.position_sigma.powi(2) + table.reading_sigma.powi(2) / position.readings.len() as f64;
    Some(Position {
        input,
        output,
        // A wrong attitude turns the other two components of the input into this one.
        variance: Vector3::from_fn(|i, _| {
            noise + attitude * (input.norm_squared() - input[i].powi(2))
        }),
    })
}

/// The positions whose input lies along a body axis, if all six are there, else all.
fn six_of(positions: &[Position]) -> Vec<usize> {
    let along = |k: usize| -> Option<(usize, bool)> {
        let input = positions[k].input;
        let axis = input.iamax();
        (input[axis].abs() > ALONG_AXIS * input.norm()).then_some((axis, input[axis] > 0.0))
    };
    let six: Vec<usize> = (0..positions.len())
        .filter(|&k| along(k).is_some())
        .collect();
    let complete = (0..3).all(|axis| {
        [true, false]
            .iter()
            .all(|&up| six.iter().any(|&k| along(k) == Some((axis, up))))
    });
    if complete {
        six
    } else {
        (0..positions.len()).collect()
    }
}

#[cfg(test)]
mod tests;
