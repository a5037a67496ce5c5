//! Linear equations for the errors of both triads about one point: least squares, its covariance, residuals.
//!
//! A row is a residual, its partials by the unknowns, and the sources of its error. The unknowns are the parameters of
//! a form, or the entries of `A = K C` and `D` of each triad ([`of_sensitivity`]).

use nalgebra::{DMatrix, DVector, SMatrix, SVector, Vector3, Vector4};

use crate::calibration::checks::drift::Changing;
use crate::calibration::checks::residuals::Residuals;
use crate::calibration::error::CalibrationError;
use crate::calibration::model::Model;
use crate::calibration::noise::{BY_HAND, Parts};
use crate::calibration::parameters::{
    ParameterMatrix, ParameterVector, from_vector, parameter, sensor_and_parameter, to_vector,
};
use crate::imu::{Noise, PARAMETERS as PER_TRIAD, ParameterKind, PerSensor, Sensor, Triad};

/// Largest number of Gauss–Newton steps; scale factors wrong by percents need three.
const STEPS: usize = 6;

/// Partials of some rows by the unknowns of each triad.
pub type Partials<const N: usize> = SMatrix<f64, N, PER_TRIAD>;

/// Rows of one observation.
pub struct Rows<const N: usize> {
    pub partials: PerSensor<Partials<N>>,
    pub residual: SVector<f64, N>,
    /// Variance by which each is weighted.
    pub weighted: SVector<f64, N>,
    /// Variance of the part of the error that no other observation has.
    pub own: SVector<f64, N>,
    /// How the residuals follow errors that several observations have in common.
    pub common: Vec<(Common, SMatrix<f64, N, 3>)>,
    /// Variance by each of [`BY_HAND`] where that is one in SI and radians.
    pub by_hand: [f64; BY_HAND.len()],
}

impl<const N: usize> Rows<N> {
    /// With errors of this variance that no other observation has.
    pub fn independent(
        partials: PerSensor<Partials<N>>,
        residual: SVector<f64, N>,
        variance: f64,
    ) -> Self {
        Self {
            partials,
            residual,
            weighted: SVector::repeat(variance),
            own: SVector::repeat(variance),
            common: Vec::new(),
            by_hand: Default::default(),
        }
    }
}

/// An error vector that several observations have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Common {
    /// Mean noise of a triad over the span of this number.
    Noise(usize),
    /// Of unit covariance, by number.
    Unit(usize),
}

/// A span of time with the mean noise of a triad over it.
#[derive(Debug, Clone)]
pub struct Span {
    pub sensor: Sensor,
    pub recording: usize,
    /// Begin and end, s.
    pub times: [f64; 2],
    /// Variance of the mean per axis.
    pub variance: f64,
    /// The noise by which it is correlated with other spans.
    pub noise: Noise,
}

impl Span {
    fn covariance(&self, other: &Self) -> f64 {
        match (self.sensor, self.recording) == (other.sensor, other.recording) {
            true => self.noise.covariance_of_means(self.times, other.times),
            false => 0.0,
        }
    }
}

/// Equations `residual = partials · δθ + error`, and what is known of δθ beforehand.
pub struct Equations {
    /// Which of the parameters of both triads are to be found.
    unknown: Vec<usize>,
    /// Their prior: mean, and σ, infinite without one.
    mean: DVector<f64>,
    sigma: DVector<f64>,
    rows: Vec<Row>,
    pub spans: Vec<Span>,
    /// Whether rows are weighted by the inverse of their whole covariance, not each by its own variance.
    pub correlated: bool,
}

/// One row of [`Rows`].
struct Row {
    partials: ParameterVector,
    residual: f64,
    weighted: f64,
    own: f64,
    common: Vec<(Common, Vector3<f64>)>,
    by_hand: [f64; BY_HAND.len()],
}

