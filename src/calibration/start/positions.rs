//! One triad from its mean outputs under known inputs, by generalised least squares.

use std::ops::AddAssign;

use nalgebra::{DMatrix, Matrix3, Matrix4, SMatrix, Vector3, Vector4};

use super::equations::{
    Common, Equations, Partials, Rows, Span, gauss_newton, of, of_parameters, of_sensitivity,
};
use crate::calibration::checks::residuals::Residuals;
use crate::calibration::error::CalibrationError;
use crate::calibration::model::Model;
use crate::calibration::parameters::{ParameterVector, from_vector, parameter};
use crate::imu::{
    InstallationForm, Noise, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad, TriadVector,
};

/// Least eigenvalue of the correlations of a row's unknowns.
const SMALLEST_EIGENVALUE: f64 = 1e-4;
/// A smaller step ends the iteration, over σ of the prior.
const SMALL: f64 = 1e-6;
/// σ over the largest input of an output for which no noise is stated.
const NOISELESS: f64 = 1e-9;

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

/// A position, and the errors that its input has in common with others.
#[derive(Debug, Clone)]
pub struct Known {
    pub position: Position,
    /// Begin and end, s.
    pub times: [f64; 2],
    /// How its input changes with a turn of the table's base by 1 rad about East, North and Up.
    pub base: Option<Matrix3<f64>>,
    /// How it changes with other errors of unit covariance, by number from one on.
    pub errors: Vec<(usize, Matrix3<f64>)>,
}

/// Positions of a triad.
#[derive(Debug, Clone)]
pub struct Observed {
    pub sensor: Sensor,
    pub noise: Noise,
    /// 1σ of the turn of the table's base, rad.
    pub base_sigma: Vector3<f64>,
    pub known: Vec<Known>,
}

/// One triad as its positions show it.
pub struct Fit {
    pub triad: Triad,
    pub covariance: SMatrix<f64, PER_TRIAD, PER_TRIAD>,
    /// How it follows the errors of unit covariance, the table's base first, three columns each.
    pub by_errors: DMatrix<f64>,
}

impl Observed {
    /// The same with this more variance on every axis of these positions, as of a bias that is new at each.
    pub fn widened(&self, variance: f64, places: &[usize]) -> Self {
        let mut wider = self.clone();
        for &place in places {
            let position = &mut wider.known[place].position;
            position.variance.add_scalar_mut(variance);
            position.weighted.add_scalar_mut(variance);
        }
        wider
    }

    fn positions(&self) -> impl Iterator<Item = &Position> {
        self.known.iter().map(|known| &known.position)
    }

    /// Largest input.
    fn size(&self) -> f64 {
        self.positions().map(|p| p.input.norm()).fold(0.0, f64::max)
    }

    /// Adds the equations of the outputs about a sensitivity and a bias.
    fn add(
        &self,
        mut equations: Equations,
        (a, bias): (&Matrix3<f64>, &Vector3<f64>),
        partials: impl Fn(&Vector3<f64>) -> Partials<3>,
    ) -> Equations {
        let least = (NOISELESS * self.size()).powi(2);
        equations.correlated = self.positions().all(|p| p.weighted == p.variance);
        for (number, known) in self.known.iter().enumerate() {
            let Position {
                input,
                output,
                variance,
                weighted,
            } = known.position;
            equations.spans.push(Span {
                sensor: self.sensor,
                recording: 0,
                times: known.times,
                variance: 0.0,
                noise: self.noise,
            });
            let base = known
                .base
                .map(|base| base * Matrix3::from_diagonal(&self.base_sigma));
            let errors = base
                .into_iter()
                .map(|base| (0, base))
                .chain(known.errors.iter().copied());
            let errors = errors.map(|(number, of_input)| (Common::Unit(number), a * of_input));
            let own = (Common::Noise(number), Matrix3::identity());
            equations.add(&Rows {
                partials: of(self.sensor, partials(&input)),
                residual: output - a * input - bias,
                weighted: weighted.map(|v| v.max(least)),
                own: variance.map(|v| v.max(least)),
                common: std::iter::once(own).chain(errors).collect(),
                by_hand: Default::default(),
            });
        }
        equations
    }

    /// Equations of `A` and `D`, of which nothing is known beforehand.
    pub fn of_sensitivity(&self, a: &Matrix3<f64>, bias: &Vector3<f64>) -> Equations {
        let mut sigma = ParameterVector::zeros();
        let mut of_triad = sigma.fixed_rows_mut::<PER_TRIAD>(parameter(self.sensor, 0));
        of_triad.fill(f64::INFINITY);
        let equations = Equations::new(&ParameterVector::zeros(), &sigma);
        self.add(equations, (a, bias), |input| {
            of_sensitivity(input.push(1.0))
        })
    }

    /// Equations of the parameters of a triad and their prior.
    fn of_parameters(&self, model: &Model, triads: &PerSensor<Triad>) -> Equations {
        let triad = triads.get(self.sensor);
        let equations = Equations::of_triads(model, triads, &[self.sensor]);
        let at = (&triad.sensitivity(), &triad.bias);
        self.add(equations, at, |input| of_parameters(triad, input))
    }

    /// What positions leave of any triad, their inputs' errors taken through this one.
    pub fn residuals(&self, triad: &Triad) -> Option<Residuals> {
        self.of_sensitivity(&triad.sensitivity(), &triad.bias)
            .residuals()
    }

