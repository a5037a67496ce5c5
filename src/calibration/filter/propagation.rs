//! Propagation of the covariance over a block of navigation.

use nalgebra::DMatrix;

use super::Filter;
use crate::calibration::budget::source::BudgetSource;
use crate::calibration::several::day_to_day::OwnState;
use crate::calibration::{
    ATTITUDE, Constant, DisturbanceKind, NAVIGATION, ParameterVector, VELOCITY, parameter,
    sensor_and_parameter,
};
use crate::imu::{PARAMETERS as PER_TRIAD, PerSensor, Sensor};
use crate::navigation::{Block, ErrorMatrix};

impl Filter {
    /// Propagates mean and covariance over a block of a move.
    pub fn propagate(&mut self, block: &Block) {
        let moving = self.moving_in_moves();
        let count = moving.len();
        let of_block = (&self.noise_of(block), block.duration);
        let noise = DMatrix::from_fn(count, count, |row, column| {
            self.noise_of_moving(of_block, row, column)
        });
        let driving = self.driving_columns(block);
        let transition =
            DMatrix::from_fn(
                count,
                driving.len() + count - NAVIGATION,
                |row, k| match driving.get(k) {
                    Some(column) => of_moving(column, row, k),
                    None => f64::from(moving[row] == k),
                },
            );
        let constants: Vec<_> = self.constant_effects(block).collect();
        let added = DMatrix::from_fn(constants.len(), count, |k, place| constants[k][own(place)]);
        self.carry(&moving, transition, &noise, &added);
        self.vary(block.duration);
    }

    /// The states that a move drives: navigation errors and the rotation at rest, if it is a state.
    pub fn moving_in_moves(&self) -> Vec<usize> {
        let turn = self.layout.turn_at_rest;
        let turn = turn.into_iter().flat_map(|turn| turn..turn + 3);
        (0..NAVIGATION).chain(turn).collect()
    }

    /// Only the rows of Φ of the moving states differ from identity, so only their rows and columns of `Φ P Φᵀ + Q`
    /// change. `transition` contains these rows, with a column for each of the first states; `added` contains the
    /// effect of constants, one row each.
    pub fn carry(
        &mut self,
        moving: &[usize],
        transition: DMatrix<f64>,
        noise: &DMatrix<f64>,
        added: &DMatrix<f64>,
    ) {
        let first = transition.ncols();
        let x = &transition * self.x.rows(0, first);
        let rows = &transition * self.p.rows(0, first);
        let corner = rows.columns(0, first) * transition.transpose() + noise;
        for (place, &state) in moving.iter().enumerate() {
            self.x[state] = x[place];
            self.p.set_row(state, &rows.row(place));
            self.p.set_column(state, &rows.row(place).transpose());
        }
        for (column, &at_column) in moving.iter().enumerate() {
            for (row, &at_row) in moving.iter().enumerate() {
                self.p[(at_row, at_column)] = corner[(row, column)];
            }
        }
        let u = &mut self.columns.of_states;
        let moved = u.columns(0, first) * transition.transpose() + added;
        for (&state, column) in moving.iter().zip(moved.column_iter()) {
            u.column_mut(state).copy_from(&column);
        }
    }

    /// Covariance that a block adds to the navigation errors.
    pub fn noise_of(&self, block: &Block) -> ErrorMatrix {
        let mut noise = block.noise.covariance(&self.noise);
        // Of interpolated samples alone, which no density scales.
        if let Some((BudgetSource::Interpolated, factor)) = self.model.varied {
            noise += block.noise.covariance(&PerSensor::default()) * (factor - 1.0);
        }
        noise
    }

    /// Covariance that a block adds to two moving states, given its addition to the navigation errors and its duration:
    /// the rotation has the noise of the attitude plus its own.
    pub fn noise_of_moving(
        &self,
        (of_navigation, duration): (&ErrorMatrix, f64),
        row: usize,
        column: usize,
    ) -> f64 {
        let alone = f64::from(row == column && row >= NAVIGATION);
        let weight = self.model.weight(BudgetSource::RotationAtRest);
        let turning = self.model.turning_at_rest.powi(2) * weight * duration;
        of_navigation[(own(row), own(column))] + alone * turning
    }

    /// Effect of the navigation errors, and of each state that drives them, on the navigation errors.
    pub fn driving_columns(&self, block: &Block) -> Vec<[f64; NAVIGATION]> {
        let layout = &self.layout;
        let navigation = block.navigation.column_iter();
        let navigation = navigation.map(|column| std::array::from_fn(|row| column[row]));
        let gravity = layout.gravity.map(|_| Constant::Gravity);
        let gravity = gravity.map(|gravity| self.effect(block, gravity));
        let earth_rate = layout.earth_rate.into_iter().flat_map(|_| 0..3);
        let earth_rate = earth_rate.map(|axis| of_earth_rate(block, axis));
        // A bias does the same whether it varies or stays.
        let varying = layout.varying_biases.iter();
        let varying = varying.map(|&(_, sensor, constant)| effect_of(block, sensor, constant));
        let own = layout.own.iter().map(|&(_, own)| match own {
            OwnState::Parameter(index) => self.effect(block, Constant::Parameter(index)),
            OwnState::Mounting(axis) => {
                let turned = self.turned.as_ref();
                let by_axis = turned.map(|turned| turned.by_mounting.column(axis).into_owned());
                by_axis.map_or([0.0; NAVIGATION], |by_axis| of_parameters(block, &by_axis))
            }
        });
        navigation
            .chain(gravity)
            .chain(earth_rate)
            .chain(varying)
            .chain(own)
            .collect()
    }