impl Equations {
    /// By mean and σ of the prior of δθ; where that σ is zero, the parameter is not to be found.
    pub fn new(mean: &ParameterVector, sigma: &ParameterVector) -> Self {
        let unknown: Vec<usize> = (0..sigma.len()).filter(|&k| sigma[k] > 0.0).collect();
        let of = |v: &ParameterVector| {
            DVector::from_iterator(unknown.len(), unknown.iter().map(|&k| v[k]))
        };
        Self {
            mean: of(mean),
            sigma: of(sigma),
            unknown,
            rows: Vec::new(),
            spans: Vec::new(),
            correlated: false,
        }
    }

    /// Of the parameters of some triads, about these values.
    pub fn of_triads(model: &Model, at: &PerSensor<Triad>, sensors: &[Sensor]) -> Self {
        let mut sigma = model.prior_sigma;
        for sensor in Sensor::ALL.iter().filter(|of| !sensors.contains(of)) {
            let mut others = sigma.fixed_rows_mut::<PER_TRIAD>(parameter(*sensor, 0));
            others.fill(0.0);
        }
        Self::new(&(model.prior_mean - to_vector(at)), &sigma)
    }

    pub fn add<const N: usize>(&mut self, rows: &Rows<N>) {
        for k in 0..N {
            let mut partials = ParameterVector::zeros();
            for sensor in Sensor::ALL {
                let of_triad = rows.partials.get(sensor).row(k).transpose();
                let mut place = partials.fixed_rows_mut::<PER_TRIAD>(parameter(sensor, 0));
                place.copy_from(&of_triad);
            }
            let common = rows.common.iter();
            self.rows.push(Row {
                partials,
                residual: rows.residual[k],
                weighted: rows.weighted[k],
                own: rows.own[k],
                common: common
                    .map(|(of, by)| (*of, by.row(k).transpose()))
                    .collect(),
                by_hand: rows.by_hand,
            });
        }
    }

    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// Partials by the unknowns and residuals, each row over the σ by which it is weighted.
    fn scaled(&self) -> (DMatrix<f64>, DVector<f64>) {
        let (rows, unknown) = (&self.rows, &self.unknown);
        let scaled = |k: usize, value: f64| value / rows[k].weighted.sqrt();
        (
            DMatrix::from_fn(rows.len(), unknown.len(), |k, j| {
                scaled(k, rows[k].partials[unknown[j]])
            }),
            DVector::from_fn(rows.len(), |k, _| scaled(k, rows[k].residual)),
        )
    }

    /// The same with the unknowns over σ of their prior.
    pub fn in_sigmas(&self) -> (DMatrix<f64>, DVector<f64>) {
        let (mut design, residual) = self.scaled();
        for (mut column, sigma) in design.column_iter_mut().zip(&self.sigma) {
            column *= *sigma;
        }
        (design, residual)
    }

    /// Covariance of the errors of the scaled rows.
    fn errors(&self) -> DMatrix<f64> {
        let (rows, spans) = (&self.rows, &self.spans);
        let of_spans = DMatrix::from_fn(spans.len(), spans.len(), |i, j| match i == j {
            true => spans[i].variance,
            false => spans[i].covariance(&spans[j]),
        });
        let covariance = |one: Common, other: Common| match (one, other) {
            (Common::Noise(i), Common::Noise(j)) => of_spans[(i, j)],
            _ => f64::from(u8::from(one == other)),
        };
        let mut errors = DMatrix::zeros(rows.len(), rows.len());
        for (i, one) in rows.iter().enumerate() {
            for (j, other) in rows[..=i].iter().enumerate() {
                let mut sum = if i == j { one.own } else { 0.0 };
                for (of_one, by_one) in &one.common {
                    for (of_other, by_other) in &other.common {
                        sum += covariance(*of_one, *of_other) * by_one.dot(by_other);
                    }
                }
                errors[(i, j)] = sum / (one.weighted * other.weighted).sqrt();
                errors[(j, i)] = errors[(i, j)];
            }
        }
        errors
    }