    /// How all outputs of a triad, over the σ by which each is weighted, follow a turn of the table's base by 1 rad; `None`
    /// without a table.
    pub fn by_base(&self, triad: &Triad) -> Option<DMatrix<f64>> {
        self.known.first()?.base?;
        let on_base = Self {
            base_sigma: Vector3::repeat(1.0),
            ..self.clone()
        };
        let equations = on_base.of_sensitivity(&triad.sensitivity(), &triad.bias);
        Some(equations.by_unit(0))
    }

    /// One triad from positions; with what is known beforehand where they do not know every parameter better.
    pub fn fitted(&self, model: &Model) -> Result<Fit, CalibrationError> {
        let sigma = |k: usize| model.prior_sigma[parameter(self.sensor, k)];
        let better = |fit: &Fit| {
            (0..PER_TRIAD).all(|k| sigma(k) == 0.0 || fit.covariance[(k, k)].sqrt() < sigma(k))
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
        let singular = CalibrationError::Singular { sensor };
        self.fit(
            *triads.get(sensor),
            &equations,
            &DMatrix::identity(PER_TRIAD, PER_TRIAD),
        )
        .ok_or(singular)
    }

    /// One triad from positions alone: least squares for `A = K C` and `D` row by row, then the form's split. `None`
    /// if fewer than four positions, or positions that leave a row undetermined.
    pub fn determined(&self, form: InstallationForm) -> Option<Fit> {
        let size = self.size();
        if self.known.len() < 4 || size <= 0.0 || self.in_a_plane(size) {
            return None;
        }
        let (mut a, mut bias) = (Matrix3::identity(), Vector3::zeros());
        // The errors of the inputs reach the outputs through the triad itself.
        for _ in 0..2 {
            let step = self.of_sensitivity(&a, &bias).step().ok()?;
            let step = step.fixed_rows::<PER_TRIAD>(parameter(self.sensor, 0));
            for axis in 0..3 {
                a.row_mut(axis)
                    .add_assign(step.fixed_rows::<3>(4 * axis).transpose());
                bias[axis] += step[4 * axis + 3];
            }
        }
        let triad = Triad::from_sensitivity(form, &a, bias);
        triad.correction()?;
        self.fit(
            triad,
            &self.of_sensitivity(&a, &bias),
            &split(form, &a, &bias),
        )
    }

    /// A triad whose parameters follow the unknowns of some equations so.
    fn fit(&self, triad: Triad, equations: &Equations, by_unknowns: &DMatrix<f64>) -> Option<Fit> {
        let first = parameter(self.sensor, 0);
        let covariance = equations.covariance()?;
        let covariance = covariance.fixed_view::<PER_TRIAD, PER_TRIAD>(first, first);
        let covariance = by_unknowns * covariance * by_unknowns.transpose();
        Some(Fit {
            triad,
            covariance: SMatrix::from_fn(|i, j| covariance[(i, j)]),
            by_errors: by_unknowns * equations.by_units()?.rows(first, PER_TRIAD),
        })
    }

    /// Whether positions leave a row undetermined: in a plane they leave an eigenvalue of nothing but rounding
    /// and table error, whatever the weights.
    fn in_a_plane(&self, size: f64) -> bool {
        (0..3).any(|axis| {
            let mut information = Matrix4::zeros();
            for position in self.positions() {
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
}

/// One triad from positions that have nothing in common: least squares for `A = K C` and `D` row by row, then the
/// form's split. `None` if fewer than four positions or positions that leave a row undetermined.
/// Gives the triad and the covariance of its parameters.
pub fn six_position_triad(
    positions: &[Position],
    form: InstallationForm,
) -> Option<(Triad, SMatrix<f64, PER_TRIAD, PER_TRIAD>)> {
    let known = positions.iter().enumerate().map(|(k, &position)| Known {
        position,
        times: [k as f64, k as f64 + 1.0],
        base: None,
        errors: Vec::new(),
    });
    let observed = Observed {
        // Of either triad alike.
        sensor: Sensor::Gyro,
        noise: Noise::default(),
        base_sigma: Vector3::zeros(),
        known: known.collect(),
    };
    let fit = observed.determined(form)?;
    Some((fit.triad, fit.covariance))
}

/// How the parameters follow `A` and `D`, row by row, through the form's split.
fn split(form: InstallationForm, a: &Matrix3<f64>, bias: &Vector3<f64>) -> DMatrix<f64> {
    /// The split is smooth at unit scale; central differences leave 1e-10 of relative error.
    const STEP: f64 = 1e-5;
    let mut jacobian = DMatrix::zeros(PER_TRIAD, PER_TRIAD);
    for unknown in 0..PER_TRIAD {
        let (axis, column) = (unknown / 4, unknown % 4);
        let shifted = |by: f64| -> TriadVector {
            let (mut a, mut bias) = (*a, *bias);
            match column {
                3 => bias[axis] += by,
                _ => a[(axis, column)] += by,
            }
            Triad::from_sensitivity(form, &a, bias).to_vector()
        };
        let slope = (shifted(STEP) - shifted(-STEP)) / (2.0 * STEP);
        jacobian.set_column(unknown, &slope);
    }
    jacobian
}

#[cfg(test)]
mod tests;