    /// Effect of each constant on the navigation errors.
    pub fn constant_effects<'a>(
        &'a self,
        block: &'a Block,
    ) -> impl Iterator<Item = [f64; NAVIGATION]> + 'a {
        let constants = self.layout.constants.iter();
        constants.map(|&constant| self.effect(block, constant))
    }

    fn effect(&self, block: &Block, constant: Constant) -> [f64; NAVIGATION] {
        match constant {
            Constant::Parameter(index) => match &self.turned {
                // On an instrument that is turned, it does what those of the turned one do that it changes.
                Some(turned) => {
                    of_parameters(block, &turned.by_parameters.column(index).into_owned())
                }
                None => {
                    let (sensor, parameter) = sensor_and_parameter(index);
                    effect_of(block, sensor, parameter)
                }
            },
            Constant::Term(index) => {
                let term = block.terms.iter().find(|term| term.parameter == index);
                term.map_or([0.0; NAVIGATION], |term| {
                    std::array::from_fn(|row| term.column[row])
                })
            }
            Constant::Thermal(coefficient) => {
                let weight = block.thermal.as_ref();
                let weight = weight.map_or(0.0, |state| coefficient.weight(state));
                effect_of(block, coefficient.sensor, coefficient.parameter).map(|by| by * weight)
            }
            Constant::Gravity => std::array::from_fn(|row| block.gravity[row]),
            Constant::Disturbance(of, component) => match of.kind {
                DisturbanceKind::BiasStep(sensor) => {
                    let bias = parameter(sensor, PER_TRIAD - 3 + component);
                    let side = if self.dwells > of.dwell { 0.5 } else { -0.5 };
                    self.effect(block, Constant::Parameter(bias))
                        .map(|by| side * by)
                }
                DisturbanceKind::EarthRate => of_earth_rate(block, component),
                DisturbanceKind::Position | DisturbanceKind::Slip => [0.0; NAVIGATION],
            },
            Constant::Base(_) | Constant::Axis(_) => [0.0; NAVIGATION],
        }
    }

    /// Propagates varying biases: decay and process noise.
    pub fn vary(&mut self, duration: f64) {
        for k in 0..self.varying.len() {
            let (state, sigma, correlation_time) = self.varying[k];
            let keep = (-duration / correlation_time).exp();
            self.x[state] *= keep;
            self.columns.of_states.column_mut(state).scale_mut(keep);
            self.p.row_mut(state).scale_mut(keep);
            self.p.column_mut(state).scale_mut(keep);
            let driven = sigma.powi(2) * self.weight_of(state);
            self.p[(state, state)] += driven * (1.0 - keep * keep);
        }
    }
}

/// The navigation error that a moving state follows: the rotation at rest follows the attitude.
pub fn own(place: usize) -> usize {
    match place.checked_sub(NAVIGATION) {
        Some(axis) => ATTITUDE + axis,
        None => place,
    }
}

/// Effect of a state `k`, with this column of effects on the navigation errors, on a moving state; for the rotation at
/// rest, the change of the attitude error.
pub fn of_moving(column: &[f64; NAVIGATION], row: usize, k: usize) -> f64 {
    column[own(row)] - f64::from(row >= NAVIGATION && own(row) == k)
}

/// Effect of a parameter of a triad on the navigation errors.
pub fn effect_of(block: &Block, sensor: Sensor, parameter: usize) -> [f64; NAVIGATION] {
    let columns = block.parameters.get(sensor);
    std::array::from_fn(|row| columns[(row, parameter)])
}

/// Effect of a change of Earth rate along East, North or Up on the navigation errors.
fn of_earth_rate(block: &Block, axis: usize) -> [f64; NAVIGATION] {
    let mut column = [0.0; NAVIGATION];
    column[ATTITUDE + axis] = -block.duration;
    for (row, velocity) in column.iter_mut().enumerate().skip(VELOCITY).take(3) {
        // The tilt grows evenly.
        *velocity = -0.5 * block.duration * block.navigation[(row, ATTITUDE + axis)];
    }
    column
}

/// Effect of a change of the parameters of both triads on the navigation errors.
fn of_parameters(block: &Block, change: &ParameterVector) -> [f64; NAVIGATION] {
    let of = |sensor: Sensor| {
        let change = change.fixed_rows::<PER_TRIAD>(parameter(sensor, 0));
        block.parameters.get(sensor) * change
    };
    let sum = of(Sensor::Gyro) + of(Sensor::Accel);
    std::array::from_fn(|row| sum[row])
}