    /// How the estimate follows the prior's mean over its σ, and the scaled residuals.
    fn gain(&self) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let (design, _) = self.scaled();
        let factor = match self.correlated {
            true => Some(self.errors().cholesky()?.l()),
            false => None,
        };
        let whitened = match &factor {
            Some(factor) => factor.solve_lower_triangular(&design)?,
            None => design,
        };
        let (count, unknown) = whitened.shape();
        let mut stacked = DMatrix::from_diagonal(&self.sigma.map(f64::recip));
        stacked = stacked.resize_vertically(unknown + count, 0.0);
        stacked.rows_mut(unknown, count).copy_from(&whitened);
        // x = R⁻¹ Qᵀ y: not by way of the squares of its equations.
        let qr = stacked.qr();
        let gain = qr.r().solve_upper_triangular(&qr.q().transpose())?;
        let of_data = gain.columns(unknown, count).into_owned();
        let of_data = match &factor {
            Some(factor) => factor
                .tr_solve_lower_triangular(&of_data.transpose())?
                .transpose(),
            None => of_data,
        };
        Some((gain.columns(0, unknown).into_owned(), of_data))
    }

    /// The δθ of least squares; an error that names the triad where it is no number.
    pub fn step(&self) -> Result<ParameterVector, CalibrationError> {
        let mut step = ParameterVector::zeros();
        let Some(&first) = self.unknown.first() else {
            return Ok(step);
        };
        let singular = |index: usize| CalibrationError::Singular {
            sensor: sensor_and_parameter(index).0,
        };
        let (of_prior, of_data) = self.gain().ok_or_else(|| singular(first))?;
        let found = of_prior * self.mean.component_div(&self.sigma) + of_data * self.scaled().1;
        for (&index, &value) in self.unknown.iter().zip(&found) {
            step[index] = value;
        }
        let lost = step.iter().position(|value| !value.is_finite());
        lost.map_or(Ok(step), |index| Err(singular(index)))
    }

    /// Covariance of the estimate by prior and errors; zero for parameters that are not to be found.
    pub fn covariance(&self) -> Option<ParameterMatrix> {
        let (of_prior, of_data) = self.gain()?;
        let of_errors = &of_data * self.errors() * of_data.transpose();
        Some(self.whole(&(&of_prior * of_prior.transpose() + of_errors)))
    }

    /// Covariance of how far the data bring the estimate from a prior that is right.
    pub fn covariance_of_distance(&self) -> Option<ParameterMatrix> {
        let (_, of_data) = self.gain()?;
        let (_, before) = self.before_data();
        Some(self.whole(&(&of_data * before * of_data.transpose())))
    }

    fn whole(&self, of_unknown: &DMatrix<f64>) -> ParameterMatrix {
        let mut whole = ParameterMatrix::zeros();
        for (i, &row) in self.unknown.iter().enumerate() {
            for (j, &column) in self.unknown.iter().enumerate() {
                whole[(row, column)] = of_unknown[(i, j)];
            }
        }
        whole
    }

    /// How the estimate of each parameter follows the errors of unit covariance, three columns each.
    pub fn by_units(&self) -> Option<DMatrix<f64>> {
        let (_, of_data) = self.gain()?;
        let numbers = self.rows.iter().flat_map(|row| &row.common);
        let numbers = numbers.filter_map(|(of, _)| match of {
            Common::Unit(number) => Some(number + 1),
            Common::Noise(_) => None,
        });
        let units = numbers.max().unwrap_or(0);
        let mut whole = DMatrix::zeros(2 * PER_TRIAD, 3 * units);
        for number in 0..units {
            let found = &of_data * self.by_unit(number);
            for (&index, row) in self.unknown.iter().zip(found.row_iter()) {
                whole
                    .fixed_view_mut::<1, 3>(index, 3 * number)
                    .copy_from(&row);
            }
        }
        Some(whole)
    }

    /// How the scaled rows follow the error of unit covariance of this number.
    pub fn by_unit(&self, number: usize) -> DMatrix<f64> {
        let mut by_unit = DMatrix::zeros(self.rows.len(), 3);
        for (row, mut place) in self.rows.iter().zip(by_unit.row_iter_mut()) {
            for (_, by) in row
                .common
                .iter()
                .filter(|(of, _)| *of == Common::Unit(number))
            {
                place += by.transpose() / row.weighted.sqrt();
            }
        }
        by_unit
    }

    /// Residuals of the scaled rows as they are before these data, and their covariance by prior and errors.
    pub fn before_data(&self) -> (DVector<f64>, DMatrix<f64>) {
        let (spread, residual) = self.in_sigmas();
        let residual = residual - &spread * self.mean.component_div(&self.sigma);
        (residual, &spread * spread.transpose() + self.errors())
    }

    /// How much of each of [`BY_HAND`] is in each of the scaled rows.
    pub fn by_hand(&self) -> Parts {
        std::array::from_fn(|source| {
            let part = |k: usize, _| self.rows[k].by_hand[source] / self.rows[k].weighted;
            DVector::from_fn(self.rows.len(), part)
        })
    }

    /// What the rows leave of any values of the unknowns.
    pub fn residuals(&self) -> Option<Residuals> {
        let (design, residual) = self.scaled();
        Residuals::new(&design, &residual, &self.errors())
    }

    /// Whether the unknowns of the three axes change in time: the columns of those that are to be found.
    pub fn changing(&self, sensor: Sensor, kind: ParameterKind, of_axes: [usize; 3]) -> Changing {
        let (design, _) = self.scaled();
        let place = |of_triad| {
            self.unknown
                .iter()
                .position(|&k| k == parameter(sensor, of_triad))
        };
        let places = of_axes.map(place);
        let columns: Vec<usize> = places.iter().copied().flatten().collect();
        Changing {
            sensor,
            kind,
            columns: design.select_columns(&columns),
            axes: (0..3).filter(|&axis| places[axis].is_some()).collect(),
        }
    }

    /// Residual and weight of each row.
    pub fn weighted(&self) -> impl Iterator<Item = (f64, f64)> {
        self.rows.iter().map(|row| (row.residual, row.weighted))
    }
}

