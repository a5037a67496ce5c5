//! Equations from the attitudes of a table.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::equations::{Common, Equations, Partials, Rows, of};
use super::gravity::ROUNDING;
use super::positions::{Known, Observed, Position};
use crate::attitude::{log, skew};
use crate::calibration::linearisation::singular;
use crate::calibration::problem::Stretch;
use crate::calibration::{CalibrationError, Problem};
use crate::earth::Site;
use crate::imu::{PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad};
use crate::navigation::{Block, Navigator, State};
use crate::run::{Dwell, MeanOutput};
use crate::turntable::axis_response;

/// Input of a triad at rest at a site, along East, North and Up.
pub fn sensed(site: &Site, sensor: Sensor) -> Vector3<f64> {
    match sensor {
        Sensor::Gyro => site.earth_rate_n(),
        Sensor::Accel => -site.gravity_n(),
    }
}

/// Mean outputs in some dwells of the first run of the problem, with inputs from the table attitudes; `None` without a
/// table.
///
/// An attitude error `C_true = (I + [e×]) C_read` causes an input error of `C_readᵀ [u_n×] e`, where e consists of the
/// errors of base, axes, position and readings.
pub fn positions(problem: &Problem, dwells: &[Dwell], sensor: Sensor) -> Option<Observed> {
    let (run, model) = (problem.run(), &problem.model);
    let axes = &model.geometry.axes;
    let sensed = sensed(&run.site, sensor);
    let known = dwells.iter().enumerate().map(|(number, dwell)| {
        let position = dwell.position.as_ref()?;
        let MeanOutput { output, variance } = dwell.mean(sensor, run);
        let variance = Vector3::repeat(variance);
        let of_input = position.attitude.tr_mul(&skew(sensed));
        let of_base = Matrix3::from_diagonal(&model.geometry.base);
        let mut errors = vec![(Common::Table(0), of_input * of_base)];
        let angles = run.recording.table.as_ref().map(|table| &table.axes);
        if let Some(angles) = angles.and_then(|of| of.get(position.readings.start)) {
            let response = axis_response(angles);
            for k in (0..axes.len()).filter(|&k| axes[k] > 0.0) {
                let mut of_axis = Matrix3::zeros();
                of_axis.set_column(0, &(of_input * response.column(k) * axes[k]));
                errors.push((Common::Table(1 + k), of_axis));
            }
        }
        let readings = position.readings.len() as f64;
        let of_dwell = model
            .position_sigma
            .hypot(model.reading_sigma / readings.sqrt());
        errors.push((Common::Unit(number), of_input * of_dwell));
        Some(Known {
            position: Position {
                input: position.attitude.tr_mul(&sensed),
                output,
                variance,
                weighted: variance,
            },
            times: dwell.times(run),
            errors,
        })
    });
    Some(Observed {
        sensor,
        noise: *run.instrument.noise.get(sensor),
        known: known.collect::<Option<_>>()?,
    })
}

/// Equations of both triads. In each dwell, the velocity must stay zero and the attitude must stay constant; over each
/// move between two dwells, the gyros must measure the rotation of the table.
pub fn carried(
    problem: &Problem,
    triads: &PerSensor<Triad>,
) -> Result<Equations, CalibrationError> {
    let mut equations = Equations::of_triads(&problem.model, triads, &Sensor::ALL);
    for stretch in problem.stretches() {
        let mut before = None;
        let dwells = stretch.dwells.iter();
        for dwell in dwells.filter(|dwell| dwell.position.is_some()) {
            add_carried(&mut equations, problem, stretch, triads, (before, dwell))?;
            before = Some(dwell);
        }
    }
    Ok(equations)
}

/// Adds a dwell and the move before it.
fn add_carried(
    equations: &mut Equations,
    problem: &Problem,
    stretch: &Stretch,
    triads: &PerSensor<Triad>,
    (before, dwell): (Option<&Dwell>, &Dwell),
) -> Result<(), CalibrationError> {
    let read = |dwell: &Dwell| dwell.position.as_ref().map(|position| position.attitude);
    let Some(attitude) = read(dwell) else {
        return Ok(());
    };
    let (run, model) = (stretch.run, &problem.model);
    let imu = &run.recording.imu;
    let walk = PerSensor::from_fn(|sensor| model.noise.get(sensor).random_walk.powi(2));
    let attitude_variance = model.position_sigma.powi(2) + imu.pulse.gyro.powi(2) / 12.0;
    let at_rest = |attitude| {
        let state = State::at_rest(attitude);
        Navigator::new(imu, &run.site, triads, state).ok_or_else(|| singular(triads))
    };
    // φ at the end of a block, relative to the attitude of the dwell.
    let off = |block: &Block| -log(&(block.state.attitude * attitude.transpose()));
    if let Some((before, start)) = before.and_then(|before| Some((before, read(before)?))) {
        let turn = at_rest(start)?.advance(before.samples.end..dwell.samples.start);
        let variance = 2.0 * attitude_variance + walk.gyro * turn.duration;
        add(equations, &turn, 0, off(&turn), variance);
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
    let variance = imu.pulse.gyro.powi(2) / 6.0 + walk.gyro * stand.duration;
    add(equations, &stand, 0, off(&stand), variance);
    // A tilt of the table makes gravity change the velocity.
    let variance = (run.site.gravity * stand.duration).powi(2) * attitude_variance
        + walk.accel * stand.duration
        + imu.pulse.accel.powi(2) / 6.0;
    add(equations, &stand, 3, stand.state.velocity, variance);
    Ok(())
}

/// Adds three rows of a block from `first` on.
fn add(
    equations: &mut Equations,
    block: &Block,
    first: usize,
    residual: Vector3<f64>,
    variance: f64,
) {
    let mut partials = Partials::zeros();
    for sensor in Sensor::ALL {
        let rows = block
            .parameters
            .get(sensor)
            .fixed_view::<3, PER_TRIAD>(first, 0);
        partials += of(sensor, &rows.into_owned());
    }
    let variance = variance + ROUNDING.powi(2);
    equations.add(&Rows::new(partials, residual, variance));
}
