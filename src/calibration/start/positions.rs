//! Estimation of one triad from its mean outputs for known inputs, by generalised least squares.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Matrix4x3, SMatrix, Vector3};

use super::equations::{
    Common, Equations, Event, OfTriad, Rows, gauss_newton, of, of_parameters, of_sensitivity,
};
use super::least_squares::Solution;
use crate::calibration::checks::residuals::Residuals;
use crate::calibration::parameters::derivatives;
use crate::calibration::{
    CalibrationError, Model, ParameterVector, from_vector, parameter, to_vector,
};
use crate::imu::{
    InstallationForm, Noise, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad, TriadVector,
};

/// Minimum eigenvalue of the correlations of the unknowns of a row.
const SMALLEST_EIGENVALUE: f64 = 1e-4;
/// A smaller step, in units of prior σ, ends the iteration.
const SMALL: f64 = 1e-6;
/// σ of an output without stated noise, divided by the largest input.
const NOISELESS: f64 = 1e-9;

/// The mean output of a triad for a known input, at a position or over a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Mean input along body axes, rad/s or m/s².
    pub input: Vector3<f64>,
    /// Mean normalised output, rad/s or m/s².
    pub output: Vector3<f64>,
    /// Variance of each output axis, (rad/s)² or (m/s²)².
    pub variance: Vector3<f64>,
    /// Variance from which the weight of the position is computed: `variance`, or a larger value if this one would give
    /// too much weight.
    pub weighted: Vector3<f64>,
}

/// A position, and the error sources it has in common with other positions.
#[derive(Debug, Clone)]
pub struct Known {
    pub position: Position,
    /// Start and end, s.
    pub times: [f64; 2],
    /// Response of the input to errors with unit covariance.
    pub errors: Vec<(Common, Matrix3<f64>)>,
}

/// Positions of a triad.
#[derive(Debug, Clone)]
pub struct Observed {
    pub sensor: Sensor,
    pub noise: Noise,
    pub known: Vec<Known>,
}

/// One triad estimated from its positions.
#[derive(Clone)]
pub struct Fit {
    pub triad: Triad,
    pub covariance: SMatrix<f64, PER_TRIAD, PER_TRIAD>,
    /// Response to each error of the table, by number.
    pub by_table: BTreeMap<usize, SMatrix<f64, PER_TRIAD, 3>>,
    pub residuals: Residuals,
}

impl Observed {
    /// Largest input.
    fn size(&self) -> f64 {
        let inputs = self.known.iter().map(|known| known.position.input.norm());
        inputs.fold(0.0, f64::max)
    }

    /// Adds the equations of the outputs, linearised about a sensitivity and a bias.
    fn add(
        &self,
        mut equations: Equations,
        (a, bias): (Matrix3<f64>, Vector3<f64>),
        partials: impl Fn(&Vector3<f64>) -> OfTriad<3>,
    ) -> Equations {
        let least = (NOISELESS * self.size()).powi(2);
        let drift = Noise {
            random_walk: 0.0,
            ..self.noise
        };
        for (
            event,
            Known {
                position,
                times,
                errors,
            },
        ) in self.known.iter().enumerate()
        {
            let drifted = drift.covariance_of_means(*times, *times);
            equations.events.push(Event {
                recording: 0,
                times: *times,
                variance: PerSensor::from_fn(|_| drifted),
                noise: PerSensor::from_fn(|_| drift),
            });
            let of_noise = (Common::Noise(self.sensor, event), Matrix3::identity());
            let of_input = errors.iter().map(|&(of, by)| (of, a * by));
            equations.add(&Rows {
                event,
                weighted: position.weighted.map(|v| v.max(least)),
                own: position.variance.map(|v| (v - drifted).max(least)),
                common: std::iter::once(of_noise).chain(of_input).collect(),
                ..Rows::new(
                    of(self.sensor, &partials(&position.input)),
                    position.output - a * position.input - bias,
                    0.0,
                )
            });
        }
        let mut positions = self.known.iter().map(|known| &known.position);
        equations.correlated = positions.all(|p| p.weighted == p.variance);
        equations
    }

    /// Equations of `A` and `D` without a prior.
    fn of_sensitivity(&self, at: (Matrix3<f64>, Vector3<f64>)) -> Equations {
        let mut sigma = ParameterVector::zeros();
        let mut of_triad = sigma.fixed_rows_mut::<PER_TRIAD>(parameter(self.sensor, 0));
        of_triad.fill(f64::INFINITY);
        let equations = Equations::new(&ParameterVector::zeros(), &sigma);
        let partials = |input: &Vector3<f64>| of_sensitivity(input.push(1.0));
        self.add(equations, at, partials)
    }

    /// Solution for the parameters of a triad, about these values, with their prior.
    fn with_prior(
        &self,
        model: &Model,
        triads: &PerSensor<Triad>,
    ) -> Result<Solution, CalibrationError> {
        let triad = triads.get(self.sensor);
        let equations = Equations::of_triads(model, triads, &[self.sensor]);
        let at = (triad.sensitivity(), triad.bias);
        let sensor = self.sensor;
        self.add(equations, at, |input| of_parameters(triad, input))
            .solved()
            .ok_or(CalibrationError::Singular { sensor })
    }

