//! The error model over many samples, computed from integrals over a few samples at a time.

use std::sync::Arc;

use nalgebra::{Matrix3, RowVector3, Vector3, Vector4};

use super::block::{Block, State, TermColumn};
use super::errors::{ATTITUDE, POSITION, Rows, STATES, Span, VELOCITY};
use super::increments::Increments;
use super::instrument::{INPUTS, Response};
use super::process_noise::{NoiseInput, NoiseInputs};
use crate::attitude::skew;
use crate::imu::{PerSensor, Sensed, Sensor, Term, TermVector, ThermalState};

/// Integrals over a short stretch of samples.
///
/// The output of a triad is linear in `b = [u; 1]` (see [`crate::imu::Triad::response`]), so the integrals of
/// `C_b_n b_k` ([`INPUTS`]) hold the derivative with respect to every parameter of any misalignment form.
#[derive(Debug, Clone, Default)]
struct Part {
    /// ∫C_b_n b_k dt with the gyro input in b.
    gyro: Rows<3, INPUTS>,
    /// ∫[(∫f_n dt)×] C_b_n b_k dt with the gyros' input in b.
    forced: Rows<3, INPUTS>,
    /// ∫C_b_n b_k dt with the accelerometers' input in b.
    accel: Rows<3, INPUTS>,
    /// Length, specific force and motion.
    noise: NoiseInput,
}

/// Effect of one term parameter.
#[derive(Debug, Clone)]
struct TermErrors {
    parameter: usize,
    sensor: Sensor,
    /// ∫C_b_n ∂t/∂q dt over the part.
    input: Vector3<f64>,
    /// ∫[f_n×] (∫C_b_n ∂t/∂q dt) dt over the part.
    tilt: Vector3<f64>,
    /// C_b_n ∂t/∂q dt of the last sample.
    last: Option<Vector3<f64>>,
    errors: Rows<STATES, 1>,
}

/// The error model of successive samples, combined in short parts.
#[derive(Debug, Clone)]
pub struct Passage {
    /// Samples since the last part ended.
    part: Part,
    duration: f64,
    /// Φ of the navigation errors.
    navigation: Rows<STATES, STATES>,
    /// Effect of `C_b_n b_k` at the input of each triad on the navigation errors.
    inputs: PerSensor<Rows<STATES, INPUTS>>,
    /// Effect of a constant downward acceleration on the navigation errors.
    gravity: Rows<STATES, 1>,
    terms: Vec<TermErrors>,
    noise: NoiseInputs,
}

impl Passage {
    /// An empty interval, with this Earth rate in `n` and these term parameters, and capacity for this many parts.
    pub fn new(earth_rate: &Vector3<f64>, terms: &[usize], parts: usize) -> Self {
        let of_term = |&parameter: &usize| {
            Some(TermErrors {
                parameter,
                sensor: Term::of(parameter)?.entry().sensor,
                input: Vector3::zeros(),
                tilt: Vector3::zeros(),
                last: None,
                errors: Rows::<STATES, 1>::zeros(),
            })
        };
        Self {
            part: Part::default(),
            duration: 0.0,
            navigation: Rows::<STATES, STATES>::identity(),
            inputs: PerSensor::default(),
            gravity: Rows::<STATES, 1>::zeros(),
            terms: terms.iter().filter_map(of_term).collect(),
            noise: NoiseInputs {
                earth_rate: *earth_rate,
                parts: Vec::with_capacity(parts),
            },
        }
    }

    /// Adds a sample: attitude at its middle, increments along body axes, velocity change by
    /// specific force in `n`.
    #[inline]
    pub fn add(
        &mut self,
        attitude: &Matrix3<f64>,
        increments: &Increments,
        force: &Vector3<f64>,
        period: f64,
    ) {
        let part = &mut self.part;
        let input = increments.angle.push(period);
        add_outer(&mut part.gyro, attitude, &input);
        // The tilt at the middle of the sample acts on the force of the whole sample.
        let so_far = skew(part.noise.force + force * 0.5);
        add_outer(&mut part.forced, &(so_far * attitude), &input);
        let input = increments.velocity.push(period);
        add_outer(&mut part.accel, attitude, &input);
        part.noise.force += force;
        part.noise.duration += period;
    }

    /// Adds the motion of a sample of a move: the rotation relative to the Earth, rad, and the velocity change in
    /// excess of gravity, m/s.
    #[inline]
    pub fn add_motion(&mut self, turned: &Vector3<f64>, change: &Vector3<f64>, period: f64) {
        let noise = &mut self.part.noise;
        noise.motion.gyro += turned.norm_squared() / period;
        noise.motion.accel += change.norm_squared() / period;
        noise.moving += period;
    }

