//! The covariance over a block of navigation.

use nalgebra::DMatrix;

use super::Filter;
use crate::calibration::budget::source::BudgetSource;
use crate::calibration::layout::{ATTITUDE, NAVIGATION};
use crate::calibration::parameters::sensor_and_parameter;
use crate::calibration::several::day_to_day::OwnState;
use crate::imu::{PerSensor, Sensor};
use crate::navigation::{Block, ErrorMatrix};

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
        let driving = self.driving_columns(block);
        let transition = DMatrix::from_fn(MOVING, driving.len() + MOVING - NAVIGATION, |row, k| {
            match (driving.get(k), row < NAVIGATION) {
                (Some(column), true) => column[row],
                // By as much as the attitude error has changed.
                (Some(column), false) => column[own(row)] - f64::from(own(row) == k),
                (None, _) => f64::from(moving[row] == k),
            }
        });
        let on = self.layout.terms().count();
        let mut tried = DMatrix::zeros(self.layout.tried(), MOVING);
        for ((k, _), term) in self.layout.tried_terms().zip(&block.terms[on..]) {
            for place in 0..MOVING {
                tried[(k, place)] = term.column[own(place)];
            }
        }
        self.carry(&moving, transition, &noise, &tried);
    }

    /// Only the rows of Φ of the states that move differ from identity. Of `Φ P Φᵀ + Q` only their rows and
    /// columns change. `transition` holds these rows, a column for each of the first states; `tried` what
    /// parameters that are tried add, a row each.
    pub fn carry(
        &mut self,
        moving: &[usize],
        transition: DMatrix<f64>,
        noise: &DMatrix<f64>,
        tried: &DMatrix<f64>,
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
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.propagate(moving, &transition, tried);
        }
    }

    /// Covariance that a block adds to the navigation errors.
    pub fn noise_of(&self, block: &Block) -> ErrorMatrix {
        let mut noise = block.noise.covariance(&self.noise);
        // Of interpolated samples alone, which no density scales.
        if let Some((BudgetSource::Interpolated, factor)) = self.varied {
            noise += block.noise.covariance(&PerSensor::default()) * (factor - 1.0);
        }
        noise
    }

    /// Covariance that a block of a move adds to the states that move: navigation errors and, where there is
    /// one, the turn at rest.
    fn noise_of_move<const MOVING: usize>(&self, block: &Block) -> DMatrix<f64> {
        // The turn has the noise of the attitude, and its own.
        let own = |place: usize| match place.checked_sub(NAVIGATION) {
            Some(axis) => ATTITUDE + axis,
            None => place,
        };
        let of_navigation = self.noise_of(block);
        DMatrix::from_fn(MOVING, MOVING, |row, column| {
            let alone = row == column && row >= NAVIGATION;
            let turning = self.turning.powi(2) * block.duration;
            of_navigation[(own(row), own(column))] + if alone { turning } else { 0.0 }
        })
    }

    /// What navigation errors, and each state that drives them, make of the navigation errors.
    pub fn driving_columns(&self, block: &Block) -> Vec<[f64; NAVIGATION]> {
        let PerSensor { gyro, accel } = &*block.parameters;
        let of_triad = |sensor: Sensor, parameter: usize| match sensor {
            Sensor::Gyro => gyro.column(parameter),
            Sensor::Accel => accel.column(parameter),
        };
        let of_parameter = |index: usize| {
            let (sensor, parameter) = sensor_and_parameter(index);
            of_triad(sensor, parameter)
        };
        // On an instrument that is turned, parameters do what those of the turned one do that they change.
        let of_turned = |direction: &[f64], row: usize| -> f64 {
            let of = |(index, by): (usize, &f64)| of_parameter(index)[row] * by;
            direction.iter().enumerate().map(of).sum()
        };
        let of_common = |index: usize, row: usize| match &self.turned {
            Some(turned) => of_turned(turned.by_parameters.column(index).as_slice(), row),
            None => of_parameter(index)[row],
        };
        let mut columns: Vec<[f64; NAVIGATION]> = Vec::with_capacity(self.x.len());
        let mut add = |column: &dyn Fn(usize) -> f64| columns.push(std::array::from_fn(column));
        for column in block.navigation.column_iter() {
            add(&|row| column[row]);
        }
        for (_, index) in self.layout.parameters() {
            add(&|row| of_common(index, row));
        }
        for term in block.terms.iter().take(self.layout.terms().count()) {
            add(&|row| term.column[row]);
        }
        for (_, coefficient) in self.layout.thermal() {
            let weight = block.thermal.as_ref();
            let weight = weight.map_or(0.0, |state| coefficient.weight(state));
            let column = of_triad(coefficient.sensor, coefficient.parameter);
            add(&|row| column[row] * weight);
        }
        if self.layout.gravity().is_some() {
            add(&|row| block.gravity[row]);
        }
        // A bias does the same whether it varies or stays.
        for (_, sensor, constant) in self.layout.varying_biases() {
            add(&|row| of_triad(sensor, constant)[row]);
        }
        for (_, own) in self.layout.own() {
            match own {
                OwnState::Parameter(index) => add(&|row| of_common(index, row)),
                OwnState::Mounting(axis) => {
                    let turned = self.turned.as_ref();
                    let direction = turned.map(|turned| turned.by_mounting.column(axis));
                    let direction = direction.as_ref().map_or(&[][..], |d| d.as_slice());
                    add(&|row| of_turned(direction, row));
                }
            }
        }
        columns
    }

    /// Varying biases forget as time goes by, and are driven.
    pub fn vary(&mut self, duration: f64) {
        for k in 0..self.varying.len() {
            let (state, sigma, correlation_time) = self.varying[k];
            let keep = (-duration / correlation_time).exp();
            self.x[state] *= keep;
            if let Some(sensitivity) = &mut self.sensitivity {
                sensitivity.scale(state, keep);
            }
            self.p.row_mut(state).scale_mut(keep);
            self.p.column_mut(state).scale_mut(keep);
            let driven = sigma.powi(2) * self.weight_of(state);
            self.p[(state, state)] += driven * (1.0 - keep * keep);
        }
    }
}
