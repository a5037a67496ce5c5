//! The closed form from dwells with attitudes of a table.

use nalgebra::Vector3;

use super::super::error::CalibrationError;
use super::super::model::Model;
use super::super::problem::Problem;
use super::least_squares::{Position, across, both_triads};
use super::result::{ClosedForm, Reference, remarks};
use crate::imu::{PerSensor, Sensor};
use crate::run::{Dwell, MeanOutput, Run};

/// A reference vector within this cosine of a body axis makes a position of the six.
const ALONG_AXIS: f64 = 0.9998;

/// The same from some dwells of the problem's first run with attitudes of a table, or parts of them.
///
/// # Errors
/// As [`super::six_position`], and without a table.
pub fn six_position_of(
    problem: &Problem,
    dwells: &[Dwell],
) -> Result<ClosedForm, CalibrationError> {
    let (run, model) = (problem.run(), &problem.model);
    let mut chosen = PerSensor::<Vec<Position>>::default();
    let mut used = vec![false; dwells.len()];
    for sensor in Sensor::ALL {
        let all: Vec<Position> = dwells
            .iter()
            .map(|dwell| position(run, model, dwell, sensor))
            .collect::<Option<_>>()
            .ok_or(CalibrationError::NoTable)?;
        let of_six = six_of(&all);
        of_six.iter().for_each(|&k| used[k] = true);
        *chosen.get_mut(sensor) = of_six.iter().map(|&k| all[k]).collect();
    }
    if chosen.gyro.is_empty() {
        return Err(CalibrationError::NoDwells);
    }
    let estimate = both_triads(&chosen, problem)?;
    let standing_time = dwells
        .iter()
        .zip(used)
        .filter(|(_, used)| *used)
        .map(|(dwell, _)| dwell.samples.len() as f64 * run.recording.imu.period)
        .sum();
    Ok(ClosedForm {
        findings: remarks(model, &estimate, Reference::Table),
        estimate,
        reference: Reference::Table,
        positions: PerSensor::from_fn(|sensor| chosen.get(sensor).len()),
        turns: 0,
        standing_time,
    })
}

/// Mean output and known input over one dwell; `None` without a table.
fn position(run: &Run, model: &Model, dwell: &Dwell, sensor: Sensor) -> Option<Position> {
    let position = dwell.position.as_ref()?;
    let known = match sensor {
        Sensor::Gyro => run.site.earth_rate_n(),
        Sensor::Accel => -run.site.gravity_n(),
    };
    let MeanOutput {
        output,
        variance: noise,
    } = dwell.mean(sensor, run);
    let input = position.attitude.tr_mul(&known);
    let attitude =
        model.position_sigma.powi(2) + model.reading_sigma.powi(2) / position.readings.len() as f64;
    // A wrong attitude turns the other two components of the input into a third.
    let variance = Vector3::repeat(noise) + across(&input) * attitude;
    Some(Position {
        input,
        output,
        variance,
        weighted: variance,
    })
}

/// The positions whose input lies along a body axis, if all six are there, else all.
fn six_of(positions: &[Position]) -> Vec<usize> {
    let along = |k: usize| -> Option<(usize, bool)> {
        let input = positions[k].input;
        let axis = input.iamax();
        (input[axis].abs() > ALONG_AXIS * input.norm()).then_some((axis, input[axis] > 0.0))
    };
    let six: Vec<usize> = (0..positions.len())
        .filter(|&k| along(k).is_some())
        .collect();
    let complete = (0..3).all(|axis| {
        [true, false]
            .iter()
            .all(|&up| six.iter().any(|&k| along(k) == Some((axis, up))))
    });
    if complete {
        six
    } else {
        (0..positions.len()).collect()
    }
}
