//! The Kalman filter: covariance in block form, observations one scalar at a time.

mod sight;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::further::{ConstantMatrix, ConstantVector, CrossMatrix, Further, constants};
use super::observability::AttitudeCovariance;
use super::states::{
    ATTITUDE, AXES, BASE, DRIFT, FURTHER_PARAMETER, INITIAL_ATTITUDE, NAVIGATION, PARAMETER,
    PARAMETERS, POSITION, ParameterMatrix, ParameterVector, STATES_WITH_DRIFT, STATES_WITH_TABLE,
    TABLE, VELOCITY,
};
use crate::attitude::{from_tilt_and_heading, skew, to_tilt_and_heading};
use crate::imu::{FurtherVector, Instability, PARAMETERS as PER_TRIAD, PerSensor, Sensor};
use crate::navigation::{Block, State};
use crate::run::{AXIS_TILTS, TableGeometry};
pub(super) use sight::Sight;

const GYRO: usize = PARAMETER;
const ACCEL: usize = PARAMETER + PER_TRIAD;

/// Mean and covariance of the errors: N is [`STATES`](super::states::STATES), or more where
/// biases wander or further terms are on.
#[derive(Debug, Clone)]
pub(super) struct Filter<const N: usize> {
    x: SVector<f64, N>,
    p: SMatrix<f64, N, N>,
    instability: PerSensor<Option<Instability>>,
}

/// Uncertainty at the first sample, 1σ.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    /// East, North and Up, rad.
    pub attitude: Vector3<f64>,
    pub velocity: f64,
    pub position: f64,
    pub table: f64,
}

impl<const N: usize> Filter<N> {
    /// Before the first sample: `parameters` and `attitude` are the means of δθ and φ₀.
    pub fn new(
        start: Start,
        parameters: &ParameterVector,
        parameter_sigma: &ParameterVector,
        attitude: Vector3<f64>,
    ) -> Self {
        let mut x = SVector::<f64, N>::zeros();
        x.fixed_rows_mut::<PARAMETERS>(PARAMETER)
            .copy_from(parameters);
        x.fixed_rows_mut::<3>(ATTITUDE).copy_from(&attitude);
        x.fixed_rows_mut::<3>(INITIAL_ATTITUDE).copy_from(&attitude);

        let mut p = SMatrix::<f64, N, N>::zeros();
        for (index, sigma) in parameter_sigma.iter().enumerate() {
            p[(PARAMETER + index, PARAMETER + index)] = sigma.powi(2);
        }
        for axis in 0..3 {
            let mut set = |row: usize, column: usize, sigma: f64| {
                p[(row + axis, column + axis)] = sigma.powi(2);
            };
            // φ starts as φ₀: fully correlated.
            set(ATTITUDE, ATTITUDE, start.attitude[axis]);
            set(ATTITUDE, INITIAL_ATTITUDE, start.attitude[axis]);
            set(INITIAL_ATTITUDE, ATTITUDE, start.attitude[axis]);
            set(INITIAL_ATTITUDE, INITIAL_ATTITUDE, start.attitude[axis]);
            set(VELOCITY, VELOCITY, start.velocity);
            set(POSITION, POSITION, start.position);
            set(TABLE, TABLE, start.table);
        }
        Self {
            x,
            p,
            instability: PerSensor::default(),
        }
    }

    /// The same with biases that wander as first-order Gauss–Markov processes (Brown and Hwang,
    /// *Introduction to Random Signals*, 4th ed., §3.8).
    pub fn with_drift(mut self, instability: PerSensor<Option<Instability>>) -> Self {
        self.instability = instability;
        for (state, instability, _) in self.drifts() {
            self.p[(state, state)] = instability.sigma.powi(2);
        }
        self
    }

    /// The same with errors of the table's own: σ of its base about East, North and Up, and of the tilt
    /// of its axes.
    pub fn with_table(mut self, sigma: &TableGeometry) -> Self {
        if N >= STATES_WITH_TABLE {
            for axis in 0..3 {
                self.p[(BASE + axis, BASE + axis)] = sigma.base[axis].powi(2);
            }
            for k in 0..AXIS_TILTS {
                self.p[(AXES + k, AXES + k)] = sigma.axes[k].powi(2);
            }
        }
        self
    }

