//! One triad from its mean outputs under known inputs, by generalised least squares.

use nalgebra::{DMatrix, Matrix3, Matrix4x3, SMatrix, Vector3};

use super::equations::{
    Common, Equations, Event, Gain, OfTriad, Rows, gauss_newton, of, of_parameters, of_sensitivity,
};
use crate::calibration::checks::residuals::Residuals;
use crate::calibration::parameters::derivatives;
use crate::calibration::{CalibrationError, Model, ParameterVector, from_vector, parameter};
use crate::imu::{
    InstallationForm, Noise, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad, TriadVector,
};

/// Minimum eigenvalue of the correlations of the unknowns of a row.
const SMALLEST_EIGENVALUE: f64 = 1e-4;
/// A smaller step, in units of prior σ, ends the iteration.
const SMALL: f64 = 1e-6;
/// σ of an output without stated noise, divided by the largest input.
const NOISELESS: f64 = 1e-9;
/// Number of the error of a table's base: of 1 rad about East, North and Up.
pub const BASE: usize = 0;

/// The mean output of a triad under a known input, at a position or over a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Mean input along body axes, rad/s or m/s².
    pub input: Vector3<f64>,
    /// Mean normalised output, rad/s or m/s².
    pub output: Vector3<f64>,
    /// Variance of each output axis, (rad/s)² or (m/s²)².
    pub variance: Vector3<f64>,
    /// Variance for its weight: the variance itself, unless that would give it too much weight.
    pub weighted: Vector3<f64>,
}

/// A position, and the errors that its input shares with others.
#[derive(Debug, Clone)]
pub struct Known {
    pub position: Position,
    /// Begin and end, s.
    pub times: [f64; 2],
    /// Response of the input to unit-covariance errors, by number, and to that of the [`BASE`].
    pub errors: Vec<(usize, Matrix3<f64>)>,
}

/// Positions of a triad.
#[derive(Debug, Clone)]
pub struct Observed {
    pub sensor: Sensor,
    pub noise: Noise,
    /// 1σ of the table's base, rad; `None` without a table.
    pub base_sigma: Option<Vector3<f64>>,
    pub known: Vec<Known>,
}

/// One triad estimated from its positions.
#[derive(Clone)]
pub struct Fit {
    pub triad: Triad,
    pub covariance: SMatrix<f64, PER_TRIAD, PER_TRIAD>,
    /// Response to the common errors of its inputs, three columns each.
    pub by_errors: DMatrix<f64>,
}

impl Observed {
    /// The same with additional variance on every axis of these positions, as from an independent bias at each.
    pub fn widened(&self, variance: f64, places: &[usize]) -> Self {
        let mut wider = self.clone();
        for &place in places {
            let position = &mut wider.known[place].position;
            position.variance.add_scalar_mut(variance);
            position.weighted.add_scalar_mut(variance);
        }
        wider
    }

    /// The same with a table base known to this σ, rad.
    pub fn on_base(&self, sigma: f64) -> Self {
        Self {
            base_sigma: self.base_sigma.map(|_| Vector3::repeat(sigma)),
            ..self.clone()
        }
    }

    /// Largest input.
    fn size(&self) -> f64 {
        let inputs = self.known.iter().map(|known| known.position.input.norm());
        inputs.fold(0.0, f64::max)
    }

