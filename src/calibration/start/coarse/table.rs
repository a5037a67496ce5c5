//! The coarse start from dwells and turns with known attitude.

use std::ops::Range;

use nalgebra::Vector3;

use super::equations::{Equations, gauss_newton};
use super::heading::gyro_bias_at_rest;
use crate::attitude::log;
use crate::calibration::error::CalibrationError;
use crate::calibration::linearisation::singular;
use crate::calibration::model::Model;
use crate::calibration::parameters::from_vector;
use crate::calibration::problem::{Problem, Stretch};
use crate::imu::{PerSensor, Sensor, Triad};
use crate::navigation::{Block, Navigator, State};

/// Both triads from the table's attitude alone: over each dwell the velocity must stay zero and the
/// attitude must stay; over each turn between two dwells the gyros must turn by what the table says.
/// The prior ties down what these do not see.
pub fn from_table(problem: &Problem) -> Result<PerSensor<Triad>, CalibrationError> {
    let model = &problem.model;
    let mut first = from_vector(model.form, &model.prior_mean);
    first.gyro.bias = gyro_bias_at_rest(problem);
    gauss_newton(first, |triads| {
        let mut equations = Equations::new(model, triads, &Sensor::ALL);
        for stretch in problem.stretches() {
            add_legs(&mut equations, model, stretch, triads)?;
        }
        Ok(equations)
    })
}

fn add_legs(
    equations: &mut Equations,
    model: &Model,
    stretch: &Stretch,
    triads: &PerSensor<Triad>,
) -> Result<(), CalibrationError> {
    let run = stretch.run;
    let imu = &run.recording.imu;
    let walk = PerSensor::from_fn(|sensor| model.noise.get(sensor).random_walk);
    let attitude_variance = model.position_sigma.powi(2) + imu.pulse.gyro.powi(2) / 12.0;
    let at_rest = |attitude| {
        let state = State::at_rest(attitude);
        Navigator::new(imu, &run.site, triads, state).ok_or_else(|| singular(triads))
    };
    let mut before = None;
    for dwell in &stretch.dwells {
        let Some(attitude) = dwell.position.as_ref().map(|p| p.attitude) else {
            continue;
        };
        // φ of a block's end against the dwell's attitude.
        let error = |block: &Block| -> Vector3<f64> {
            -log(&(block.state.attitude * attitude.transpose()))
        };
        if let Some((end, start)) = before {
            let turn = at_rest(start)?.advance(end..dwell.samples.start);
            let variance = 2.0 * attitude_variance + walk.gyro.powi(2) * turn.duration;
            equations.add_block(&turn, 0, error(&turn), variance);
        }
        let mut navigator = at_rest(attitude)?;
        let Range { start, end } = dwell.samples;
        let first = stretch.steps.partition_point(|s| s.samples.start < start);
        let steps = stretch.steps[first..].iter();
        let of_dwell = steps.take_while(|step| step.samples.start < end);
        for at_rest in of_dwell.filter_map(|step| step.at_rest.as_ref()) {
            navigator.stand(&at_rest.sums);
        }
        let stand = navigator.standing(&navigator.state.attitude, dwell.samples.clone());
        let duration = stand.duration;
        let pulses = imu.pulse.gyro.powi(2) / 6.0;
        let variance = pulses + walk.gyro.powi(2) * duration;
        equations.add_block(&stand, 0, error(&stand), variance);
        // A tilt of the table turns gravity into velocity.
        let variance = (run.site.gravity * duration).powi(2) * attitude_variance
            + walk.accel.powi(2) * duration
            + imu.pulse.accel.powi(2) / 6.0;
        equations.add_block(&stand, 3, stand.state.velocity, variance);
        before = Some((dwell.samples.end, attitude));
    }
    Ok(())
}