    /// Each wandering bias: its state, how it wanders, and the parameter that is its constant part.
    fn drifts(&self) -> impl Iterator<Item = (usize, Instability, usize)> + use<N> {
        let instability = self.instability;
        let states = if N >= STATES_WITH_DRIFT { 0..6 } else { 0..0 };
        states.filter_map(move |k| {
            let (sensor, first) = if k < 3 {
                (Sensor::Gyro, GYRO)
            } else {
                (Sensor::Accel, ACCEL)
            };
            let constant = first + PER_TRIAD - 3 + k % 3;
            Some((DRIFT + k, (*instability.get(sensor))?, constant))
        })
    }

    /// The same with further parameters: mean of their error, and σ.
    pub fn with_further(mut self, mean: &FurtherVector, sigma: &FurtherVector) -> Self {
        for k in 0..N.saturating_sub(FURTHER_PARAMETER) {
            let state = FURTHER_PARAMETER + k;
            self.x[state] = mean[k];
            self.p[(state, state)] = sigma[k].powi(2);
        }
        self
    }

    /// Carries mean and covariance over a block. Only its top rows differ from identity, so of
    /// `Φ P Φᵀ + Q` only the rows and columns of the navigation errors change.
    pub fn propagate(&mut self, block: &Block) {
        let PerSensor { gyro, accel } = &block.parameters;
        // A bias does the same whether it wanders or stays.
        let of_bias = |constant: usize| -> SVector<f64, NAVIGATION> {
            if constant < ACCEL {
                gyro.column(constant - GYRO).into_owned()
            } else {
                accel.column(constant - ACCEL).into_owned()
            }
        };
        let drifts = self
            .drifts()
            .map(|(state, _, constant)| (state, of_bias(constant)));
        let further = block
            .further
            .iter()
            .map(|further| (FURTHER_PARAMETER + further.parameter, further.column));
        let more: Vec<(usize, SVector<f64, NAVIGATION>)> = drifts.chain(further).collect();
        let mut x = block.navigation * self.x.fixed_rows::<NAVIGATION>(0)
            + gyro * self.x.fixed_rows::<PER_TRIAD>(GYRO)
            + accel * self.x.fixed_rows::<PER_TRIAD>(ACCEL);
        let mut rows = block.navigation * self.p.fixed_view::<NAVIGATION, N>(0, 0)
            + gyro * self.p.fixed_view::<PER_TRIAD, N>(GYRO, 0)
            + accel * self.p.fixed_view::<PER_TRIAD, N>(ACCEL, 0);
        for (state, column) in &more {
            x += column * self.x[*state];
            rows += column * self.p.row(*state);
        }
        let mut corner = rows.fixed_view::<NAVIGATION, NAVIGATION>(0, 0)
            * block.navigation.transpose()
            + rows.fixed_view::<NAVIGATION, PER_TRIAD>(0, GYRO) * gyro.transpose()
            + rows.fixed_view::<NAVIGATION, PER_TRIAD>(0, ACCEL) * accel.transpose()
            + block.noise;
        for (state, column) in &more {
            corner += rows.column(*state) * column.transpose();
        }
        self.x.fixed_rows_mut::<NAVIGATION>(0).copy_from(&x);
        self.p
            .fixed_view_mut::<NAVIGATION, NAVIGATION>(0, 0)
            .copy_from(&corner);
        for constant in NAVIGATION..N {
            for moving in 0..NAVIGATION {
                let covariance = rows[(moving, constant)];
                self.p[(moving, constant)] = covariance;
                self.p[(constant, moving)] = covariance;
            }
        }
        self.wander(block.duration);
    }

    /// Wandering biases forget as time goes by, and are driven.
    fn wander(&mut self, duration: f64) {
        for (state, instability, _) in self.drifts() {
            let keep = (-duration / instability.correlation_time).exp();
            self.x[state] *= keep;
            self.p.row_mut(state).scale_mut(keep);
            self.p.column_mut(state).scale_mut(keep);
            self.p[(state, state)] += instability.sigma.powi(2) * (1.0 - keep * keep);
        }
    }