    /// Adds the error terms of a sample, with these values: attitude at its middle, sensed motion, velocity change by
    /// specific force in `n`.
    pub fn add_terms(
        &mut self,
        attitude: &Matrix3<f64>,
        sensed: &Sensed,
        values: &TermVector,
        force: &Vector3<f64>,
        period: f64,
    ) {
        let responses = PerSensor::from_fn(|sensor| sensed.response(sensor, values));
        for term in &mut self.terms {
            let response = responses.get(term.sensor).column(term.parameter);
            let step = attitude * response * period;
            // If the rate changes linearly from sample to sample, the tilt is smaller by a twelfth of the change.
            let change = step - term.last.unwrap_or(step);
            term.tilt += force.cross(&(term.input + step * 0.5 - change / 12.0));
            term.input += step;
            term.last = Some(step);
        }
    }

    /// Propagates all errors over the samples added since the last part. `bridged` is the covariance, in `n`, that
    /// interpolated samples of each triad add to the integral of its input over this part, rad² and (m/s)².
    pub fn end_part(&mut self, bridged: Option<Box<PerSensor<Matrix3<f64>>>>) {
        let mut part = std::mem::take(&mut self.part);
        let over = part.noise.span(&self.noise.earth_rate);
        over.carry(&mut self.navigation);
        // Effect of gyro tilts through specific force, ∫[f_n×] (∫C_b_n b_k dt) dt, integrated by parts.
        let tilt = part.gyro * skew(-over.force) - part.forced;
        drive(&mut self.inputs.gyro, &over, &part.gyro, Some(&tilt));
        drive(&mut self.inputs.accel, &over, &part.accel, None);
        // If the stated gravity is too small, the computed downward acceleration is too small.
        let up = RowVector3::new(0.0, 0.0, over.duration);
        drive(&mut self.gravity, &over, &up, None);
        for term in &mut self.terms {
            let [input, tilt] = [&mut term.input, &mut term.tilt].map(std::mem::take);
            let tilt = (term.sensor == Sensor::Gyro).then(|| tilt.transpose());
            drive(&mut term.errors, &over, &input.transpose(), tilt.as_ref());
        }
        self.duration += over.duration;
        part.noise.bridged = bridged;
        self.noise.parts.push(part.noise);
    }

    /// The block of all parts, ending in this computed state.
    pub fn block(
        self,
        state: State,
        responses: PerSensor<&Response>,
        thermal: Option<ThermalState>,
    ) -> Block {
        let parameters = |sensor| self.inputs.get(sensor).tr_mul(*responses.get(sensor));
        let of_term = |term: &TermErrors| TermColumn {
            parameter: term.parameter,
            column: term.errors.transpose(),
        };
        Block {
            state,
            duration: self.duration,
            navigation: Arc::new(self.navigation.transpose()),
            parameters: Arc::new(PerSensor::from_fn(parameters)),
            gravity: self.gravity.transpose(),
            terms: self.terms.iter().map(of_term).collect(),
            thermal: thermal.map(Box::new),
            noise: self.noise,
        }
    }
}

/// Adds the columns of a matrix, each multiplied by each of four weights.
#[inline]
fn add_outer(sum: &mut Rows<3, INPUTS>, matrix: &Matrix3<f64>, weights: &Vector4<f64>) {
    for row in 0..3 {
        for column in 0..3 {
            let mut of_column = sum.fixed_view_mut::<4, 1>(4 * column, row);
            of_column += weights * matrix[(row, column)];
        }
    }
}

/// Propagates errors over a part with this integrated input error of a triad. A gyro error causes tilt, which couples
/// with specific force.
#[inline]
fn drive<const N: usize>(
    errors: &mut Rows<STATES, N>,
    over: &Span,
    input: &Rows<3, N>,
    tilt: Option<&Rows<3, N>>,
) {
    over.carry(errors);
    let mut add = |kind: usize, rows: &Rows<3, N>, weight: f64| {
        let mut of_kind = errors.fixed_columns_mut::<3>(kind);
        of_kind += rows * weight;
    };
    match tilt {
        Some(tilt) => {
            add(ATTITUDE, input, -1.0);
            add(VELOCITY, tilt, -1.0);
            // A tilt that grows linearly with time changes velocity with t² and position with t³.
            add(POSITION, tilt, -over.duration / 3.0);
        }
        None => {
            add(VELOCITY, input, 1.0);
            add(POSITION, input, 0.5 * over.duration);
        }
    }
}
