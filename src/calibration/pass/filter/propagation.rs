//! The covariance over a block of navigation.

use super::Filter;
use crate::calibration::layout::{ATTITUDE, NAVIGATION};
use crate::calibration::parameters::sensor_and_parameter;
use crate::imu::{PerSensor, Sensor};
use crate::navigation::Block;

impl Filter {
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
}

#[inline]
fn add_scaled<const N: usize>(sum: &mut [f64; N], column: &[f64; N], factor: f64) {
    for k in 0..N {
        sum[k] += column[k] * factor;
    }
}
