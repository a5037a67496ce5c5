//! Linear equations for the errors of both triads, linearised at one point.
//!
//! A row consists of a residual, its partial derivatives with respect to the unknowns, and its error sources. The
//! unknowns are the parameters of a form, or the entries of `A = K C` and `D` of each triad ([`of_sensitivity`]).
//! [`super::least_squares`] solves them.

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, SVector, Vector3, Vector4};

use crate::calibration::noise::{BY_HAND, Parts};
use crate::calibration::{
    CalibrationError, Model, PARAMETERS, ParameterMatrix, ParameterVector, from_vector, parameter,
    sensor_and_parameter, to_vector,
};
use crate::imu::{GaussMarkov, Noise, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad};

/// Maximum number of Gauss–Newton steps; scale factor errors of several percent need three.
const STEPS: usize = 6;

/// Partial derivatives of rows with respect to the unknowns of a triad.
pub type OfTriad<const N: usize> = SMatrix<f64, N, PER_TRIAD>;
/// Partial derivatives of rows with respect to the unknowns of both triads.
pub type Partials<const N: usize> = SMatrix<f64, N, PARAMETERS>;

/// A time interval with the mean noise of the triads.
#[derive(Debug, Clone)]
pub struct Event {
    pub recording: usize,
    /// Start and end, s.
    pub times: [f64; 2],
    /// Variance of the mean per axis.
    pub variance: PerSensor<f64>,
    /// Noise common to other events.
    pub noise: PerSensor<Noise>,
}

/// Gauss–Markov bias variation over an event.
pub struct Drift {
    /// Stationary variance.
    pub variance: f64,
    /// Mean over the event, given the value at one end, divided by this value.
    pub mean: f64,
    /// Value at the other end, divided by the value at one end.
    pub decay: f64,
    /// Value at the beginning, divided by the value at the end of the preceding event; zero without a preceding event.
    pub since: f64,
}

impl Event {
    /// Bias variation of a triad over the event; `None` if its bias does not vary.
    pub fn drift(&self, sensor: Sensor, before: Option<&Self>) -> Option<Drift> {
        let GaussMarkov {
            sigma,
            correlation_time,
        } = self.noise.get(sensor).gauss_markov?;
        let duration = (self.times[1] - self.times[0]) / correlation_time;
        let before = before.filter(|before| before.recording == self.recording);
        let since = |before: &Self| (self.times[0] - before.times[1]).max(0.0) / correlation_time;
        Some(Drift {
            variance: sigma.powi(2),
            mean: -(-duration).exp_m1() / duration,
            decay: (-duration).exp(),
            since: before.map_or(0.0, |before| (-since(before)).exp()),
        })
    }
}

/// An error vector common to several rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Common {
    /// Mean noise of a triad over the event with this number.
    Noise(Sensor, usize),
    /// Bias variation of a triad at the end of the event with this number.
    Drift(Sensor, usize),
    /// A vector with unit covariance, identified by its number.
    Unit(usize),
    /// Number of a vector with unit covariance that both triads share: an error of the table.
    Table(usize),
}

/// Rows of the observations in one event.
pub struct Rows<const N: usize> {
    pub event: usize,
    pub partials: Partials<N>,
    pub residual: SVector<f64, N>,
    /// Variance used for the weight of each row.
    pub weighted: SVector<f64, N>,
    /// Variance of the independent part of the error.
    pub own: SVector<f64, N>,
    /// Response of the residuals to errors common to several rows.
    pub common: Vec<(Common, SMatrix<f64, N, 3>)>,
    /// Variance due to each of [`BY_HAND`] for unit σ in SI and radians.
    pub by_hand: [f64; BY_HAND.len()],
}

impl<const N: usize> Rows<N> {
    /// Adds independent errors of this variance.
    pub fn new(partials: Partials<N>, residual: SVector<f64, N>, variance: f64) -> Self {
        Self {
            event: 0,
            partials,
            residual,
            weighted: SVector::repeat(variance),
            own: SVector::repeat(variance),
            common: Vec::new(),
            by_hand: Default::default(),
        }
    }
}