    /// The innovation of an observed difference in units of its own σ, its components independent:
    /// `L⁻¹ (z − H x)` with `L Lᵀ = H P Hᵀ + R`, `R` the same variance on all axes; and the logarithm
    /// of the determinant of that. `None` if it is not positive definite.
    pub fn whitened(
        &self,
        sight: Sight,
        z: &Vector3<f64>,
        variance: f64,
    ) -> Option<(Vector3<f64>, f64)> {
        let mut s = Matrix3::identity() * variance;
        for column in 0..3 {
            let ph = sight.across(column, &self.p);
            for row in 0..3 {
                s[(row, column)] += sight.along(row, &ph);
            }
        }
        let seen = Vector3::from_fn(|component, _| sight.along(component, &self.x));
        let l = s.cholesky()?.l();
        let log_determinant = 2.0 * l.diagonal().map(f64::ln).sum();
        Some((l.solve_lower_triangular(&(z - seen))?, log_determinant))
    }

    /// Takes in an observed difference, one scalar after the other, in Joseph's form, which keeps
    /// the covariance symmetric and positive whatever the rounding of the gain (Bar-Shalom, Li,
    /// Kirubarajan, *Estimation with Applications to Tracking and Navigation*, Eq. 5.2.3-18).
    pub fn observe(&mut self, sight: Sight, z: &Vector3<f64>, variance: f64) {
        for component in 0..3 {
            let ph = sight.across(component, &self.p);
            let gain = ph / (sight.along(component, &ph) + variance);
            self.x += gain * (z[component] - sight.along(component, &self.x));
            // (I − K H) P, then (…) (I − K H)ᵀ + K R Kᵀ.
            self.p.ger(-1.0, &gain, &ph, 1.0);
            let rest = gain * variance - sight.across(component, &self.p);
            self.p.ger(1.0, &rest, &gain, 1.0);
        }
        // Rounding differs on the two sides of the diagonal, and the difference would grow.
        for column in 0..N {
            for row in 0..column {
                let mean = 0.5 * (self.p[(row, column)] + self.p[(column, row)]);
                self.p[(row, column)] = mean;
                self.p[(column, row)] = mean;
            }
        }
    }

    /// The table has left its position: its error is drawn anew.
    pub fn redraw_table(&mut self, sigma: f64) {
        self.x.fixed_rows_mut::<3>(TABLE).fill(0.0);
        self.p.fixed_rows_mut::<3>(TABLE).fill(0.0);
        self.p.fixed_columns_mut::<3>(TABLE).fill(0.0);
        for axis in TABLE..TABLE + 3 {
            self.p[(axis, axis)] = sigma.powi(2);
        }
    }

    /// The body has come to rest: errors of velocity and position become those in the computed frame,
    /// `δV + φ × V`, of the computed state.
    ///
    /// A heading that is wrong turns computed velocity and position with it, and `computed − true`
    /// takes that for something seen of the heading; in the computed frame a heading is invisible
    /// (Barrau and Bonnabel 2017, "The invariant extended Kalman filter as a stable observer", IEEE
    /// Trans. Automatic Control 62(4)). Without it the σ of a heading that nothing shows shrinks with
    /// every turn.
    pub fn come_to_rest(&mut self, computed: &State) {
        for (first, computed) in [(VELOCITY, computed.velocity), (POSITION, computed.position)] {
            let turn = skew(-computed);
            let x = turn * self.x.fixed_rows::<3>(ATTITUDE);
            let mut error = self.x.fixed_rows_mut::<3>(first);
            error += x;
            let rows = turn * self.p.fixed_rows::<3>(ATTITUDE);
            let mut of_error = self.p.fixed_rows_mut::<3>(first);
            of_error += rows;
            let columns = self.p.fixed_columns::<3>(ATTITUDE) * turn.transpose();
            let mut of_error = self.p.fixed_columns_mut::<3>(first);
            of_error += columns;
        }
    }

    /// Refers the navigation errors to another computed state of the same moment. What is estimated
    /// of the truth stays as it is, and so does the covariance.
    pub fn refer(&mut self, from: &State, to: &State) {
        let error = self.x.fixed_rows::<3>(ATTITUDE).into_owned();
        let estimated = from_tilt_and_heading(&error) * from.attitude;
        self.x
            .fixed_rows_mut::<3>(ATTITUDE)
            .copy_from(&to_tilt_and_heading(&(estimated * to.attitude.transpose())));
        let mut velocity = self.x.fixed_rows_mut::<3>(VELOCITY);
        velocity += to.velocity - from.velocity;
        let mut position = self.x.fixed_rows_mut::<3>(POSITION);
        position += to.position - from.position;
    }