    /// Estimates one triad from positions; if the positions do not determine every parameter to better than its prior
    /// σ, also uses the prior.
    pub fn fitted(&self, model: &Model) -> Result<Fit, CalibrationError> {
        let first = parameter(self.sensor, 0);
        let sigma = model.prior_sigma.fixed_rows::<PER_TRIAD>(first);
        let better = |fit: &Fit| {
            let as_stated = fit.covariance.diagonal().map(f64::sqrt) / fit.residuals.growth();
            (0..PER_TRIAD).all(|k| sigma[k] == 0.0 || as_stated[k] < sigma[k])
        };
        if let Some(fit) = self.determined(model.form).filter(better) {
            return Ok(fit);
        }
        let prior = from_vector(model.form, &model.prior_mean);
        let smallest = model.prior_sigma * SMALL;
        let step = |triads: &PerSensor<Triad>| Ok(self.with_prior(model, triads)?.step);
        let triads = gauss_newton(prior, &smallest, step)?;
        let solution = self.with_prior(model, &triads)?;
        let triads = from_vector(model.form, &(to_vector(&triads) + solution.step));
        let identity = SMatrix::identity();
        Ok(self.fit(*triads.get(self.sensor), solution, &identity))
    }

    /// Estimates one triad from positions alone, by least squares for `A = K C` and `D` row by row; the misalignment
    /// form then splits A. Returns `None` if there are fewer than four positions, or if the positions leave a row
    /// undetermined.
    pub fn determined(&self, form: InstallationForm) -> Option<Fit> {
        let mut rows = TriadVector::from_column_slice(Matrix4x3::identity().as_slice());
        let mut equations = self.of_sensitivity(sensitivity_and_bias(&rows));
        if self.known.len() < 4 || self.size() <= 0.0 || in_a_plane(&equations) {
            return None;
        }
        // The errors of the inputs reach the outputs through the triad itself.
        let first = parameter(self.sensor, 0);
        rows += equations.solved()?.step.fixed_rows::<PER_TRIAD>(first);
        equations = self.of_sensitivity(sensitivity_and_bias(&rows));
        let solution = equations.solved()?;
        rows += solution.step.fixed_rows::<PER_TRIAD>(first);
        let split = |rows: &TriadVector| {
            let (a, bias) = sensitivity_and_bias(rows);
            Triad::from_sensitivity(form, &a, bias)
        };
        let triad = split(&rows);
        triad.correction()?;
        let by_rows = derivatives(&rows, |rows| split(rows).to_vector());
        Some(self.fit(triad, solution, &by_rows))
    }

    /// A triad from a solution, given the derivatives of its parameters with respect to those of the solution.
    fn fit(
        &self,
        triad: Triad,
        solution: Solution,
        by_solved: &SMatrix<f64, PER_TRIAD, PER_TRIAD>,
    ) -> Fit {
        let first = parameter(self.sensor, 0);
        let covariance = solution
            .covariance
            .fixed_view::<PER_TRIAD, PER_TRIAD>(first, first);
        let by_table = solution.by_table.into_iter();
        let by_table = by_table.map(|(number, by)| {
            let of_triad = by.fixed_rows::<PER_TRIAD>(first);
            (number, by_solved * of_triad)
        });
        Fit {
            triad,
            covariance: by_solved * covariance * by_solved.transpose(),
            by_table: by_table.collect(),
            residuals: solution.residuals,
        }
    }
}

/// `A` and `D` from their entries row by row.
fn sensitivity_and_bias(rows: &TriadVector) -> (Matrix3<f64>, Vector3<f64>) {
    let rows = Matrix4x3::from_column_slice(rows.as_slice()).transpose();
    (
        rows.fixed_columns::<3>(0).into_owned(),
        rows.column(3).into_owned(),
    )
}

/// Whether positions leave a row undetermined: positions in a plane leave an eigenvalue due only to rounding and table
/// error, for any weights.
fn in_a_plane(equations: &Equations) -> bool {
    let (mut design, _) = equations.scaled();
    let norms: Vec<f64> = design
        .column_iter_mut()
        .map(|mut column| column.normalize_mut())
        .collect();
    let correlations = design.tr_mul(&design);
    norms.contains(&0.0) || correlations.symmetric_eigenvalues().min() < SMALLEST_EIGENVALUE
}

/// Estimates one triad from positions without common errors, by least squares for `A = K C` and `D` row by row; the
/// misalignment form then splits A. Returns the triad and the covariance of its parameters; Returns `None` if there are
/// fewer than four positions, or if the positions leave a row undetermined.
pub fn six_position_triad(
    positions: &[Position],
    form: InstallationForm,
) -> Option<(Triad, SMatrix<f64, PER_TRIAD, PER_TRIAD>)> {
    let known = positions.iter().enumerate().map(|(k, &position)| Known {
        position,
        times: [k as f64, k as f64 + 1.0],
        errors: Vec::new(),
    });
    let observed = Observed {
        // Either triad would do.
        sensor: Sensor::Gyro,
        noise: Noise::default(),
        known: known.collect(),
    };
    let fit = observed.determined(form)?;
    Some((fit.triad, fit.covariance))
}

#[cfg(test)]
mod tests;
