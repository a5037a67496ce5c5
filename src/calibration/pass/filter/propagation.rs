//! The covariance over a block of navigation.

use nalgebra::DMatrix;

use super::Filter;
use super::operation::Operation;
use crate::calibration::layout::{ATTITUDE, NAVIGATION};
use crate::calibration::parameters::sensor_and_parameter;
use crate::imu::{PerSensor, Sensor};
use crate::navigation::Block;

impl Filter {
    /// Carries mean and covariance over a block.
    pub fn propagate(&mut self, block: &Block) {
        match self.layout.turn_at_rest() {
            Some(_) => self.propagate_with::<{ NAVIGATION + 3 }>(block),
            None => self.propagate_with::<NAVIGATION>(block),
        }
        self.vary(block.duration);
    }

    /// Navigation errors move and, where there is one, the turn at rest.
    fn propagate_with<const MOVING: usize>(&mut self, block: &Block) {
        let turn = self.layout.turn_at_rest();
        let turn = turn.into_iter().flat_map(|turn| turn..turn + 3);
        let moving: Vec<usize> = (0..NAVIGATION).chain(turn).collect();
        // The turn does what the attitude does.
        let own = |place: usize| match place.checked_sub(NAVIGATION) {
            Some(axis) => ATTITUDE + axis,
            None => place,
        };
        let noise = self.noise_of_move::<MOVING>(block);
        let phi = self.moving_rows::<MOVING>(block);
        let on = self.layout.terms().count();
        let tried = self.layout.tried_terms().zip(&block.terms[on..]);
        let tried: Vec<_> = tried
            .map(|((k, _), term)| (k, std::array::from_fn(|place| term.column[own(place)])))
            .collect();
        self.carry(&phi, &moving, &noise, tried.into_iter());
    }

    /// Only the rows of Φ of the states that move differ from identity. Of `Φ P Φᵀ + Q` only their rows and
    /// columns change. `phi` holds these rows, a column for each of the first states; `tried` what
    /// parameters that are tried add.
    pub(super) fn carry<const MOVING: usize>(
        &mut self,
        phi: &[[f64; MOVING]],
        moving: &[usize],
        noise: &[[f64; MOVING]; MOVING],
        tried: impl Iterator<Item = (usize, [f64; MOVING])>,
    ) {
        let n = self.x.len();
        let mut x = [0.0; MOVING];
        let mut rows = vec![[0.0; MOVING]; n];
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
        let mut corner = *noise;
        for (k, row_of_corner) in corner.iter_mut().enumerate() {
            for (column, row) in phi.iter().zip(&rows) {
                add_scaled(row_of_corner, row, column[k]);
            }
        }
        for (state, row) in rows.iter().enumerate() {
            if !moving.contains(&state) {
                for (&moving, &covariance) in moving.iter().zip(row) {
                    self.p[(moving, state)] = covariance;
                    self.p[(state, moving)] = covariance;
                }
            }
        }
        for (column, &at_column) in moving.iter().enumerate() {
            self.x[at_column] = x[column];
            for (row, &at_row) in moving.iter().enumerate() {
                self.p[(at_row, at_column)] = corner[column][row];
            }
        }
        if let Some(tape) = &mut self.tape {
            tape.push(Operation::Carried {
                moving: moving.to_vec(),
                transition: DMatrix::from_fn(MOVING, phi.len(), |row, k| phi[k][row]),
            });
        }
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.propagate(phi, |place| moving[place], tried);
        }
    }

    /// The rows of Φ of the states that move, column by column: navigation errors, the states that drive
    /// them, the turn at rest.
    fn moving_rows<const MOVING: usize>(&self, block: &Block) -> Vec<[f64; MOVING]> {
        let driving = self.driving_columns(block).into_iter().enumerate();
        let driving = driving.map(|(state, column)| {
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

    /// What navigation errors, and each state that drives them, make of the navigation errors.
    pub(super) fn driving_columns(&self, block: &Block) -> Vec<[f64; NAVIGATION]> {
        let PerSensor { gyro, accel } = &*block.parameters;
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
        let gravity = self.layout.gravity().map(|_| block.gravity.column(0));
        let thermal = self.layout.thermal().map(|(_, coefficient)| {
            let weight = block.thermal.as_ref();
            let weight = weight.map_or(0.0, |state| coefficient.weight(state));
            of_triad(coefficient.sensor, coefficient.parameter) * weight
        });
        // A bias does the same whether it varies or stays.
        let varying = self.layout.varying_biases();
        let varying = varying.map(|(_, sensor, constant)| of_triad(sensor, constant));
        let own = self.layout.own().map(|(_, index)| {
            let (sensor, parameter) = sensor_and_parameter(index);
            of_triad(sensor, parameter)
        });
        let mut columns: Vec<[f64; NAVIGATION]> = Vec::new();
        let of = |column: &dyn Fn(usize) -> f64| std::array::from_fn(column);
        let constants = navigation.chain(parameters).chain(terms);
        columns.extend(constants.map(|column| of(&|row| column[row])));
        columns.extend(thermal.map(|column| of(&|row| column[row])));
        let rest = gravity.into_iter().chain(varying).chain(own);
        columns.extend(rest.map(|column| of(&|row| column[row])));
        columns
    }

    /// Varying biases forget as time goes by, and are driven.
    fn vary(&mut self, duration: f64) {
        for &(state, sigma, correlation_time) in &self.varying {
            let keep = (-duration / correlation_time).exp();
            self.x[state] *= keep;
            if let Some(tape) = &mut self.tape {
                tape.push(Operation::Varied {
                    state,
                    keep,
                    variance: sigma.powi(2) * (1.0 - keep * keep),
                });
            }
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