    /// Estimated errors that a live pass feeds back, taken out of the mean.
    pub fn take_feedback(&mut self) -> Feedback {
        let mut take = |index: usize| {
            let v = self.x.fixed_rows::<3>(index).into_owned();
            self.x.fixed_rows_mut::<3>(index).fill(0.0);
            v
        };
        let feedback = Feedback {
            attitude: take(ATTITUDE),
            velocity: take(VELOCITY),
            position: take(POSITION),
            initial_attitude: take(INITIAL_ATTITUDE),
            parameters: self.parameters(),
            further: self.further(),
        };
        self.x.fixed_rows_mut::<PARAMETERS>(PARAMETER).fill(0.0);
        let further = FURTHER_PARAMETER.min(N);
        self.x.rows_range_mut(further..).fill(0.0);
        feedback
    }

    /// Mean of the parameter errors δθ.
    pub fn parameters(&self) -> ParameterVector {
        self.x.fixed_rows::<PARAMETERS>(PARAMETER).into_owned()
    }

    /// Covariance of the parameter errors.
    pub fn parameter_covariance(&self) -> ParameterMatrix {
        self.p
            .fixed_view::<PARAMETERS, PARAMETERS>(PARAMETER, PARAMETER)
            .into_owned()
    }

    /// Mean of the errors of further parameters; zero without them.
    pub fn further(&self) -> FurtherVector {
        let of = |k: usize| self.x.get(FURTHER_PARAMETER + k).copied();
        FurtherVector::from_fn(|k, _| of(k).unwrap_or(0.0))
    }

    /// Estimates of the constants beside the parameters, those of terms off `at` where the pass
    /// linearises; zero where they are no states.
    pub fn constants(&self, at: &FurtherVector, prior_sigma: ConstantVector) -> Further {
        let covariance = |row: usize, k: usize| self.p.get((row, BASE + k)).copied();
        let mut values = constants(&SVector::zeros(), at);
        for (k, value) in values.iter_mut().enumerate() {
            *value += self.x.get(BASE + k).copied().unwrap_or(0.0);
        }
        Further {
            values,
            covariance: ConstantMatrix::from_fn(|i, k| covariance(BASE + i, k).unwrap_or(0.0)),
            cross: CrossMatrix::from_fn(|i, k| covariance(PARAMETER + i, k).unwrap_or(0.0)),
            prior_sigma,
        }
    }

    /// Covariance of the parameter errors with the initial attitude error in units of its σ.
    pub fn attitude_covariance(&self) -> AttitudeCovariance {
        let sigma = self.initial_attitude_sigma();
        AttitudeCovariance::from_fn(|i, axis| {
            self.p[(PARAMETER + i, INITIAL_ATTITUDE + axis)] / sigma[axis]
        })
    }

    /// 1σ of the parameter errors.
    pub fn parameter_sigma(&self) -> ParameterVector {
        ParameterVector::from_fn(|i, _| self.p[(PARAMETER + i, PARAMETER + i)].max(0.0).sqrt())
    }

    /// 1σ of the initial attitude error φ₀, East, North and Up.
    pub fn initial_attitude_sigma(&self) -> Vector3<f64> {
        let variance = |axis: usize| self.p[(INITIAL_ATTITUDE + axis, INITIAL_ATTITUDE + axis)];
        Vector3::from_fn(|axis, _| variance(axis).max(0.0).sqrt())
    }

    /// Mean of the initial attitude error φ₀.
    pub fn initial_attitude(&self) -> Vector3<f64> {
        self.x.fixed_rows::<3>(INITIAL_ATTITUDE).into_owned()
    }
}

/// What a live pass feeds back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Feedback {
    pub attitude: Vector3<f64>,
    pub velocity: Vector3<f64>,
    pub position: Vector3<f64>,
    pub initial_attitude: Vector3<f64>,
    pub parameters: ParameterVector,
    pub further: FurtherVector,
}

const _: () = assert!(GYRO + PER_TRIAD == ACCEL && NAVIGATION == crate::navigation::NAVIGATION);

#[cfg(test)]
mod tests;
