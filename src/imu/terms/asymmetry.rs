//! Scale-factor asymmetry of either triad: different scale factors for positive and negative input.

use super::entry::{PER_AXIS, TermEntry};
use crate::imu::Sensor;
use crate::units::PPM;

pub const ACCEL: TermEntry = TermEntry {
    name: "accel-asymmetry",
    title: "accel asymmetry",
    help: "Accelerometers: magnitude of specific force",
    adds: "q |f| to f, along its axis",
    shown_by: "dwells with each axis up, down, level and at 45°",
    sensor: Sensor::Accel,
    unit: ("ppm", PPM),
    si_unit: "1",
    d_si_unit: "\\one",
    usual_sigma: 100.0,
    largest: 1.0,
    parameters: ("accel.asymmetry", &PER_AXIS),
    response: |sensed, _, columns| columns.set_diagonal(&sensed.force.abs()),
    added: None,
};

pub const GYRO: TermEntry = TermEntry {
    name: "gyro-asymmetry",
    title: "gyro asymmetry",
    help: "Gyros: different scale factor for each sense of rotation",
    adds: "q |w| to w, along its axis",
    shown_by: "turns both ways about each axis",
    sensor: Sensor::Gyro,
    parameters: ("gyro.asymmetry", &PER_AXIS),
    response: |sensed, _, columns| columns.set_diagonal(&sensed.rate.abs()),
    ..ACCEL
};
