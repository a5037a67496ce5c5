//! The Kalman filter: covariance in block form, measurements one scalar at a time.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::measurement::{Measurement, ScalarInnovation};
use super::sensitivity::Sensitivity;
use crate::attitude::{skew, to_tilt_and_heading};
use crate::calibration::dwell_scatter::Posterior;
use crate::calibration::layout::{ATTITUDE, Layout, NAVIGATION, POSITION, VELOCITY};
use crate::calibration::linearisation::Start;
use crate::calibration::model::Model;
use crate::calibration::parameters::{ParameterMatrix, ParameterVector, sensor_and_parameter};
use crate::imu::{PerSensor, Sensor, TermVector};
use crate::navigation::{Block, ProcessNoise, State};

/// Mean and covariance of the errors.
#[derive(Debug, Clone)]
pub(in crate::calibration) struct Filter {
    pub layout: Layout,
    x: DVector<f64>,
    p: DMatrix<f64>,
    noise: PerSensor<ProcessNoise>,
    /// Of the turn at rest alone, rad/√s.
    turning: f64,
    /// 1σ and correlation time of each varying bias, by its state.
    varying: Vec<(usize, f64, f64)>,
    /// What auxiliary parameters that are tried would do.
    pub sensitivity: Option<Sensitivity>,
}

impl Filter {
    /// Before the first stretch begins: `parameters` and `terms` are the means of their errors.
    pub fn new(model: &Model, parameters: &ParameterVector, terms: &TermVector) -> Self {
        let layout = Layout::new(model);
        let n = layout.size();
        let (mut x, mut p) = (DVector::zeros(n), DMatrix::zeros(n, n));
        for (state, index) in layout.parameters() {
            x[state] = parameters[index];
            p[(state, state)] = model.prior_sigma[index].powi(2);
        }
        for (state, index) in layout.terms() {
            x[state] = terms[index];
            p[(state, state)] = model.term_sigma[index].powi(2);
        }
        if let Some(base) = layout.table_base() {
            for axis in 0..3 {
                p[(base + axis, base + axis)] = model.geometry.base[axis].powi(2);
            }
        }
        for (state, k) in layout.table_axes() {
            p[(state, state)] = model.geometry.axes[k].powi(2);
        }
        let varying = layout.varying_biases().filter_map(|(state, sensor, _)| {
            let variation = model.noise.get(sensor).gauss_markov?;
            Some((state, variation.sigma, variation.correlation_time))
        });
        let varying = varying.collect();
        Self {
            layout,
            x,
            p,
            turning: model.turning_at_rest,
            noise: model.process_noise(),
            varying,
            sensitivity: None,
        }
    }

    /// The same with auxiliary parameters that are no states but tried.
    pub fn trying(mut self, auxiliary: &[usize]) -> Self {
        self.layout = self.layout.trying(auxiliary);
        let tried = self.layout.tried();
        self.sensitivity = (tried > 0).then(|| Sensitivity::new(tried, self.x.len()));
        self
    }

    /// A stretch begins: navigation errors and the table's position start anew, `anew` tells whether the
    /// variation of biases (first-order Gauss–Markov: Brown and Hwang, *Introduction to Random Signals*,
    /// 4th ed., §3.8) does, too, as in another recording; `gravity` is its 1σ at another site.
    pub fn begin(&mut self, start: &Start, table_sigma: f64, anew: bool, gravity: Option<f64>) {
        let initial = self.layout.initial_attitude();
        for axis in 0..3 {
            for (first, mean, sigma) in [
                (ATTITUDE, start.attitude[axis], start.attitude_sigma[axis]),
                (VELOCITY, 0.0, start.velocity_sigma),
                (POSITION, 0.0, start.position_sigma),
                (initial, start.attitude[axis], start.attitude_sigma[axis]),
            ] {
                self.redraw(first + axis, mean, sigma);
            }
        }
        for axis in 0..3 {
            // φ starts as φ₀: fully correlated.
            let variance = start.attitude_sigma[axis].powi(2);
            self.p[(ATTITUDE + axis, initial + axis)] = variance;
            self.p[(initial + axis, ATTITUDE + axis)] = variance;
        }
        self.redraw_table(table_sigma);
        if let Some((state, sigma)) = self.layout.gravity().zip(gravity) {
            self.redraw(state, 0.0, sigma);
        }
        if anew {
            for k in 0..self.varying.len() {
                let (state, sigma, _) = self.varying[k];
                self.redraw(state, 0.0, sigma);
            }
        }
    }

