//! Weighted linear equations for the parameters.

use faer::Mat;
use faer::linalg::solvers::SolveLstsq;
use nalgebra::{DMatrix, Vector3};

use super::super::error::CalibrationError;
use super::super::linearisation::singular;
use super::super::model::Model;
use super::super::parameters::{
    ParameterMatrix, ParameterVector, from_vector, parameter, to_vector,
};
use crate::imu::{PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad, TriadVector};
use crate::navigation::Block;

/// An instrument without noise is still not better than this, rad or m/s: an equation needs a σ.
const ROUNDING: f64 = 1e-9;

/// Steps of Gauss–Newton at most; scale factors wrong by percents need three.
const STEPS: usize = 6;
/// A step below this (1 ppm, 0.2″, and as much of rad/s or m/s²) is no step.
const SMALL: f64 = 1e-6;

/// Linear equations for the step δθ of the estimated parameters, each row divided by its σ.
pub(in crate::calibration) struct Equations {
    /// Indices of the parameters to be estimated.
    unknown: Vec<usize>,
    rows: Vec<(ParameterVector, f64)>,
}

impl Equations {
    /// The prior's equations, for these triads.
    pub(in crate::calibration) fn new(
        model: &Model,
        at: &PerSensor<Triad>,
        sensors: &[Sensor],
    ) -> Self {
        let at = to_vector(at);
        let mut equations = Self {
            unknown: Vec::new(),
            rows: Vec::new(),
        };
        for &sensor in sensors {
            for of_triad in 0..PER_TRIAD {
                let index = parameter(sensor, of_triad);
                let sigma = model.prior_sigma[index];
                if sigma > 0.0 {
                    let mut row = ParameterVector::zeros();
                    row[index] = 1.0 / sigma;
                    equations.unknown.push(index);
                    equations
                        .rows
                        .push((row, (model.prior_mean[index] - at[index]) / sigma));
                }
            }
        }
        equations
    }

    /// An equation `error = Σ row δθ` of triads' parameters, its error of this variance.
    pub(in crate::calibration) fn add(
        &mut self,
        rows: &[(Sensor, TriadVector)],
        error: f64,
        variance: f64,
    ) {
        let mut whole = ParameterVector::zeros();
        for (sensor, row) in rows {
            whole
                .fixed_rows_mut::<PER_TRIAD>(parameter(*sensor, 0))
                .copy_from(row);
        }
        self.add_row(whole, error, variance);
    }

    /// Three equations `error = Φ δθ` with rows of a block from `first` on.
    pub(in crate::calibration) fn add_block(
        &mut self,
        block: &Block,
        first: usize,
        error: Vector3<f64>,
        variance: f64,
    ) {
        for axis in 0..3 {
            let mut row = ParameterVector::zeros();
            for sensor in Sensor::ALL {
                row.fixed_rows_mut::<PER_TRIAD>(parameter(sensor, 0))
                    .copy_from(&block.parameters.get(sensor).row(first + axis).transpose());
            }
            self.add_row(row, error[axis], variance);
        }
    }

    fn add_row(&mut self, row: ParameterVector, error: f64, variance: f64) {
        let weight = 1.0 / (variance + ROUNDING.powi(2)).sqrt();
        self.rows.push((row * weight, error * weight));
    }

    /// Covariance of the unknown parameters; zero for all others. `None` if they are not determined.
    pub(in crate::calibration) fn covariance(&self) -> Option<ParameterMatrix> {
        let n = self.unknown.len();
        let information = DMatrix::from_fn(n, n, |i, j| {
            let (i, j) = (self.unknown[i], self.unknown[j]);
            self.rows.iter().map(|(row, _)| row[i] * row[j]).sum()
        });
        let inverse = information.cholesky()?.inverse();
        let mut covariance = ParameterMatrix::zeros();
        for (i, &row) in self.unknown.iter().enumerate() {
            for (j, &column) in self.unknown.iter().enumerate() {
                covariance[(row, column)] = inverse[(i, j)];
            }
        }
        Some(covariance)
    }

    /// Mean square of the errors, each over its σ and the prior's included; one if nothing but noise is
    /// left.
    pub(in crate::calibration) fn misfit(&self) -> f64 {
        let sum: f64 = self.rows.iter().map(|(_, error)| error.powi(2)).sum();
        sum / (self.rows.len() - self.unknown.len()) as f64
    }

    /// The step δθ of least squares.
    pub(in crate::calibration) fn solve(&self) -> ParameterVector {
        let a = Mat::from_fn(self.rows.len(), self.unknown.len(), |i, j| {
            self.rows[i].0[self.unknown[j]]
        });
        let b = Mat::from_fn(self.rows.len(), 1, |i, _| self.rows[i].1);
        let solution = a.qr().solve_lstsq(&b);
        let mut step = ParameterVector::zeros();
        for (j, &index) in self.unknown.iter().enumerate() {
            step[index] = solution[(j, 0)];
        }
        step
    }
}

/// Steps from a first point on, each by equations made there, until they are small.
pub(in crate::calibration) fn gauss_newton(
    from: PerSensor<Triad>,
    equations: impl Fn(&PerSensor<Triad>) -> Result<Equations, CalibrationError>,
) -> Result<PerSensor<Triad>, CalibrationError> {
    let mut triads = from;
    for _ in 0..STEPS {
        let step = equations(&triads)?.solve();
        if !step.iter().all(|v| v.is_finite()) {
            return Err(singular(&from));
        }
        triads = from_vector(triads.gyro.form, &(to_vector(&triads) + step));
        if step.amax() < SMALL {
            break;
        }
    }
    Ok(triads)
}