/// Equations `residual = partials · δθ + error`, with the prior of δθ.
pub struct Equations {
    /// The unknown parameters of both triads.
    pub unknown: Vec<usize>,
    /// Prior of the unknowns: mean divided by σ, and σ (infinite without a prior).
    pub mean: DVector<f64>,
    pub sigma: DVector<f64>,
    pub rows: Vec<Rows<1>>,
    pub events: Vec<Event>,
    /// Whether [`Self::solved`] uses the inverse of the full covariance of the rows as weight, and not only their
    /// variances.
    pub correlated: bool,
}

impl Equations {
    /// Equations with this prior mean and σ of δθ; parameters with σ = 0 are not estimated.
    pub fn new(mean: &ParameterVector, sigma: &ParameterVector) -> Self {
        let unknown: Vec<usize> = (0..PARAMETERS).filter(|&k| sigma[k] > 0.0).collect();
        let count = unknown.len();
        Self {
            mean: DVector::from_fn(count, |k, _| mean[unknown[k]] / sigma[unknown[k]]),
            sigma: DVector::from_fn(count, |k, _| sigma[unknown[k]]),
            unknown,
            rows: Vec::new(),
            events: Vec::new(),
            correlated: false,
        }
    }

    /// Equations for the parameters of some triads, linearised about these values.
    pub fn of_triads(model: &Model, at: &PerSensor<Triad>, sensors: &[Sensor]) -> Self {
        let of = |k| sensors.contains(&sensor_and_parameter(k).0);
        let sigma = |k: usize, _| if of(k) { model.prior_sigma[k] } else { 0.0 };
        let mean = model.prior_mean - to_vector(at);
        Self::new(&mean, &ParameterVector::from_fn(sigma))
    }

    pub fn add<const N: usize>(&mut self, rows: &Rows<N>) {
        let row = |k: usize| Rows {
            event: rows.event,
            partials: rows.partials.fixed_rows::<1>(k).into_owned(),
            residual: rows.residual.fixed_rows::<1>(k).into_owned(),
            weighted: rows.weighted.fixed_rows::<1>(k).into_owned(),
            own: rows.own.fixed_rows::<1>(k).into_owned(),
            common: Vec::from_iter(
                rows.common
                    .iter()
                    .map(|(of, by)| (*of, by.fixed_rows::<1>(k).into_owned())),
            ),
            by_hand: rows.by_hand,
        };
        self.rows.extend((0..N).map(row));
    }

    /// Partial derivatives of a row with respect to the unknowns.
    pub fn partials<'a>(&'a self, row: &'a Rows<1>) -> impl Iterator<Item = f64> + 'a {
        self.unknown.iter().map(|&index| row.partials[index])
    }

    /// Partial derivatives with respect to the unknowns, and residuals, each row divided by its weighting σ.
    pub fn scaled(&self) -> (DMatrix<f64>, DVector<f64>) {
        let (rows, unknown) = (&self.rows, &self.unknown);
        let sigma = |k: usize| rows[k].weighted.x.sqrt();
        let partial = |k: usize, j: usize| rows[k].partials[unknown[j]] / sigma(k);
        let residual = |k: usize, _| rows[k].residual.x / sigma(k);
        (
            DMatrix::from_fn(rows.len(), unknown.len(), partial),
            DVector::from_fn(rows.len(), residual),
        )
    }

    /// Does the same as [`Self::scaled`], but with the unknowns in units of their prior σ.
    pub fn in_sigmas(&self) -> (DMatrix<f64>, DVector<f64>) {
        let (design, residual) = self.scaled();
        (design * DMatrix::from_diagonal(&self.sigma), residual)
    }

    /// Expands a matrix for the unknowns to a matrix for all parameters.
    pub fn whole(&self, of_unknowns: &DMatrix<f64>) -> ParameterMatrix {
        let place = |k: usize| self.unknown.iter().position(|&index| index == k);
        ParameterMatrix::from_fn(|i, j| match (place(i), place(j)) {
            (Some(row), Some(column)) => of_unknowns[(row, column)],
            _ => 0.0,
        })
    }

