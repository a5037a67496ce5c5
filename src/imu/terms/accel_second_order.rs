//! Accelerometer output proportional to the square of specific force along its axis.

use super::entry::{PER_AXIS, TermEntry};
use crate::imu::Sensor;
use crate::units::{MICRO_G, STANDARD_GRAVITY};

pub const ENTRY: TermEntry = TermEntry {
    name: "accel-second-order",
    title: "accel second order",
    help: "Accelerometers: square of specific force",
    adds: "q f^2 to f, along its axis",
    shown_by: "dwells with each axis up, down, level and at 45°",
    sensor: Sensor::Accel,
    unit: ("µg/g²", MICRO_G / (STANDARD_GRAVITY * STANDARD_GRAVITY)),
    si_unit: "s^2/m",
    d_si_unit: "\\second\\tothe{2}\\metre\\tothe{-1}",
    usual_sigma: 100.0,
    largest: 1.0 / STANDARD_GRAVITY,
    parameters: ("accel.second_order", &PER_AXIS),
    response: |sensed, _, columns| columns.set_diagonal(&sensed.force.map(|f| f.powi(2))),
    added: None,
};
