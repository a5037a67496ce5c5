//! Weighted linear equations for the parameters.

use faer::Mat;
use faer::linalg::solvers::SolveLstsq;
use nalgebra::{DMatrix, DVector, Vector3};

use crate::calibration::checks::drift::Changing;
use crate::calibration::checks::residuals::Residuals;
use crate::calibration::error::CalibrationError;
use crate::calibration::model::Model;
use crate::calibration::noise::{BY_HAND, Parts};
use crate::calibration::parameters::{
    ParameterMatrix, ParameterVector, from_vector, parameter, sensor_and_parameter, to_vector,
};
use crate::imu::{
    AXES, PARAMETERS as PER_TRIAD, ParameterKind, PerSensor, Sensor, Triad, TriadVector,
};
use crate::navigation::Block;

/// An instrument without noise is still not better than this, rad or m/s: an equation needs a σ.
const ROUNDING: f64 = 1e-9;

/// Steps of Gauss–Newton at most; scale factors wrong by percents need three.
const STEPS: usize = 6;
/// A step below this (1 ppm, 0.2″, and as much of rad/s or m/s²) is no step.
const SMALL: f64 = 1e-6;

/// Linear equations for the step δθ of the estimated parameters, each row divided by its σ.
pub struct Equations {
    /// Indices of the parameters to be estimated.
    unknown: Vec<usize>,
    rows: Vec<(ParameterVector, f64)>,
    /// Rows of the prior; they come first.
    of_prior: usize,
    /// Of each other row: its σ, and what its error is made of.
    noise: Vec<(f64, ErrorOf)>,
}

/// What the error of an equation is made of.
#[derive(Debug, Clone, Default)]
pub struct ErrorOf {
    /// Variance of what is its own.
    pub own: f64,
    /// By number, what it shares with other equations, and how much of that.
    pub shared: Vec<(usize, f64)>,
    /// Variance by each of [`BY_HAND`] where that is one in SI and radians.
    pub by_hand: [f64; BY_HAND.len()],
}