    /// Adds the equations of the outputs about a sensitivity and a bias.
    fn add(
        &self,
        mut equations: Equations,
        (a, bias): (Matrix3<f64>, Vector3<f64>),
        partials: impl Fn(&Vector3<f64>) -> OfTriad<3>,
    ) -> Equations {
        let least = (NOISELESS * self.size()).powi(2);
        let base_sigma = self.base_sigma.unwrap_or_default();
        for (
            event,
            Known {
                position,
                times,
                errors,
            },
        ) in self.known.iter().enumerate()
        {
            equations.events.push(Event {
                recording: 0,
                times: *times,
                variance: PerSensor::default(),
                noise: PerSensor::from_fn(|_| self.noise),
            });
            let mut common = vec![(Common::Noise(self.sensor, event), Matrix3::identity())];
            for &(number, of_input) in errors {
                let sigma = match number {
                    BASE => base_sigma,
                    _ => Vector3::repeat(1.0),
                };
                let of_output = a * of_input * Matrix3::from_diagonal(&sigma);
                common.push((Common::Unit(number), of_output));
            }
            equations.add(&Rows {
                event,
                weighted: position.weighted.map(|v| v.max(least)),
                own: position.variance.map(|v| v.max(least)),
                common,
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

    /// Equations of the parameters of a triad and their prior.
    fn of_parameters(&self, model: &Model, triads: &PerSensor<Triad>) -> Equations {
        let triad = triads.get(self.sensor);
        let equations = Equations::of_triads(model, triads, &[self.sensor]);
        let at = (triad.sensitivity(), triad.bias);
        self.add(equations, at, |input| of_parameters(triad, input))
    }

    /// Equations of `A` and `D` about a triad.
    pub fn about(&self, triad: &Triad) -> Equations {
        self.of_sensitivity((triad.sensitivity(), triad.bias))
    }

    /// Residuals of positions after the best-fit triad, with the input errors propagated through this one.
    pub fn residuals(&self, triad: &Triad) -> Option<Residuals> {
        let equations = self.about(triad);
        let (design, residual) = equations.scaled();
        Residuals::new(&design, &residual, &equations.errors())
    }

    /// One triad from positions, with the prior if the positions do not determine every parameter better.
    pub fn fitted(&self, model: &Model) -> Result<Fit, CalibrationError> {
        let first = parameter(self.sensor, 0);
        let sigma = model.prior_sigma.fixed_rows::<PER_TRIAD>(first);
        let better = |fit: &Fit| {
            (0..PER_TRIAD).all(|k| sigma[k] == 0.0 || fit.covariance[(k, k)].sqrt() < sigma[k])
        };
        if let Some(fit) = self.determined(model.form).filter(better) {
            return Ok(fit);
        }
        let prior = from_vector(model.form, &model.prior_mean);
        let smallest = model.prior_sigma * SMALL;
        let equations = |triads: &PerSensor<Triad>| Ok(self.of_parameters(model, triads));
        let triads = gauss_newton(prior, &smallest, equations)?;
        let equations = self.of_parameters(model, &triads);
        let sensor = self.sensor;
        let gain = equations
            .gain()
            .ok_or(CalibrationError::Singular { sensor })?;
        let unknown: Vec<usize> = equations
            .unknown
            .iter()
            .map(|index| index - first)
            .collect();
        let by_unknowns = DMatrix::identity(PER_TRIAD, PER_TRIAD).select_columns(&unknown);
        Ok(self.fit(*triads.get(sensor), &equations, &gain, &by_unknowns))
    }

    /// One triad from positions alone: least squares for `A = K C` and `D` row by row, then the split of the form.
    /// `None` if fewer than four positions, or positions that leave a row undetermined.
    pub fn determined(&self, form: InstallationForm) -> Option<Fit> {
        let mut rows = TriadVector::from_column_slice(Matrix4x3::identity().as_slice());
        let mut equations = self.of_sensitivity(sensitivity_and_bias(&rows));
        if self.known.len() < 4 || self.size() <= 0.0 || in_a_plane(&equations) {
            return None;
        }
        // The errors of the inputs reach the outputs through the triad itself.
        let mut gain = None;
        for _ in 0..2 {
            let by_rows = equations.gain()?;
            rows += TriadVector::from_column_slice(equations.found(&by_rows).as_slice());
            equations = self.of_sensitivity(sensitivity_and_bias(&rows));
            gain = Some(by_rows);
        }
        let split = |rows: &TriadVector| {
            let (a, bias) = sensitivity_and_bias(rows);
            Triad::from_sensitivity(form, &a, bias)
        };
        let triad = split(&rows);
        triad.correction()?;
        let by_rows = derivatives(&rows, |rows| split(rows).to_vector());
        let by_rows = DMatrix::from_fn(PER_TRIAD, PER_TRIAD, |i, j| by_rows[(i, j)]);
        Some(self.fit(triad, &equations, &gain?, &by_rows))
    }

    /// A triad from a gain, given the derivatives of its parameters with respect to the unknowns.
    fn fit(
        &self,
        triad: Triad,
        equations: &Equations,
        gain: &Gain,
        by_unknowns: &DMatrix<f64>,
    ) -> Fit {
        let covariance = by_unknowns * equations.covariance(gain) * by_unknowns.transpose();
        let numbers = self.known.iter().flat_map(|known| &known.errors);
        let count = numbers.map(|(number, _)| number + 1).max().unwrap_or(0);
        Fit {
            triad,
            covariance: SMatrix::from_fn(|i, j| covariance[(i, j)]),
            by_errors: by_unknowns * equations.by_units(gain, count),
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

/// One triad from positions without common errors: least squares for `A = K C` and `D` row by row, then the split of
/// the form. `None` if fewer than four positions or positions that leave a row undetermined. Gives the triad and the
/// covariance of its parameters.
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
        // Of either triad alike.
        sensor: Sensor::Gyro,
        noise: Noise::default(),
        base_sigma: None,
        known: known.collect(),
    };
    let fit = observed.determined(form)?;
    Some((fit.triad, fit.covariance))
}

#[cfg(test)]
mod tests;