    /// Variance of a common error, per component.
    pub fn variance_of(&self, of: Common) -> f64 {
        match of {
            Common::Noise(sensor, event) => *self.events[event].variance.get(sensor),
            Common::Drift(..) | Common::Unit(_) | Common::Table(_) => 1.0,
        }
    }

    /// Covariance of the errors of the scaled rows.
    pub fn errors(&self) -> DMatrix<f64> {
        let (rows, events) = (&self.rows, &self.events);
        let covariance = |one: Common, other: Common| match (one, other) {
            _ if one == other => self.variance_of(one),
            (Common::Noise(of, i), Common::Noise(sensor, j)) if of == sensor => {
                let [one, other] = [&events[i], &events[j]];
                let noise = one.noise.get(sensor);
                let both = (one.recording == other.recording).then_some((one.times, other.times));
                both.map_or(0.0, |(one, other)| noise.covariance_of_means(one, other))
            }
            _ => 0.0,
        };
        let mut errors = DMatrix::zeros(rows.len(), rows.len());
        for (i, one) in rows.iter().enumerate() {
            for (j, other) in rows[..=i].iter().enumerate() {
                let mut sum = if i == j { one.own.x } else { 0.0 };
                for (of_one, by_one) in &one.common {
                    for (of_other, by_other) in &other.common {
                        sum += covariance(*of_one, *of_other) * by_one.dot(by_other);
                    }
                }
                errors[(i, j)] = sum / (one.weighted.x * other.weighted.x).sqrt();
                errors[(j, i)] = errors[(i, j)];
            }
        }
        errors
    }

    /// Residuals of the scaled rows before the fit, and their covariance due to prior and errors.
    pub fn before_data(&self) -> (DVector<f64>, DMatrix<f64>) {
        let (spread, residual) = self.in_sigmas();
        let covariance = &spread * spread.transpose() + self.errors();
        (residual - spread * &self.mean, covariance)
    }

    /// Contribution of each source in [`BY_HAND`] to each scaled row.
    pub fn by_hand(&self) -> Parts {
        std::array::from_fn(|source| {
            let part = |k: usize, _| self.rows[k].by_hand[source] / self.rows[k].weighted.x;
            DVector::from_fn(self.rows.len(), part)
        })
    }

    /// Residual and weight of each row.
    pub fn weighted(&self) -> impl Iterator<Item = (f64, f64)> {
        self.rows.iter().map(|row| (row.residual.x, row.weighted.x))
    }
}

/// Embeds the partial derivatives of one triad in those of both triads.
pub fn of<const N: usize>(sensor: Sensor, partials: &OfTriad<N>) -> Partials<N> {
    let mut whole = Partials::zeros();
    let mut place = whole.fixed_columns_mut::<PER_TRIAD>(parameter(sensor, 0));
    place.copy_from(partials);
    whole
}

/// Partial derivatives of `A u + D` with respect to `A` and `D`, row by row, for `[u; 1]`; for `[u; 0]`, the
/// derivatives of an output without bias.
pub fn of_sensitivity(input: Vector4<f64>) -> OfTriad<3> {
    Matrix3::identity().kronecker(&input.transpose())
}

/// Partial derivatives of the output of a triad with respect to its parameters.
pub fn of_parameters(triad: &Triad, input: &Vector3<f64>) -> OfTriad<3> {
    OfTriad::from_columns(&triad.response().map(|response| response * input.push(1.0)))
}

/// Iterates from a first point, with one step from each point, until no parameter changes by more than this limit.
pub fn gauss_newton(
    from: PerSensor<Triad>,
    smallest: &ParameterVector,
    step: impl Fn(&PerSensor<Triad>) -> Result<ParameterVector, CalibrationError>,
) -> Result<PerSensor<Triad>, CalibrationError> {
    let mut triads = from;
    for _ in 0..STEPS {
        let step = step(&triads)?;
        triads = from_vector(triads.gyro.form, &(to_vector(&triads) + step));
        let mut parameters = step.iter().zip(smallest);
        if parameters.all(|(step, least)| step.abs() <= *least) {
            break;
        }
    }
    Ok(triads)
}