impl Equations {
    /// The prior's equations, for these triads.
    pub fn new(model: &Model, at: &PerSensor<Triad>, sensors: &[Sensor]) -> Self {
        let at = to_vector(at);
        let mut equations = Self {
            unknown: Vec::new(),
            rows: Vec::new(),
            of_prior: 0,
            noise: Vec::new(),
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
        equations.of_prior = equations.rows.len();
        equations
    }

    /// An equation `error = Σ row δθ` of triads' parameters, weighted by a variance, and what its error is
    /// made of.
    pub fn add(
        &mut self,
        rows: &[(Sensor, TriadVector)],
        error: f64,
        weighted: f64,
        made_of: ErrorOf,
    ) {
        let mut whole = ParameterVector::zeros();
        for (sensor, row) in rows {
            whole
                .fixed_rows_mut::<PER_TRIAD>(parameter(*sensor, 0))
                .copy_from(row);
        }
        self.add_row(whole, error, weighted, made_of);
    }

    /// Three equations `error = Φ δθ` with rows of a block from `first` on.
    pub fn add_block(&mut self, block: &Block, first: usize, error: Vector3<f64>, variance: f64) {
        for axis in 0..3 {
            let mut row = ParameterVector::zeros();
            for sensor in Sensor::ALL {
                row.fixed_rows_mut::<PER_TRIAD>(parameter(sensor, 0))
                    .copy_from(&block.parameters.get(sensor).row(first + axis).transpose());
            }
            let own = ErrorOf {
                own: variance,
                ..ErrorOf::default()
            };
            self.add_row(row, error[axis], variance, own);
        }
    }

    fn add_row(&mut self, row: ParameterVector, error: f64, variance: f64, made_of: ErrorOf) {
        let sigma = (variance + ROUNDING.powi(2)).sqrt();
        self.rows.push((row / sigma, error / sigma));
        self.noise.push((sigma, made_of));
    }

    /// Covariance of the errors of all rows but the prior's, each over its σ, by that of what they share.
    fn errors(&self, shared: &DMatrix<f64>) -> DMatrix<f64> {
        let count = self.noise.len();
        let mut covariance = DMatrix::zeros(count, count);
        for (row, (sigma, made_of)) in self.noise.iter().enumerate() {
            // Of all that is shared an equation has ten parts at most.
            let mut with_shared = DVector::zeros(shared.nrows());
            for &(number, part) in &made_of.shared {
                with_shared.axpy(part / sigma, &shared.column(number), 1.0);
            }
            for (column, (sigma, made_of)) in self.noise[..=row].iter().enumerate() {
                let parts = made_of.shared.iter();
                let sum: f64 = parts
                    .map(|&(number, part)| part * with_shared[number])
                    .sum();
                covariance[(row, column)] = sum / sigma;
                covariance[(column, row)] = sum / sigma;
            }
            covariance[(row, row)] += (made_of.own + ROUNDING.powi(2)) / sigma.powi(2);
        }
        covariance
    }

    /// The rows but the prior's, one column for each unknown, and their errors.
    fn of_data(&self) -> (DMatrix<f64>, DVector<f64>) {
        let rows = &self.rows[self.of_prior..];
        (
            DMatrix::from_fn(rows.len(), self.unknown.len(), |i, j| {
                rows[i].0[self.unknown[j]]
            }),
            DVector::from_fn(rows.len(), |i, _| rows[i].1),
        )
    }

    /// How many rows there are but the prior's.
    pub fn count(&self) -> usize {
        self.noise.len()
    }

    /// Errors of the rows but the prior's as they are before these data, and their covariance: by prior and noise.
    pub fn before_data(&self, shared: &DMatrix<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let (design, errors) = self.of_data();
        let prior = self.of_prior_alone().cholesky()?;
        let pull = DVector::from_iterator(
            self.unknown.len(),
            self.unknown.iter().map(|&index| {
                let rows = self.rows[..self.of_prior].iter();
                rows.map(|(row, error)| row[index] * error).sum()
            }),
        );
        let errors = errors - &design * prior.solve(&pull);
        let spread = prior.l().solve_lower_triangular(&design.transpose())?;
        Some((errors, spread.tr_mul(&spread) + self.errors(shared)))
    }

    /// How much of what a hand adds is in each of the same rows.
    pub fn by_hand(&self) -> Parts {
        std::array::from_fn(|source| {
            let parts = self.noise.iter();
            let parts = parts.map(|(sigma, made_of)| made_of.by_hand[source] / sigma.powi(2));
            DVector::from_iterator(self.noise.len(), parts)
        })
    }

    /// What all rows but the prior's leave, by the covariance of what their errors share.
    pub fn residuals(&self, shared: &DMatrix<f64>) -> Option<Residuals> {
        let (design, errors) = self.of_data();
        Residuals::new(&design, &errors, &self.errors(shared))
    }

    /// The columns of a triad's unknown parameters of one kind in the rows but the prior's.
    pub fn changing(&self, sensor: Sensor, kind: ParameterKind) -> Changing {
        let (design, _) = self.of_data();
        let (mut columns, mut axes) = (Vec::new(), Vec::new());
        for (column, &index) in self.unknown.iter().enumerate() {
            let (of, parameter) = sensor_and_parameter(index);
            if of == sensor && Triad::kind(parameter) == kind {
                columns.push(column);
                axes.push(parameter % AXES.len());
            }
        }
        Changing {
            sensor,
            kind,
            columns: design.select_columns(&columns),
            axes,
        }
    }

    /// Covariance of the unknown parameters as these weights find them, by the covariance of what errors
    /// share; zero for all others. `None` if they are not determined.
    pub fn covariance(&self, shared: &DMatrix<f64>) -> Option<ParameterMatrix> {
        self.found_with(shared, |of_prior, _| Some(of_prior.clone()))
    }

    /// Information of the prior's rows.
    fn of_prior_alone(&self) -> DMatrix<f64> {
        let n = self.unknown.len();
        DMatrix::from_fn(n, n, |i, j| {
            let (i, j) = (self.unknown[i], self.unknown[j]);
            let rows = self.rows[..self.of_prior].iter();
            rows.map(|(row, _)| row[i] * row[j]).sum()
        })
    }

    /// Covariance of how far the data bring the unknown parameters from a prior that is right.
    pub fn covariance_of_distance(&self, shared: &DMatrix<f64>) -> Option<ParameterMatrix> {
        self.found_with(shared, |of_prior, of_data| {
            let prior = of_prior.clone().cholesky()?.inverse();
            Some(of_data * prior * of_data)
        })
    }

    /// Covariance of the unknown parameters by the errors of the data and what the prior adds to these, by the
    /// information of both.
    fn found_with(
        &self,
        shared: &DMatrix<f64>,
        by_prior: impl Fn(&DMatrix<f64>, &DMatrix<f64>) -> Option<DMatrix<f64>>,
    ) -> Option<ParameterMatrix> {
        let (design, _) = self.of_data();
        let (of_prior, of_data) = (self.of_prior_alone(), design.tr_mul(&design));
        let inverse = (&of_prior + &of_data).cholesky()?.inverse();
        let of_errors = design.tr_mul(&(self.errors(shared) * &design));
        let right = by_prior(&of_prior, &of_data)? + of_errors;
        Some(self.whole(&(&inverse * right * &inverse)))
    }

    /// A matrix of the unknown among all parameters.
    fn whole(&self, of_unknown: &DMatrix<f64>) -> ParameterMatrix {
        let mut whole = ParameterMatrix::zeros();
        for (i, &row) in self.unknown.iter().enumerate() {
            for (j, &column) in self.unknown.iter().enumerate() {
                whole[(row, column)] = of_unknown[(i, j)];
            }
        }
        whole
    }

    /// The step δθ of least squares; an error that names the triad where it is no number.
    pub fn solve(&self) -> Result<ParameterVector, CalibrationError> {
        let a = Mat::from_fn(self.rows.len(), self.unknown.len(), |i, j| {
            self.rows[i].0[self.unknown[j]]
        });
        let b = Mat::from_fn(self.rows.len(), 1, |i, _| self.rows[i].1);
        let solution = a.qr().solve_lstsq(&b);
        let mut step = ParameterVector::zeros();
        for (j, &index) in self.unknown.iter().enumerate() {
            step[index] = solution[(j, 0)];
        }
        match step.iter().position(|value| !value.is_finite()) {
            None => Ok(step),
            Some(index) => Err(CalibrationError::Singular {
                sensor: sensor_and_parameter(index).0,
            }),
        }
    }
}

/// Steps from a first point on, each by equations made there, until they are small.
pub fn gauss_newton(
    from: PerSensor<Triad>,
    equations: impl Fn(&PerSensor<Triad>) -> Result<Equations, CalibrationError>,
) -> Result<PerSensor<Triad>, CalibrationError> {
    let mut triads = from;
    for _ in 0..STEPS {
        let step = equations(&triads)?.solve()?;
        triads = from_vector(triads.gyro.form, &(to_vector(&triads) + step));
        if step.amax() < SMALL {
            break;
        }
    }
    Ok(triads)
}