    /// Forgets a state: its error is drawn anew, independent of all others.
    fn redraw(&mut self, state: usize, mean: f64, sigma: f64) {
        self.x[state] = mean;
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.redraw(state);
        }
        self.p.row_mut(state).fill(0.0);
        self.p.column_mut(state).fill(0.0);
        self.p[(state, state)] = sigma.powi(2);
    }

    /// The table has left its position: its error is drawn anew.
    pub fn redraw_table(&mut self, sigma: f64) {
        if let Some(table) = self.layout.table_position() {
            (table..table + 3).for_each(|state| self.redraw(state, 0.0, sigma));
        }
    }

    /// The body does not turn from now on: what the computed attitude does is an error.
    pub fn begin_to_hold(&mut self) {
        if let Some(turn) = self.layout.turn_at_rest() {
            (turn..turn + 3).for_each(|state| self.redraw(state, 0.0, 0.0));
        }
    }

    /// Carries mean and covariance over a block.
    pub fn propagate(&mut self, block: &Block) {
        match self.layout.turn_at_rest() {
            Some(_) => self.carry::<{ NAVIGATION + 3 }>(block),
            None => self.carry::<NAVIGATION>(block),
        }
        self.vary(block.duration);
    }

    /// Only the rows of Φ of `MOVING` states differ from identity: navigation errors and, where there is
    /// one, the turn at rest. Of `Φ P Φᵀ + Q` only their rows and columns change.
    fn carry<const MOVING: usize>(&mut self, block: &Block) {
        let phi = self.moving_rows::<MOVING>(block);
        let n = self.x.len();
        let mut x = [0.0; MOVING];
        let mut rows = vec![[0.0; MOVING]; n];
        let mut corner = [[0.0; MOVING]; MOVING];
        let p = self.p.as_slice();
        for (k, column) in phi.iter().enumerate() {
            add_scaled(&mut x, column, self.x[k]);
        }
        for (j, row) in rows.iter_mut().enumerate() {
            let p = &p[n * j..n * j + phi.len()];
            let mut sum = [0.0; MOVING];
            for (column, p) in phi.iter().zip(p) {
                add_scaled(&mut sum, column, *p);
            }
            *row = sum;
        }
        for (k, row_of_corner) in corner.iter_mut().enumerate() {
            let mut sum = [0.0; MOVING];
            for (column, row) in phi.iter().zip(&rows) {
                add_scaled(&mut sum, row, column[k]);
            }
            *row_of_corner = sum;
        }
        let turn = self.layout.turn_at_rest().unwrap_or(n);
        // Where a moving state is, and which navigation error's noise it has.
        let place = |moving: usize| match moving.checked_sub(NAVIGATION) {
            Some(axis) => (turn + axis, ATTITUDE + axis),
            None => (moving, moving),
        };
        let constants = NAVIGATION..turn;
        for constant in constants.chain((turn + 3).min(n)..n) {
            for (moving, &covariance) in rows[constant].iter().enumerate() {
                let (moving, _) = place(moving);
                self.p[(moving, constant)] = covariance;
                self.p[(constant, moving)] = covariance;
            }
        }
        let noise = block.noise.covariance(&self.noise);
        for (column, sum) in corner.iter().enumerate() {
            let (at_column, of_column) = place(column);
            self.x[at_column] = x[column];
            for (row, sum) in sum.iter().enumerate() {
                let (at_row, of_row) = place(row);
                self.p[(at_row, at_column)] = sum + noise[(of_row, of_column)];
            }
            if at_column >= NAVIGATION {
                self.p[(at_column, at_column)] += self.turning.powi(2) * block.duration;
            }
        }
        if let Some(sensitivity) = &mut self.sensitivity {
            let on = self.layout.terms().count();
            let tried = self.layout.tried_terms().zip(&block.terms[on..]);
            let tried = tried.map(|((k, _), term)| {
                (
                    k,
                    std::array::from_fn(|moving| term.column[place(moving).1]),
                )
            });
            sensitivity.propagate(&phi, |moving| place(moving).0, tried);
        }
    }

    /// The rows of Φ of the states that move, column by column: navigation errors, the states that drive
    /// them, the turn at rest.
    fn moving_rows<const MOVING: usize>(&self, block: &Block) -> Vec<[f64; MOVING]> {
        let PerSensor { gyro, accel } = &block.parameters;
        let navigation = block.navigation.column_iter();
        let of_triad = |sensor: Sensor, parameter: usize| match sensor {
            Sensor::Gyro => gyro.column(parameter),
            Sensor::Accel => accel.column(parameter),
        };
        let parameters = self.layout.parameters().map(|(_, index)| {
            let (sensor, parameter) = sensor_and_parameter(index);
            of_triad(sensor, parameter)
        });
        let on = self.layout.terms().count();
        let terms = block.terms.iter().take(on);
        let terms = terms.map(|term| term.column.column(0));
        // Stated gravity that is too small pulls the computed velocity down too little.
        let t = block.duration;
        let pull = [0.0, 0.0, 0.0, 0.0, 0.0, t, 0.0, 0.0, 0.5 * t * t];
        let gravity = self.layout.gravity().map(|_| pull);
        // A bias does the same whether it varies or stays.
        let varying = self.layout.varying_biases();
        let varying = varying.map(|(_, sensor, constant)| of_triad(sensor, constant));
        let known = navigation.chain(parameters).chain(terms);
        let known = known.map(|column| std::array::from_fn(|row| column[row]));
        let varying = varying.map(|column| std::array::from_fn(|row| column[row]));
        let driving = known.chain(gravity).chain(varying);
        let driving = driving
            .enumerate()
            .map(|(state, column): (usize, [f64; NAVIGATION])| {
                std::array::from_fn(|moving| match moving.checked_sub(NAVIGATION) {
                    // By as much as the attitude error has changed.
                    Some(axis) if state == ATTITUDE + axis => column[state] - 1.0,
                    Some(axis) => column[ATTITUDE + axis],
                    None => column[moving],
                })
            });
        let turn = (NAVIGATION..MOVING)
            .map(|itself| std::array::from_fn(|moving| if moving == itself { 1.0 } else { 0.0 }));
        driving.chain(turn).collect()
    }

    /// Varying biases forget as time goes by, and are driven.
    fn vary(&mut self, duration: f64) {
        for &(state, sigma, correlation_time) in &self.varying {
            let keep = (-duration / correlation_time).exp();
            self.x[state] *= keep;
            if let Some(sensitivity) = &mut self.sensitivity {
                sensitivity.scale(state, keep);
            }
            self.p.row_mut(state).scale_mut(keep);
            self.p.column_mut(state).scale_mut(keep);
            self.p[(state, state)] += sigma.powi(2) * (1.0 - keep * keep);
        }
    }

    /// The innovation in units of its own σ, its components independent: `L⁻¹ (z − H x)` with
    /// `L Lᵀ = H P Hᵀ + R`; and the logarithm of the determinant of that. `None` if it is not positive
    /// definite.
    pub fn whitened(&self, measurement: &Measurement) -> Option<(Vector3<f64>, f64)> {
        let Measurement { residual, rows, .. } = measurement;
        let mut s = Matrix3::from_diagonal_element(measurement.variance);
        for (column, of_column) in rows.iter().enumerate() {
            let ph = self.times_covariance(of_column);
            for (row, of_row) in rows.iter().enumerate() {
                s[(row, column)] += times(of_row, &ph);
            }
        }
        let predicted = Vector3::from_fn(|row, _| times(&rows[row], self.x.as_slice()));
        let l = s.cholesky()?.l();
        let log_determinant = 2.0 * l.diagonal().map(f64::ln).sum();
        Some((
            l.solve_lower_triangular(&(residual - predicted))?,
            log_determinant,
        ))
    }

    /// Takes in a measurement, one scalar after the other, in Joseph's form, which keeps the covariance
    /// symmetric and positive whatever the rounding of the gain (Bar-Shalom, Li, Kirubarajan,
    /// *Estimation with Applications to Tracking and Navigation*, Eq. 5.2.3-18).
    ///
    /// The scalar innovations as they came are independent of each other.
    pub fn update(&mut self, measurement: &Measurement) -> [ScalarInnovation; 3] {
        let mut scalars = [ScalarInnovation::default(); 3];
        let n = self.x.len();
        let (mut ph, mut gain, mut rest) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for (axis, (row, z)) in measurement
            .rows
            .iter()
            .zip(&measurement.residual)
            .enumerate()
        {
            self.times_upper(row, &mut ph);
            let variance = times(row, &ph) + measurement.variance;
            let scale = 1.0 / variance;
            let innovation = z - times(row, self.x.as_slice());
            scalars[axis] = ScalarInnovation {
                innovation,
                variance,
            };
            for ((x, gain), ph) in self.x.iter_mut().zip(&mut gain).zip(&ph) {
                *gain = ph * scale;
                *x += *gain * innovation;
            }
            if let Some(sensitivity) = &mut self.sensitivity {
                let rows = [row.as_slice(), measurement.tried[axis].as_slice()];
                sensitivity.update(rows, &gain, scalars[axis]);
            }
            // (I − K H) P, then (…) (I − K H)ᵀ + K R Kᵀ: both symmetric, so the upper half will do.
            let columns = self.p.as_mut_slice().chunks_exact_mut(n);
            for (j, column) in columns.enumerate() {
                let (column, gain, factor) = (&mut column[..=j], &gain[..=j], ph[j]);
                for k in 0..=j {
                    column[k] -= gain[k] * factor;
                }
            }
            self.times_upper(row, &mut rest);
            for (rest, gain) in rest.iter_mut().zip(&gain) {
                *rest = 0.5 * (gain * measurement.variance - *rest);
            }
            let columns = self.p.as_mut_slice().chunks_exact_mut(n);
            for (j, column) in columns.enumerate() {
                add_both(&mut column[..=j], (gain[j], &rest), (rest[j], &gain));
            }
        }
        for column in 0..n {
            for row in 0..column {
                self.p[(column, row)] = self.p[(row, column)];
            }
        }
        scalars
    }

    /// `P hᵀ` from the upper half of P.
    fn times_upper(&self, h: &[(usize, f64)], product: &mut [f64]) {
        let n = self.x.len();
        let p = self.p.as_slice();
        product.fill(0.0);
        for &(state, weight) in h {
            let (above, below) = product.split_at_mut(state);
            for (sum, p) in above.iter_mut().zip(&p[n * state..]) {
                *sum += weight * p;
            }
            let of_row = p[state..].iter().step_by(n).skip(state);
            for (sum, p) in below.iter_mut().zip(of_row) {
                *sum += weight * p;
            }
        }
    }

    /// `P hᵀ`
    fn times_covariance(&self, h: &[(usize, f64)]) -> Vec<f64> {
        let mut product = vec![0.0; self.x.len()];
        self.times_upper(h, &mut product);
        product
    }

    /// The body has come to rest: errors of velocity and position become those in the computed frame,
    /// `δV + φ × V`, of the computed state.
    ///
    /// A heading that is wrong turns computed velocity and position with it, and `computed − true`
    /// takes that for something observed of the heading; in the computed frame a heading is invisible
    /// (Barrau and Bonnabel 2017, "The invariant extended Kalman filter as a stable observer", IEEE
    /// Trans. Automatic Control 62(4)). Without it the σ of a heading that nothing shows shrinks with
    /// every turn.
    pub fn come_to_rest(&mut self, computed: &State) {
        for (first, computed) in [(VELOCITY, computed.velocity), (POSITION, computed.position)] {
            let turn = skew(-computed);
            let x = turn * self.x.fixed_rows::<3>(ATTITUDE);
            let mut error = self.x.fixed_rows_mut::<3>(first);
            error += x;
            if let Some(sensitivity) = &mut self.sensitivity {
                for row in 0..3 {
                    let turned = (0..3).map(|k| (ATTITUDE + k, turn[(row, k)]));
                    sensitivity.add(first + row, turned);
                }
            }
            let rows = turn * self.p.fixed_rows::<3>(ATTITUDE);
            let mut of_error = self.p.fixed_rows_mut::<3>(first);
            of_error += rows;
            let columns = self.p.fixed_columns::<3>(ATTITUDE) * turn.transpose();
            let mut of_error = self.p.fixed_columns_mut::<3>(first);
            of_error += columns;
        }
    }

    /// Refers the navigation errors to another computed state of the same moment, to first order as all of
    /// a pass: the filter stays linear, and what it finds does not depend on the order of what it is told.
    pub fn refer(&mut self, from: &State, to: &State) {
        let turned = to_tilt_and_heading(&(from.attitude * to.attitude.transpose()));
        let turn = self.layout.turn_at_rest();
        for (first, by) in [
            (ATTITUDE, turned),
            (VELOCITY, to.velocity - from.velocity),
            (POSITION, to.position - from.position),
        ]
        .into_iter()
        .chain(turn.map(|turn| (turn, turned)))
        {
            let mut error = self.x.fixed_rows_mut::<3>(first);
            error += by;
        }
    }

    /// Estimated errors that a pass with feedback takes out of the mean.
    pub fn take_feedback(&mut self) -> Feedback {
        let feedback = Feedback {
            attitude: self.at(ATTITUDE),
            velocity: self.at(VELOCITY),
            position: self.at(POSITION),
            initial_attitude: self.initial_attitude(),
            parameters: self.parameters(),
            terms: self.terms(),
        };
        let constants = self.layout.parameters().chain(self.layout.terms());
        let initial = self.layout.initial_attitude();
        let taken = (0..NAVIGATION)
            .chain(constants.map(|(state, _)| state))
            .chain(initial..initial + 3);
        for state in taken.collect::<Vec<_>>() {
            self.x[state] = 0.0;
        }
        feedback
    }

    fn at(&self, first: usize) -> Vector3<f64> {
        self.x.fixed_rows::<3>(first).into_owned()
    }

    /// Mean of the parameter errors δθ.
    pub fn parameters(&self) -> ParameterVector {
        let mut all = ParameterVector::zeros();
        for (state, index) in self.layout.parameters() {
            all[index] = self.x[state];
        }
        all
    }

    /// Covariance of the parameter errors; zero where fixed.
    pub fn parameter_covariance(&self) -> ParameterMatrix {
        let mut all = ParameterMatrix::zeros();
        for (row, i) in self.layout.parameters() {
            for (column, j) in self.layout.parameters() {
                all[(i, j)] = self.p[(row, column)];
            }
        }
        all
    }

    /// 1σ of the parameter errors.
    pub fn parameter_sigma(&self) -> ParameterVector {
        let mut all = ParameterVector::zeros();
        for (state, index) in self.layout.parameters() {
            all[index] = self.p[(state, state)].max(0.0).sqrt();
        }
        all
    }

    /// Mean of the errors of the error terms' parameters; zero where off.
    pub fn terms(&self) -> TermVector {
        let mut all = TermVector::zeros();
        for (state, index) in self.layout.terms() {
            all[index] = self.x[state];
        }
        all
    }

    /// Mean and covariance of the errors of what is constant throughout a recording.
    pub fn constants(&self) -> Posterior {
        let states: Vec<usize> = self.layout.constants().collect();
        let n = states.len();
        Posterior {
            mean: DVector::from_fn(n, |i, _| self.x[states[i]]),
            covariance: DMatrix::from_fn(n, n, |i, j| self.p[(states[i], states[j])]),
        }
    }

    /// Mean of a state's error.
    pub fn mean(&self, state: usize) -> f64 {
        self.x[state]
    }

    /// Covariance of two states' errors.
    pub fn covariance(&self, one: usize, other: usize) -> f64 {
        self.p[(one, other)]
    }

    /// Mean and 1σ of the error of gravity, true − stated; zero where it is no state.
    pub fn gravity(&self) -> (f64, f64) {
        let of = |state: usize| (self.x[state], self.p[(state, state)].max(0.0).sqrt());
        self.layout.gravity().map_or((0.0, 0.0), of)
    }

    /// 1σ of the initial attitude error φ₀ of this stretch, East, North and Up.
    pub fn initial_attitude_sigma(&self) -> Vector3<f64> {
        let first = self.layout.initial_attitude();
        Vector3::from_fn(|axis, _| self.p[(first + axis, first + axis)].max(0.0).sqrt())
    }

    /// Mean of the initial attitude error φ₀ of this stretch.
    pub fn initial_attitude(&self) -> Vector3<f64> {
        self.at(self.layout.initial_attitude())
    }
}

/// What a pass with feedback takes out of the mean.
#[derive(Debug, Clone, Copy)]
pub(in crate::calibration) struct Feedback {
    pub attitude: Vector3<f64>,
    pub velocity: Vector3<f64>,
    pub position: Vector3<f64>,
    pub initial_attitude: Vector3<f64>,
    pub parameters: ParameterVector,
    pub terms: TermVector,
}

#[inline]
fn add_scaled<const N: usize>(sum: &mut [f64; N], column: &[f64; N], factor: f64) {
    for k in 0..N {
        sum[k] += column[k] * factor;
    }
}

/// `column += a x + b y`, each as long as the column at least.
#[inline]
fn add_both(column: &mut [f64], (a, x): (f64, &[f64]), (b, y): (f64, &[f64])) {
    let (x, y) = (&x[..column.len()], &y[..column.len()]);
    for k in 0..column.len() {
        column[k] += a * x[k] + b * y[k];
    }
}

/// `h v`
fn times(h: &[(usize, f64)], v: &[f64]) -> f64 {
    h.iter().map(|&(state, weight)| weight * v[state]).sum()
}

const _: () = assert!(NAVIGATION == crate::navigation::NAVIGATION);

#[cfg(test)]
mod tests;
