//! What a filter does to its errors, one operation after the other: enough to follow an error of its
//! estimate back to where it comes from.

use nalgebra::DMatrix;

use super::Filter;
use super::operation::{Driver, Operation};
use crate::calibration::layout::{ATTITUDE, NAVIGATION};
use crate::imu::{PerSensor, Sensor};
use crate::navigation::{Block, ProcessNoise};

impl Filter {
    /// Begins to keep what is done to the errors.
    pub fn keep(&mut self) {
        self.tape = Some(Vec::new());
    }

    /// What was done since it was asked last.
    pub fn kept(&mut self) -> Vec<Operation> {
        self.tape.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// The same filter driven by one kind of noise alone; none where there is no such noise.
    ///
    /// That of interpolated samples does not depend on the filter and is in all of them.
    pub fn driven_by(&self, driver: Driver) -> Option<Self> {
        let mut noise = PerSensor::from_fn(|_| ProcessNoise::default());
        let mut turning = 0.0;
        let mut wandering = None;
        match driver {
            Driver::White(sensor) => {
                noise.get_mut(sensor).random_walk = self.noise.get(sensor).random_walk;
            }
            Driver::Moves(sensor) => {
                *noise.get_mut(sensor) = ProcessNoise {
                    random_walk: 0.0,
                    ..*self.noise.get(sensor)
                };
            }
            Driver::Wander(sensor) => wandering = Some(sensor),
            Driver::Turning => turning = self.turning,
            Driver::Interpolated => {}
        }
        let sensors = self.layout.varying_biases();
        let varying = sensors.zip(&self.varying);
        let varying = varying.map(|((_, sensor, _), &(state, sigma, correlation_time))| {
            let drives = wandering == Some(sensor);
            (state, if drives { sigma } else { 0.0 }, correlation_time)
        });
        let varying: Vec<_> = varying.collect();
        let there = driver == Driver::Interpolated
            || turning > 0.0
            || varying.iter().any(|&(_, sigma, _)| sigma > 0.0)
            || Sensor::ALL
                .into_iter()
                .any(|sensor| *noise.get(sensor) != ProcessNoise::default());
        there.then(|| Self {
            layout: self.layout.clone(),
            x: self.x.clone(),
            p: DMatrix::zeros(0, 0),
            noise,
            turning,
            varying,
            day_to_day: self.day_to_day,
            turned: self.turned.clone(),
            sensitivity: None,
            tape: None,
        })
    }

    /// Covariance that a block of a move adds to the states that move: navigation errors and, where there is
    /// one, the turn at rest.
    pub fn noise_of_move<const MOVING: usize>(&self, block: &Block) -> [[f64; MOVING]; MOVING] {
        // The turn has the noise of the attitude, and its own.
        let own = |place: usize| match place.checked_sub(NAVIGATION) {
            Some(axis) => ATTITUDE + axis,
            None => place,
        };
        let of_navigation = block.noise.covariance(&self.noise);
        let mut noise = [[0.0; MOVING]; MOVING];
        for (row, of_row) in noise.iter_mut().enumerate() {
            for (column, noise) in of_row.iter_mut().enumerate() {
                *noise = of_navigation[(own(row), own(column))];
            }
            if row >= NAVIGATION {
                of_row[row] += self.turning.powi(2) * block.duration;
            }
        }
        noise
    }
}