/// Partials of `A u + D` by `A` and `D`, row by row, for `[u; 1]`; for `[u; 0]` those of an output without its zero.
pub fn of_sensitivity(input: Vector4<f64>) -> Partials<3> {
    let mut partials = Partials::zeros();
    for axis in 0..3 {
        partials
            .fixed_view_mut::<1, 4>(axis, 4 * axis)
            .copy_from(&input.transpose());
    }
    partials
}

/// Partials of a triad's output by its parameters.
pub fn of_parameters(triad: &Triad, input: &Vector3<f64>) -> Partials<3> {
    Partials::from_columns(&triad.response().map(|response| response * input.push(1.0)))
}

/// The partials of one triad.
pub fn of(sensor: Sensor, partials: Partials<3>) -> PerSensor<Partials<3>> {
    PerSensor::from_fn(|other| match other == sensor {
        true => partials,
        false => Partials::zeros(),
    })
}

/// Steps from a first point, each by equations made there, until no parameter changes by more than this.
pub fn gauss_newton(
    from: PerSensor<Triad>,
    smallest: &ParameterVector,
    equations: impl Fn(&PerSensor<Triad>) -> Result<Equations, CalibrationError>,
) -> Result<PerSensor<Triad>, CalibrationError> {
    let mut triads = from;
    for _ in 0..STEPS {
        let step = equations(&triads)?.step()?;
        triads = from_vector(triads.gyro.form, &(to_vector(&triads) + step));
        if step
            .iter()
            .zip(smallest)
            .all(|(step, least)| step.abs() <= *least)
        {
            break;
        }
    }
    Ok(triads)
}
