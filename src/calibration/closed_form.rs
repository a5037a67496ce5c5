//! The closed form: static positions with known attitude (Zhao, Jiang, Li 2016, Eqs. 14 and 15; the
//! second line of the printed Eq. 15 says `N_g` where the accelerometer is meant), and what takes its
//! place without a table.

mod gravity;
mod labels;

use faer::Mat;
use faer::linalg::solvers::SolveLstsq;
use nalgebra::{Matrix3, Matrix4, SMatrix, Vector3, Vector4};

use super::error::CalibrationError;
use super::estimate::Estimate;
use super::finding::Finding;
use super::model::Model;
use super::parameters::{OBSERVED_BELOW, ParameterMatrix, parameter, parameter_name};
use super::problem::Problem;
use crate::imu::{
    InstallationForm, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad, TriadVector,
};
use crate::imu::BodyFrame;
use crate::run::{Aiding, Dwell, MeanOutput, Run};

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

/// Where the inputs of a closed form are known from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reference {
    /// Attitudes of the table's log.
    Table,
    /// Labels of sections: an axis up, a turn about an axis by an angle.
    Labels,
    /// Gravity alone: its size at rest, its direction before and after each turn.
    Gravity,
}

impl Reference {
    /// What fixes the body axes.
    pub fn body_frame(self) -> BodyFrame {
        match self {
            Self::Table | Self::Labels => BodyFrame::Table,
            Self::Gravity => BodyFrame::Accelerometer,
        }
    }
}

/// A closed-form calibration of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedForm {
    /// The estimate; its σ follow from random walk, pulses and how well the inputs are known.
    pub estimate: Estimate,
    /// Where the inputs are known from.
    pub reference: Reference,
    /// Dwells or labelled positions used for each triad.
    pub positions: PerSensor<usize>,
    /// Turns used for the gyros.
    pub turns: usize,
    /// Total time of all dwells used, s.
    pub standing_time: f64,
    /// What a calibration engineer must know before using the figures.
    pub findings: Vec<Finding>,
}

/// A reference vector within this cosine of a body axis makes a position of the six.
const ALONG_AXIS: f64 = 0.9998;

/// Least eigenvalue of the correlations of a row's unknowns.
const SMALLEST_EIGENVALUE: f64 = 1e-4;

/// Relative σ of an output for which no noise is stated.
const NOISELESS: f64 = 1e-9;

/// Calibrates both triads of a run without a filter.
///
/// With a table's log, from its dwells: where they hold the paper's six positions of a triad (Earth
/// rate or gravity along each body axis, both ways) from those, else from all. Without, from labelled
/// sections; without those, from every dwell and turn by gravity alone. Least squares over six
/// positions is the paper's half sums and half differences where they are exactly opposite.
///
/// # Errors
/// [`CalibrationError`] if the positions do not determine the twelve numbers of a triad.
pub fn six_position(problem: &Problem) -> Result<ClosedForm, CalibrationError> {
    let sections = &problem.run().recording.segments;
    let reference = if problem.model.aiding == Aiding::Table {
        Reference::Table
    } else if sections.iter().any(|s| s.motion.is_some()) {
        Reference::Labels
    } else {
        Reference::Gravity
    };
    six_position_by(reference, problem)
}

/// The same by what the inputs are to be known from; labels need no dwells.
pub(super) fn six_position_by(
    reference: Reference,
    problem: &Problem,
) -> Result<ClosedForm, CalibrationError> {
    match reference {
        Reference::Table => {
            let dwells: Vec<Dwell> = problem.dwells().cloned().collect();
            six_position_of(problem, &dwells)
        }
        Reference::Labels => labels::by_labels(problem),
        Reference::Gravity => gravity::by_gravity(problem),
    }
}

