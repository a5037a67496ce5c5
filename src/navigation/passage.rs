//! The error model of many samples from the integrals over a few at a time.

use std::sync::Arc;

use nalgebra::{Matrix3, SVector, Vector3};

use super::block::{Block, BlockMatrix, CorrectedResponse, NAVIGATION, ParameterBlock, TermColumn};
use super::moments::Moments;
use super::process_noise::{NoiseInput, NoiseInputs};
use super::state::State;
use super::transition::{Errors, Transition};
use super::vectors::Vectors;
use crate::imu::{PerSensor, Sensor, ThermalState};

/// The error model of short stretches of samples, one after the other.
#[derive(Debug, Clone)]
pub(super) struct Passage {
    earth_rate: Vector3<f64>,
    duration: f64,
    /// Φ of the navigation errors: attitude, velocity and position by a column of each.
    navigation: Errors<NAVIGATION>,
    /// What `C_b_n b_k` at the input of each triad makes of the navigation errors.
    inputs: PerSensor<Errors<12>>,
    /// The same of a constant pull downwards.
    gravity: Errors<1>,
    terms: Vec<(usize, Errors<1>)>,
    noise: NoiseInputs,
}

impl Passage {
    /// Of no time, with these term parameters on.
    pub fn new(earth_rate: &Vector3<f64>, terms: &[usize]) -> Self {
        let mut navigation = Errors::<NAVIGATION>::default();
        for axis in 0..3 {
            navigation.attitude.0[axis][axis] = 1.0;
            navigation.velocity.0[axis][3 + axis] = 1.0;
            navigation.position.0[axis][6 + axis] = 1.0;
        }
        Self {
            earth_rate: *earth_rate,
            duration: 0.0,
            navigation,
            inputs: PerSensor::from_fn(|_| Errors::default()),
            gravity: Errors::default(),
            terms: terms.iter().map(|&k| (k, Errors::default())).collect(),
            noise: NoiseInputs::new(*earth_rate),
        }
    }

    /// Goes on over a short stretch. `bridged` is the covariance, in `n`, that interpolated samples of each
    /// triad add to the integral of its input over it, rad² and (m/s)².
    pub fn add(&mut self, moments: &Moments, bridged: PerSensor<Matrix3<f64>>) {
        let t = moments.duration;
        let over = Transition {
            earth_turn: self.earth_rate * t,
            force: moments.force,
            duration: t,
        };
        over.carry(&mut self.navigation);
        let PerSensor { gyro, accel } = &mut self.inputs;
        over.carry(gyro);
        gyro.attitude.add(-1.0, &moments.gyro);
        let tilt = moments.tilt();
        gyro.velocity.add(-1.0, &tilt);
        // A tilt that grows with time moves velocity with t² and position with t³.
        gyro.position.add(-t / 3.0, &tilt);
        over.carry(accel);
        accel.velocity.add(1.0, &moments.accel);
        accel.position.add(0.5 * t, &moments.accel);
        over.carry(&mut self.gravity);
        // Stated gravity that is too small pulls the computed velocity down too little.
        self.gravity.velocity.0[2][0] += t;
        self.gravity.position.0[2][0] += 0.5 * t * t;
        for ((_, errors), moment) in self.terms.iter_mut().zip(&moments.terms) {
            over.carry(errors);
            let (input, tilt) = (column(&moment.input), column(&moment.tilt));
            match moment.sensor {
                Sensor::Gyro => {
                    errors.attitude.add(-1.0, &input);
                    errors.velocity.add(-1.0, &tilt);
                    errors.position.add(-t / 3.0, &tilt);
                }
                Sensor::Accel => {
                    errors.velocity.add(1.0, &input);
                    errors.position.add(0.5 * t, &input);
                }
            }
        }
        self.duration += t;
        // Of no time there is no mean, and no noise either.
        if t > 0.0 {
            let mut part = NoiseInput::bridging(t, moments.force / t, bridged);
            part.motion = moments.motion;
            part.moving = moments.moving;
            self.noise.push(part);
        }
    }

    /// The block of all that was added, which ends in this computed state.
    pub fn block(
        self,
        state: State,
        responses: PerSensor<&CorrectedResponse>,
        thermal: Option<ThermalState>,
    ) -> Block {
        let parameters = PerSensor::from_fn(|sensor| {
            let errors = self.inputs.get(sensor);
            let columns = responses.get(sensor).columns();
            ParameterBlock::from_columns(&columns.map(|weights| errors.times(&weights)))
        });
        let terms = self.terms.iter().map(|(parameter, errors)| TermColumn {
            parameter: *parameter,
            column: errors.times(&SVector::repeat(1.0)),
        });
        Block {
            state,
            duration: self.duration,
            navigation: Arc::new(BlockMatrix::from_fn(|row, column| {
                self.navigation.component(row, column)
            })),
            parameters: Arc::new(parameters),
            gravity: self.gravity.times(&SVector::repeat(1.0)),
            terms: terms.collect(),
            thermal: thermal.map(Box::new),
            noise: self.noise.shrunk(),
        }
    }
}

fn column(v: &Vector3<f64>) -> Vectors<1> {
    Vectors([[v.x], [v.y], [v.z]])
}
