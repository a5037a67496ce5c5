//! The closed form from dwells with attitudes of a table.

use nalgebra::{DMatrix, Vector3};

use super::both_triads::both_triads;
use super::observed::{Observed, Position};
use super::result::{ClosedForm, Reference, hidden};
use crate::attitude::skew;
use crate::calibration::error::CalibrationError;
use crate::calibration::model::Model;
use crate::calibration::problem::Problem;
use crate::imu::{PerSensor, Sensor};
use crate::run::{Dwell, MeanOutput, Run};
use crate::turntable::axis_response;

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
    let positions = |sensor| -> Result<Vec<Position>, CalibrationError> {
        let positions = dwells.iter().map(|dwell| position(run, dwell, sensor));
        let all: Option<_> = positions.collect();
        all.ok_or(CalibrationError::NoTable)
    };
    let mut used = vec![false; dwells.len()];
    let mut chosen = |sensor| -> Result<Observed, CalibrationError> {
        let all = positions(sensor)?;
        let of_six = six_of(&all);
        of_six.iter().for_each(|&k| used[k] = true);
        let noise = run.instrument.noise.get(sensor);
        let times = of_six.iter().map(|&k| dwells[k].times(run)).collect();
        let positions = of_six.iter().map(|&k| all[k]).collect();
        Ok(Observed {
            errors: errors(run, model, dwells, &of_six, sensor),
            base: of_base(run, dwells, &of_six, sensor),
            ..Observed::over(positions, times, noise)
        })
    };
    let chosen = PerSensor {
        gyro: chosen(Sensor::Gyro)?,
        accel: chosen(Sensor::Accel)?,
    };
    if chosen.gyro.positions.is_empty() {
        return Err(CalibrationError::NoDwells);
    }
    let (estimate, mut findings) = both_triads(&chosen, problem)?;
    findings.extend(hidden(model, &estimate, Reference::Table));
    let standing_time = dwells
        .iter()
        .zip(used)
        .filter(|(_, used)| *used)
        .map(|(dwell, _)| dwell.samples.len() as f64 * run.recording.imu.period)
        .sum();
    Ok(ClosedForm {
        noise: None,
        findings,
        estimate,
        reference: Reference::Table,
        positions: PerSensor::from_fn(|sensor| chosen.get(sensor).positions.len()),
        turns: 0,
        standing_time,
    })
}

/// What the triad senses of a site at rest, along East, North and Up.
fn known(run: &Run, sensor: Sensor) -> Vector3<f64> {
    match sensor {
        Sensor::Gyro => run.site.earth_rate_n(),
        Sensor::Accel => -run.site.gravity_n(),
    }
}

/// Mean output and known input over one dwell; `None` without a table.
fn position(run: &Run, dwell: &Dwell, sensor: Sensor) -> Option<Position> {
    let position = dwell.position.as_ref()?;
    let MeanOutput { output, variance } = dwell.mean(sensor, run);
    let variance = Vector3::repeat(variance);
    Some(Position {
        input: position.attitude.tr_mul(&known(run, sensor)),
        output,
        variance,
        weighted: variance,
    })
}

/// How the inputs of some dwells change with each error of the table, for one σ of it: base, axes, then
/// three for each dwell of the table, whichever are of the some.
///
/// An attitude that is wrong by `C_true = (I + [e×]) C_read` gives the input an error of
/// `C_readᵀ [u_n×] e`.
fn errors(
    run: &Run,
    model: &Model,
    dwells: &[Dwell],
    some: &[usize],
    sensor: Sensor,
) -> DMatrix<f64> {
    let of_axes: Vec<usize> = (0..model.geometry.axes.len())
        .filter(|&k| model.geometry.axes[k] > 0.0)
        .collect();
    let first = 3 + of_axes.len();
    let mut errors = DMatrix::zeros(3 * some.len(), first + 3 * dwells.len());
    let turned = skew(known(run, sensor));
    for (row, &number) in some.iter().enumerate() {
        let Some(position) = &dwells[number].position else {
            continue;
        };
        let of_attitude = position.attitude.tr_mul(&turned);
        let mut set = |column: usize, turn: Vector3<f64>| {
            let of_input = of_attitude * turn;
            errors
                .fixed_view_mut::<3, 1>(3 * row, column)
                .copy_from(&of_input);
        };
        let axes = run.recording.table.as_ref().map(|table| &table.axes);
        let axes = axes.and_then(|axes| axes.get(position.readings.start));
        if let Some(response) = axes.map(axis_response) {
            for (column, &k) in of_axes.iter().enumerate() {
                set(3 + column, response.column(k) * model.geometry.axes[k]);
            }
        }
        let of_dwell = model
            .position_sigma
            .hypot(model.reading_sigma / (position.readings.len() as f64).sqrt());
        for axis in 0..3 {
            let about = Vector3::ith(axis, 1.0);
            set(axis, about * model.geometry.base[axis]);
            set(first + 3 * number + axis, about * of_dwell);
        }
    }
    errors
}

/// How the inputs of some dwells change with a turn of the base by 1 rad.
fn of_base(run: &Run, dwells: &[Dwell], some: &[usize], sensor: Sensor) -> DMatrix<f64> {
    let mut of_base = DMatrix::zeros(3 * some.len(), 3);
    let turned = skew(known(run, sensor));
    for (row, &number) in some.iter().enumerate() {
        if let Some(position) = &dwells[number].position {
            let of_input = position.attitude.tr_mul(&turned);
            of_base
                .fixed_view_mut::<3, 3>(3 * row, 0)
                .copy_from(&of_input);
        }
    }
    of_base
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