/// The same from some dwells of the problem's first run with attitudes of a table, or parts of them.
///
/// # Errors
/// As [`six_position`], and without a table.
pub fn six_position_of(
    problem: &Problem,
    dwells: &[Dwell],
) -> Result<ClosedForm, CalibrationError> {
    let (run, model) = (problem.run(), &problem.model);
    let mut chosen = PerSensor::<Vec<Position>>::default();
    let mut used = vec![false; dwells.len()];
    for sensor in Sensor::ALL {
        let all: Vec<Position> = dwells
            .iter()
            .map(|dwell| position(run, model, dwell, sensor))
            .collect::<Option<_>>()
            .ok_or(CalibrationError::NoTable)?;
        let of_six = six_of(&all);
        of_six.iter().for_each(|&k| used[k] = true);
        *chosen.get_mut(sensor) = of_six.iter().map(|&k| all[k]).collect();
    }
    let degenerate = |sensor| CalibrationError::Degenerate {
        sensor,
        dwells: chosen.get(sensor).len(),
    };
    let estimate = both_triads(&chosen, model.form).map_err(degenerate)?;
    let standing_time = dwells
        .iter()
        .zip(used)
        .filter(|(_, used)| *used)
        .map(|(dwell, _)| dwell.samples.len() as f64 * run.recording.imu.period)
        .sum();
    Ok(ClosedForm {
        findings: remarks(model, &estimate, Reference::Table),
        estimate,
        reference: Reference::Table,
        positions: PerSensor::from_fn(|sensor| chosen.get(sensor).len()),
        turns: 0,
        standing_time,
    })
}

/// Both triads from positions; the triad that they do not determine if they fail.
fn both_triads(
    positions: &PerSensor<Vec<Position>>,
    form: InstallationForm,
) -> Result<Estimate, Sensor> {
    let mut covariance = ParameterMatrix::zeros();
    let mut triads = PerSensor::from_fn(|_| Triad::ideal(form));
    for sensor in Sensor::ALL {
        let (triad, of_triad) = six_position_triad(positions.get(sensor), form).ok_or(sensor)?;
        *triads.get_mut(sensor) = triad;
        let first = parameter(sensor, 0);
        covariance
            .fixed_view_mut::<PER_TRIAD, PER_TRIAD>(first, first)
            .copy_from(&of_triad);
    }
    Ok(Estimate { triads, covariance })
}

/// Parameters further from their prior than this many of its σ contradict it.
const CONTRADICTS: f64 = 5.0;

/// Parameters that are hardly better known than before, and those that the prior does not allow, if
/// there are any.
fn remarks(model: &Model, estimate: &Estimate, reference: Reference) -> Vec<Finding> {
    let sigma = estimate.sigma();
    let off = estimate.vector() - model.prior_mean;
    let far = |&i: &usize| {
        let prior = model.prior_sigma[i];
        prior > 0.0 && off[i].abs() > CONTRADICTS * prior.hypot(sigma[i])
    };
    let hidden = |&i: &usize| {
        let prior = model.prior_sigma[i];
        prior > 0.0 && sigma[i] > OBSERVED_BELOW * prior
    };
    let named = |which: &dyn Fn(&usize) -> bool| -> Vec<String> {
        let those = estimate.estimated().filter(which);
        let names = those.filter_map(|index| parameter_name(estimate.form(), index));
        names.collect()
    };
    let (far, hidden) = (named(&far), named(&hidden));
    let far = (!far.is_empty()).then_some(Finding::FarFromPrior {
        sigmas: CONTRADICTS,
        parameters: far,
    });
    let hidden = (!hidden.is_empty()).then_some(Finding::NotObserved {
        by: match reference {
            Reference::Table => "these positions",
            Reference::Labels => "these sections",
            Reference::Gravity => "these dwells and moves",
        },
        parameters: hidden,
    });
    far.into_iter().chain(hidden).collect()
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
    // A size for the inputs, so that columns are of one size.
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

/// Mean output and known input over one dwell; `None` without a table.
fn position(run: &Run, model: &Model, dwell: &Dwell, sensor: Sensor) -> Option<Position> {
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
        model.position_sigma.powi(2) + model.reading_sigma.powi(2) / position.readings.len() as f64;
    // A wrong attitude turns the other two components of the input into a third.
    let variance = Vector3::repeat(noise) + across(&input) * attitude;
    Some(Position {
        input,
        output,
        variance,
        weighted: variance,
    })
}

/// How much of a small turn about any axis each component of an input sees, squared: the size of the
/// other two components.
fn across(input: &Vector3<f64>) -> Vector3<f64> {
    input.map(|component| input.norm_squared() - component.powi(2))
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
